"""Cells, recordings and rigs that go wrong in every way that has been seen, through the real command line."""

import json
from collections import Counter
from pathlib import Path

import h5py
import psutil
import pytest

from tactbench.core.matrix.store import Store
from tactbench.core.matrix.summary import SEED_DECIDES
from tests.conftest import Shell, Verbs
from tests.core.cost.test_ladder import presses
from tests.core.pool.patience import until

LIMITS = ("--timeout", "8", "--memory", "400")
"""One that forks holds what it shares twice; the one that eats has no end."""
ASKED = ("run", "--rig", "replay", "--recordings", "shelf", "--sensor", "made", "--task", "force", "--split", "session")
ANY_SENSOR = (*ASKED[:5], "--task", "force", "--estimator", "ols", "--split", "session", "--format", "json")
HONEST = ("ols", "mean", "time-index")
ENDS = {
    "evil-raise": ("failed", None, "RuntimeError: out of breath"),
    "evil-exit": ("failed", None, "SystemExit: I am off"),
    "evil-interrupt": ("failed", None, "KeyboardInterrupt"),
    "evil-abort": ("crashed", 6, "SIGABRT"),
    "evil-vanish": ("crashed", None, "exit code 0"),
    "evil-hang": ("timeout", None, "longer than 8 s"),
    "evil-eat": ("out-of-memory", None, "more than 400 MB"),
    "evil-shape": ("failed", None, "answered 120 rows with shape (119,)"),
    "evil-nan": ("failed", None, "120 values that are NaN or infinite"),
    "evil-text": ("failed", None, "values of type <U"),
    "evil-print": ("done", None, ""),
    "evil-fork": ("done", None, ""),
    "evil-kill": ("crashed", 9, "SIGKILL"),
    "evil-import": ("crashed", 6, "SIGABRT"),
    "evil-patch": ("done", None, ""),
    "evil-built-elsewhere": ("done", None, ""),
}
"""Status, signal and a part of the reason of every evil cell."""


def decided(folder):
    """Return by estimator what a seed decides of each row that a folder keeps."""
    return {row["estimator"]: {name: row[name] for name in SEED_DECIDES} for row in Store(folder).rows()}


def processes_in(folder):
    """Return the processes that were started in `folder` and are still there."""
    return [one.info for one in psutil.process_iter(["pid", "cwd", "cmdline"]) if one.info["cwd"] == str(folder)]


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The honest cells without any evil one beside them."""
    verbs = Verbs(tmp_path_factory.mktemp("honest"), here=True)
    presses(verbs.folder / "shelf")
    verbs(*ASKED, "--estimator", "ols", "--out", "out")
    return decided(verbs.folder / "out"), verbs.folder / "shelf"


def test_every_evil_cell_has_one_row_and_the_others_are_right(alone, tmp_path):
    honest, shelf = alone
    (tmp_path / "shelf").symlink_to(shelf)
    asked = [word for name in (*ENDS, "ols") for word in ("--estimator", name)]  # the honest ones come last
    done = Shell(tmp_path)(*ASKED, *asked, *LIMITS, "--jobs", "2", "--out", "out", "--format", "json",
                           plugins=("evil",), code=1)  # fmt: skip
    listed = json.loads(done.stdout)
    assert Counter(row["estimator"] for row in listed) == Counter([*HONEST, *ENDS])
    kept = {row["estimator"]: row for row in Store(tmp_path / "out").rows()}
    assert set(kept) == {*HONEST, *ENDS}
    for name, (status, signal, says) in ENDS.items():
        row = kept[name]
        assert (row["status"], row["signal"]) == (status, signal), (row["reason"], done.stderr[-3000:])
        assert says in row["reason"]
        if status != "done":
            assert f"  {status:<13}  {row['cell']}: " in done.stderr
    assert "in _raise" in kept["evil-raise"]["traceback"]
    assert "in _hang" in kept["evil-hang"]["traceback"]
    assert {name: row for name, row in decided(tmp_path / "out").items() if name in HONEST} == honest
    assert "said" not in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert until(lambda: not processes_in(tmp_path)), processes_in(tmp_path)
    again = Shell(tmp_path)(*ASKED, "--estimator", "ols", "--estimator", "evil-raise", "--engine", "in-process",
                            "--out", "out", plugins=("evil",), code=1)  # fmt: skip
    assert "3 of 4 answers were found finished, 1 computed now" in again.stderr, "what was finished is kept"


def test_a_file_that_cannot_be_read_costs_its_own_cells_only(tmp_path):
    presses(tmp_path / "shelf")
    (tmp_path / "shelf" / "icub").mkdir()
    (tmp_path / "shelf" / "icub" / "flat.h5").write_bytes(b"no recording at all")
    rows = json.loads(Verbs(tmp_path, here=True)(*ANY_SENSOR, code=1).stdout)
    ends = {(row["sensor"], row["status"], "flat.h5" in str(row["reason"])) for row in rows}
    assert ends == {("made", "done", False), ("icub", "failed", True)}


def test_a_recording_that_lacks_its_streams_is_told_by_its_cells(tmp_path):
    presses(tmp_path / "shelf")
    damaged = sorted((tmp_path / "shelf").rglob("*.h5"))[0]
    with h5py.File(damaged, "a") as file:
        del file["streams"]
    asked = (*ASKED, "--estimator", "ols", "--estimator", "ridge", "--format", "json")
    rows = json.loads(Verbs(tmp_path, here=True)(*asked, code=1).stdout)
    assert all(row["status"] == "failed" and damaged.name in row["reason"] for row in rows)


def test_a_shelf_that_cannot_be_read_at_all_has_rows_where_a_sensor_is_named(tmp_path):
    (tmp_path / "shelf").mkdir()
    (tmp_path / "shelf" / "a.h5").write_bytes(b"no recording at all")
    verbs = Verbs(tmp_path, here=True)
    assert "a.h5" in verbs(*ANY_SENSOR, code=2).stderr
    rows = json.loads(verbs(*ANY_SENSOR, "--sensor", "made", code=1).stdout)
    assert [(row["status"], "a.h5" in row["reason"]) for row in rows] == [("failed", True)] * 3


@pytest.mark.parametrize(
    ("rig", "says", "kept"),
    [
        ("evil-unbuilt", "could not be built: OSError: no such port", 0),
        ("evil-leaving", "could not be built: SystemExit: 0", 0),
        ("evil-closed", "the door is locked", 0),
        ("evil-dying", "signal 6 (SIGABRT)", 2),
        ("evil-stuck", "longer than 3 s", 2),
        ("evil-device", "longer than 3 s", 2),
    ],
)
def test_a_rig_that_cannot_record_gives_rows_that_say_so(tmp_path, rig, says, kept):
    asked = ("run", "--repeats", "1", "--rig", rig, "--sensor", "ideal", "--task", "force", "--protocol", "karl2016",
             "--estimator", "ols", "--timeout", "3", "--jobs", "2", "--format", "json")  # fmt: skip
    done = Shell(tmp_path)(*asked, plugins=("evil",), code=1)
    rows = json.loads(done.stdout)
    assert {row["estimator"] for row in rows} == set(HONEST)
    assert all(says in row["reason"] for row in rows), rows[0]["reason"]
    assert "good bye" not in done.stdout
    found = [path.name for path in (tmp_path / "tactbench-results" / "recordings").rglob("*.h5")]
    assert len(found) == kept, "the other scenes are kept"
    if rig == "evil-device":
        assert Path(tmp_path / "let-go-of").read_text().splitlines().count("flat-validation") == 1
    assert until(lambda: not processes_in(tmp_path)), processes_in(tmp_path)
