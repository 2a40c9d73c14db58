"""Whole runs on Dask, from scene to scores, as a person starts them: the bytes are those of a serial run."""

import os
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager

import pytest

from tests.conftest import Verbs
from tests.core.matrix.started import started
from tests.core.pool.patience import ending, until

ASKED = ("--sensor", "ideal", "--task", "force", "--estimator", "ols", "--estimator", "forest-10")
RUN = ("run", "--repeats", "1", *ASKED)


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """A command line with the result of a serial run in its folder."""
    verbs = Verbs(tmp_path_factory.mktemp("runs"))
    verbs(*RUN, "--engine", "isolated", "--out", "serial")
    return verbs


@contextmanager
def begun(serial, out, *options):
    """Start a run that finds the recordings made, in a session of its own."""
    shutil.copytree(serial.folder / "serial" / "recordings", serial.folder / out / "recordings")
    with ending(
        [sys.executable, "-m", "tactbench", *RUN, "--out", out, "--engine", "dask", *options],
        cwd=serial.folder, env={**os.environ, "PYTHONWARNINGS": "error", "OMP_NUM_THREADS": "1"}, text=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    ) as running:  # fmt: skip
        yield running


def said(running, beginning):
    """Read what a run says until a line begins like this; return that line."""
    heard = []
    for line in running.stderr:
        heard.append(line)
        if line.startswith(beginning):
            return line
    raise AssertionError("".join(heard))


def test_a_cluster_of_our_own_gives_the_bytes_of_a_serial_run(serial):
    with begun(serial, "own", "--jobs", "2") as running:
        out, err = running.communicate(timeout=120)
    assert running.returncode == 0, err
    folder = serial.folder
    assert (folder / "own" / "scores.json").read_bytes() == (folder / "serial" / "scores.json").read_bytes()
    assert "distributed" not in out + err
    assert "Traceback" not in err
    assert {path.name for path in (folder / "own").iterdir()} == {path.name for path in (folder / "serial").iterdir()}
    assert until(lambda: not session(running.pid)), "no process is left"


def test_a_worker_killed_in_the_middle_costs_nothing(serial, tmp_path):
    with started(tmp_path) as cluster:
        doomed = cluster.worker()
        cluster.worker()
        with begun(serial, "killed", "--scheduler", cluster.address) as running:
            assert said(running, "evaluating: 1/")
            doomed.send_signal(signal.SIGKILL)
            _, err = running.communicate(timeout=120)
    assert running.returncode == 0, err
    folder = serial.folder
    assert (folder / "killed" / "scores.json").read_bytes() == (folder / "serial" / "scores.json").read_bytes()


def test_ctrl_c_leaves_no_process_and_keeps_what_was_finished(serial):
    with begun(serial, "interrupted", "--jobs", "1") as running:
        assert said(running, "evaluating: 1/")
        os.killpg(running.pid, signal.SIGINT)
        out, err = running.communicate(timeout=60)
    assert running.returncode == 130, err
    assert "goes on from there" in err
    assert "Traceback" not in err
    assert out == ""
    assert until(lambda: not session(running.pid)), "no process is left"
    assert list((serial.folder / "interrupted" / "cells").glob("*.h5"))


def test_without_a_scheduler_nothing_is_recorded(verbs):
    done = verbs(*RUN, "--engine", "dask", "--scheduler", "tcp://127.0.0.1:1", code=2)
    assert "tcp://127.0.0.1:1" in done.stderr
    assert not list(verbs.folder.rglob("*.h5"))


def session(leader):
    """Processes of a run: those of its session, and servers, which have sessions of their own, by their parents."""
    found = []
    for entry in os.scandir("/proc"):
        if entry.name.isdigit():
            try:
                with open(f"{entry.path}/stat") as file:  # noqa: PTH123
                    state, parent, _, its = file.read().rpartition(")")[2].split()[:4]
            except OSError:
                continue
            if state not in "ZX" and (int(its) == leader or int(parent) in found):
                found.append(int(entry.name))
    return found
