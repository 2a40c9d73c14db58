"""Signals that end a command, and output that is closed."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile

import pytest

from tactbench.core.matrix.store import Store
from tests.conftest import ROOT
from tests.core.cost.test_knobs import presses
from tests.core.matrix.test_evil_cells import ASKED
from tests.core.pool.patience import ending, processes_in, until

COMMAND = [sys.executable, "-m", "tactbench"]
RUN = ("run", "--sensor", "ideal", "--task", "force", "--estimator", "ols", "--repeats", "3", "--jobs", "1",
       "--out", "out")  # fmt: skip
DROPPED = """
import os, sys
from tactbench.core.interrupts import end_alike
class Ends:
    def __del__(self):
        os.kill(os.getpid(), int(sys.argv[1]))
        for _ in range(1000): pass
end_alike()
try:
    Ends()
    while True: pass
except KeyboardInterrupt:
    print("ended")
"""


@pytest.fixture
def there(tmp_path):
    """A folder, and how to start a process in it whose temporary folder is of its own."""
    short = tempfile.mkdtemp(prefix="t")  # addresses of sockets lie in it, of at most 107 characters
    (tmp_path / "tmp").symlink_to(short)
    env = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": short, "OMP_NUM_THREADS": "1"}
    how = {"cwd": tmp_path, "env": env, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True,
           "stdin": subprocess.DEVNULL, "start_new_session": True}  # fmt: skip
    yield tmp_path, how
    shutil.rmtree(short)


def nothing_left(folder):
    return not processes_in(folder) and not list((folder / "tmp").iterdir())


@pytest.mark.parametrize(
    ("number", "begun"), [(signal.SIGTERM, "recordings/**/*.h5*"), (signal.SIGHUP, "cells/[!.]*.h5")]
)
def test_a_run_ends_with_a_message_and_leaves_nothing_but_what_was_finished(there, number, begun):
    folder, how = there
    with ending([*COMMAND, *RUN, "--repeats", "40"], **how) as run:
        assert until(lambda: any((folder / "out").glob(begun)), 60)
        run.send_signal(number)
        run.send_signal(number)
        _, said = run.communicate(timeout=60)
    assert (run.returncode, "Interrupted" in said, "Traceback" in said) == (128 + number, True, False), said
    assert until(lambda: nothing_left(folder)), [*processes_in(folder), *(folder / "tmp").rglob("*")]
    assert not [path for path in (folder / "out").rglob("*") if path.suffix in (".partial", ".completing")]
    assert {row["status"] for row in Store(folder / "out").rows()} <= {"done"}


def test_a_signal_that_is_ignored_at_the_start_stays_ignored(there):
    folder, how = there
    with ending(["nohup", *COMMAND, *RUN], **how) as run:
        assert until(lambda: any((folder / "out" / "cells").glob("[!.]*.h5")), 60)
        run.send_signal(signal.SIGHUP)
        _, said = run.communicate(timeout=60)
    assert run.returncode == 0, said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_that_python_drops_is_sent_again(there, number):
    with ending([sys.executable, "-c", DROPPED, str(int(number))], **there[1]) as process:
        assert process.communicate(timeout=60)[0] == "ended\n"


def test_ctrl_c_at_the_terminal_ends_the_workers_of_dask_without_a_traceback(there):
    folder, how = there
    presses(folder / "shelf")
    asked = (*ASKED, "--estimator", "svm", "--engine", "dask", "--jobs", "1", "--out", "out")
    with ending([*COMMAND, *asked], **how) as run:
        assert until(lambda: any((folder / "out" / "cells").glob("[!.]*.h5")), 60)
        os.killpg(run.pid, signal.SIGINT)
        _, said = run.communicate(timeout=60)
    assert (run.returncode, "Interrupted" in said, "Traceback" in said) == (130, True, False), said
    assert until(lambda: nothing_left(folder)), [*processes_in(folder), *(folder / "tmp").rglob("*")]


def test_output_that_is_closed_is_no_error(there):
    folder, how = there
    presses(folder / "shelf")
    run = (*ASKED, "--estimator", "ols", "--out", "out")
    for closed, words in ((">&-", ("list",)), ("2>&-", ("list",)), ("<&- >&- 2>&-", run)):
        with ending(["sh", "-c", f'"$@" {closed}', "sh", *COMMAND, *words], **how) as verb:
            out, err = verb.communicate(timeout=60)
        assert (verb.returncode, "Traceback" in out + err) == (0, False), err
    assert {row["status"] for row in Store(folder / "out").rows()} == {"done"}
