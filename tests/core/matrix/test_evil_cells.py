"""Cells, recordings and rigs that do the worst that has been seen, through the real command line, on every engine."""

import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import h5py
import pytest

from tactbench.core.matrix.store import Store
from tests.conftest import ROOT, THIRD_PARTY, Shell, Verbs
from tests.core.cost.test_ladder import presses
from tests.core.pool.patience import ending, until

ENGINES = {
    "in-process": ("--engine", "in-process"),
    "isolated-2": ("--engine", "isolated", "--jobs", "2"),
    "dask": ("--engine", "dask", "--jobs", "2"),
}
"""Every engine that the evil cells must survive under: one place for all of them. Of several cells the engine
in-process carries out each in a child process, as isolated does with one job."""
LEFT_OUT = {"in-process": {"evil-hang", "evil-deaf"}, "dask": {"evil-scribble"}}
"""What takes long to show again what two jobs show: time-outs one after the other, and a second cluster."""

LIMITS = ("--timeout", "3", "--memory", "120")
"""The memory is for what a cell imports, too; the one that eats has no end."""
ASKED = ("run", "--rig", "replay", "--recordings", "shelf", "--sensor", "made", "--task", "force", "--split", "session")
HONEST = ("ols", "mean", "time-index")
ENDS = {
    "evil-raise": ("failed", None, "RuntimeError: out of breath"),
    "evil-exit": ("failed", None, "SystemExit: I am off"),
    "evil-interrupt": ("failed", None, "KeyboardInterrupt"),
    "evil-abort": ("crashed", 6, "SIGABRT"),
    "evil-vanish": ("crashed", None, "exit code 0"),
    "evil-hang": ("timeout", None, "longer than 3 s"),
    "evil-deaf": ("timeout", None, "longer than 3 s"),
    "evil-eat": ("out-of-memory", None, "more than 120 MB"),
    "evil-shape": ("failed", None, "answered 120 rows with shape (119,)"),
    "evil-nan": ("failed", None, "120 values that are NaN or infinite"),
    "evil-text": ("failed", None, "values of type <U"),
    "evil-print": ("done", None, ""),
    "evil-fork": ("done", None, ""),
    "evil-daemon": ("done", None, ""),
    "evil-scribble": ("done", None, ""),
    "evil-kill": ("crashed", 9, "SIGKILL"),
    "evil-import": ("crashed", 6, "SIGABRT"),
    "evil-patch": ("done", None, ""),
    "evil-lie": ("failed", None, "'score' is 0.125, outside its own interval"),
    "evil-promise": ("crashed", None, "do not begin with the length of a result"),
    "evil-built-elsewhere": ("done", None, ""),
    "evil-built-deaf": ("done", None, ""),
    "evil-built-limited": ("failed", None, "Too many open files"),
    "evil-built-kill": ("crashed", 9, "SIGKILL"),
}
"""Status, signal and a part of the reason of every evil cell."""


def run(command, *arguments, out="out", code=1, plugins=("evil",)):
    """Run and return the listed rows by estimator, and what the command printed."""
    done = command(*ASKED, *arguments, "--out", out, "--format", "json", plugins=plugins, code=code)
    listed = json.loads(done.stdout)
    assert Counter(row["cell"] for row in listed).most_common(1)[0][1] == 1, "one row a cell"
    return {row["estimator"]: row for row in listed}, done


def whole_rows(folder):
    """Return the rows by estimator, complete as the folder keeps them."""
    return {row["estimator"]: row for row in Store(folder).rows()}


def lines_of(folder):
    """Return what a seed decides of each cell, as it is written."""
    return [line.rstrip(",") for line in (folder / "scores.json").read_text().splitlines()[1:-1]]


def processes_in(folder):
    """Return the processes that were started in `folder` and are still there."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            if process.name.isdigit() and (process / "cwd").resolve() == folder.resolve():
                found.append((process / "cmdline").read_text().replace("\0", " "))
        except OSError:
            continue
    return found


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The honest cells without any evil one beside them."""
    verbs = Verbs(tmp_path_factory.mktemp("honest"))
    presses(verbs.folder / "shelf")
    run(verbs, "--estimator", "ols", code=0, plugins=())
    return lines_of(verbs.folder / "out"), verbs.folder / "shelf"


@pytest.mark.parametrize("engine", ENGINES)
def test_every_evil_cell_has_one_row_and_the_others_are_right(engine, alone, tmp_path):
    shell = Shell(tmp_path)
    honest, shelf = alone
    (tmp_path / "shelf").symlink_to(shelf)
    ends = {name: end for name, end in ENDS.items() if name not in LEFT_OUT.get(engine, ())}
    asked = [word for name in (*ends, "ols") for word in ("--estimator", name)]  # the honest ones come last
    rows, done = run(shell, *asked, *LIMITS, *ENGINES[engine])
    assert set(rows) == {*HONEST, *ends}
    for name, (status, _, says) in ends.items():
        assert rows[name]["status"] == status, (rows[name]["reason"], done.stderr[-3000:])
        assert says in rows[name]["reason"]
    kept = whole_rows(tmp_path / "out")
    assert set(kept) == set(rows), "what was written over is computed again"
    stopped = {name: row for name, row in kept.items() if row["status"] != "done"}
    assert set(stopped) == {name for name, end in ends.items() if end[0] != "done"}
    for name, row in stopped.items():
        assert row["signal"] == ENDS[name][1]
        assert f"  {row['status']:<13}  {row['cell']}: " in done.stderr
    assert "in _raise" in stopped["evil-raise"]["traceback"]
    if "evil-hang" in ends:
        assert "in _hang" in stopped["evil-hang"]["traceback"]
    for said in ("said by print", "said to stderr", "to descriptor 1", "said by a child"):
        assert said in kept["evil-print"]["log"]
    beside = [kept[name] for name in HONEST]
    assert {row["concurrency"] for row in beside} == {2 if "--jobs" in ENGINES[engine] else 1}
    assert len({row["host"] for row in beside}) == 1
    assert all(row["wall_s"] >= row["fit_s"] > 0 for row in beside)
    assert "tactbench why " in done.stderr
    lines = [line for line in lines_of(tmp_path / "out") if not any(f"/{name}/" in line for name in ENDS)]
    assert lines == honest, "not a byte of an honest score has changed"
    assert "said" not in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert until(lambda: not processes_in(tmp_path)), processes_in(tmp_path)


def test_a_single_cell_has_a_process_of_its_own_unless_it_is_asked_to_have_none(alone, tmp_path):
    (tmp_path / "shelf").symlink_to(alone[1])
    shutil.copytree(alone[1].parent / "out", tmp_path / "out")  # the baselines are there: one cell is left
    shell = Shell(tmp_path)
    rows, _ = run(shell, "--estimator", "evil-abort")
    assert (rows["evil-abort"]["status"], rows["mean"]["status"]) == ("crashed", "done")
    asked = (*ASKED, "--estimator", "evil-abort", "--engine", "in-process", "--out", "out", "--format", "json")
    assert shell(*asked, plugins=("evil",), code=None).returncode < 0, "carried out in the run itself"
    rows, _ = run(shell, "--estimator", "evil-raise", "--engine", "in-process")
    assert rows["evil-raise"]["status"] == "failed", "what was finished is kept"


def test_a_file_that_cannot_be_read_costs_its_own_cells_only(tmp_path):
    presses(tmp_path / "shelf")
    (tmp_path / "shelf" / "icub").mkdir()
    (tmp_path / "shelf" / "icub" / "flat.h5").write_bytes(b"no recording at all")
    asked = (*ASKED[:5], "--task", "force", "--estimator", "ols", "--split", "session", "--format", "json")
    done = Verbs(tmp_path)(*asked, code=1)
    rows = json.loads(done.stdout)
    assert {row["status"] for row in rows if row["sensor"] == "made"} == {"done"}
    assert {(row["status"], "flat.h5" in row["reason"]) for row in rows if row["sensor"] == "icub"} == {
        ("failed", True)
    }


def test_a_recording_that_lacks_its_streams_is_told_by_its_cells(tmp_path):
    presses(tmp_path / "shelf")
    damaged = sorted((tmp_path / "shelf").rglob("*.h5"))[0]
    with h5py.File(damaged, "a") as file:
        del file["streams"]
    asked = (*ASKED, "--estimator", "ols", "--estimator", "ridge", "--format", "json")
    rows = json.loads(Verbs(tmp_path)(*asked, code=1).stdout)
    assert all(row["status"] == "failed" and damaged.name in row["reason"] for row in rows)


@pytest.mark.parametrize("asked", [("--sensor", "made"), ()])
def test_a_shelf_that_cannot_be_read_at_all_has_rows_as_well(tmp_path, asked):
    (tmp_path / "shelf").mkdir()
    (tmp_path / "shelf" / "a.h5").write_bytes(b"no recording at all")
    done = Verbs(tmp_path)(*ASKED[:5], *asked, "--task", "force", "--estimator", "ols", "--format", "json", code=1)
    rows = json.loads(done.stdout)
    assert len(rows) == 3
    assert all(row["status"] == "failed" and "a.h5" in row["reason"] for row in rows)


def recorded(tmp_path, rig, *options):
    """Record the task `force` with the ideal sensor on an evil rig; return the rows and what was printed."""
    asked = (
        "run",
        "--repeats",
        "1",
        "--rig",
        rig,
        "--sensor",
        "ideal",
        "--task",
        "force",
        "--protocol",
        "karl2016",
        "--estimator",
        "ols",
    )
    done = Shell(tmp_path)(*asked, *options, "--format", "json", plugins=("evil",), code=1)
    return json.loads(done.stdout), done


@pytest.mark.parametrize(
    ("rig", "says"),
    [
        ("evil-unbuilt", "could not be built: OSError: no such port"),
        ("evil-leaving", "could not be built: SystemExit: 0"),
        ("evil-closed", "the door is locked"),
        ("evil-dying", "signal 6 (SIGABRT)"),
        ("evil-stuck", "longer than 3 s"),
        ("evil-device", "longer than 3 s"),
    ],
)
def test_a_rig_that_cannot_record_gives_rows_that_say_so(tmp_path, rig, says):
    rows, done = recorded(tmp_path, rig, "--timeout", "3")
    assert {row["estimator"] for row in rows} == {"ols", "mean", "time-index"}
    assert all(says in row["reason"] for row in rows)
    assert "good bye" not in done.stdout
    kept = [path.name for path in (tmp_path / "tactbench-results" / "recordings").rglob("*.h5*")]
    assert len(kept) == (2 if rig in ("evil-dying", "evil-stuck", "evil-device") else 0), "the other scenes are kept"
    assert not any(name.endswith(".partial") for name in kept)
    if rig == "evil-device":
        assert (tmp_path / "let-go-of").read_text().splitlines().count("flat-validation") == 1
    assert until(lambda: not processes_in(tmp_path)), processes_in(tmp_path)


def test_a_misspelt_split_is_refused_before_anything_is_recorded(tmp_path):
    asked = ("run", "--repeats", "1", "--sensor", "icub", "--task", "force", "--protocol", "deployable")
    done = Verbs(tmp_path)(*asked, "--split", "sesion", code=2)
    assert "Did you mean 'session'" in done.stderr
    assert not list(tmp_path.rglob("*.h5"))


def test_options_that_do_not_go_together_are_refused(tmp_path):
    verbs = Verbs(tmp_path)
    assert "--jobs" in verbs(*ASKED, "--engine", "in-process", "--jobs", "2", code=2).stderr
    assert "--engine dask" in verbs(*ASKED, "--scheduler", "tcp://127.0.0.1:1", code=2).stderr


def test_number_of_jobs_and_order_change_no_score(alone, tmp_path):
    (tmp_path / "shelf").symlink_to(alone[1])
    verbs = Verbs(tmp_path)
    texts = {}  # of Dask: tests.core.matrix.test_dask_runs
    for name, first, last in (("in-process", "forest-10", "ridge"), ("isolated-2", "ridge", "forest-10")):
        asked = ("--estimator", first, "--estimator", last, "--repeats", "2", *ENGINES[name])
        run(verbs, *asked, out=name, code=0, plugins=())
        texts[name] = json.loads((tmp_path / name / "scores.json").read_text())
    in_order, turned = ({row["cell"]: row for row in rows} for rows in texts.values())
    assert in_order == turned


def test_a_parent_that_is_killed_takes_its_cells_with_it(alone, tmp_path):
    (tmp_path / "shelf").symlink_to(alone[1])
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(THIRD_PARTY / "evil"), str(ROOT)])}
    command = [sys.executable, "-m", "tactbench", *ASKED, "--estimator", "evil-hang", "--jobs", "2"]
    with ending(command, cwd=tmp_path, env=env, stderr=subprocess.PIPE, text=True) as running:
        for line in running.stderr:
            if "evaluating: 2/3" in line:  # the baselines are done: the one that hangs is under way
                break
        assert until(lambda: len(processes_in(tmp_path)) >= 2), "the run, and the process of the cell"
        running.kill()
        running.stderr.read()  # closed once nobody holds it any more
        assert until(lambda: not processes_in(tmp_path))
