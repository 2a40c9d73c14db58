"""Cells, recordings and rigs that go wrong in every way that has been seen."""

import json
from collections import Counter
from pathlib import Path

import pytest

from tactbench.core.matrix.merge import SEED_DECIDES
from tactbench.core.matrix.store import Store
from tests.conftest import Verbs
from tests.core.cost.test_knobs import presses

ASKED = ("run", "--rig", "replay", "--recordings", "shelf", "--sensor", "made", "--task", "force", "--split", "session")
ANY_SENSOR = (*ASKED[:5], "--task", "force", "--estimator", "ols", "--split", "session", "--format", "json")
HONEST = ("ols", "mean", "time-index")
ENDS = {
    "evil-raise": ("failed", None, "RuntimeError: out of breath"),
    "evil-eat": ("out-of-memory", None, "more than 200 MB"),
    "evil-latin": ("failed", None, r"ValueError: sh\udce9lf/levels.txt is not there"),
    "evil-import": ("crashed", 6, "SIGABRT"),
    "evil-patch": ("done", None, ""),
}
"""Status, signal and a part of the reason of every evil cell."""


def decided(folder):
    """Return by estimator what a seed decides of each row that a folder keeps."""
    return {row["estimator"]: {name: row[name] for name in SEED_DECIDES} for row in Store(folder).rows()}


def test_every_evil_cell_has_one_row_and_the_others_are_right(tmp_path):
    presses(tmp_path / "shelf")
    Verbs(tmp_path, here=True)(*ASKED, "--estimator", "ols", "--out", "honest")
    asked = [word for name in (*ENDS, "ols") for word in ("--estimator", name)]  # the honest ones come last
    done = Verbs(tmp_path)(*ASKED, *asked, "--memory", "200", "--jobs", "2", "--out", "out", "--format", "json",
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
    there = decided(tmp_path / "out")
    assert {name: there[name] for name in HONEST} == decided(tmp_path / "honest")
    assert "Traceback" not in done.stderr


def test_a_file_that_cannot_be_read_costs_its_own_cells_only(tmp_path):
    presses(tmp_path / "shelf")
    (tmp_path / "shelf" / "icub").mkdir()
    (tmp_path / "shelf" / "icub" / "flat.h5").write_bytes(b"no recording at all")
    rows = json.loads(Verbs(tmp_path, here=True)(*ANY_SENSOR, code=1).stdout)
    ends = {(row["sensor"], row["status"], "flat.h5" in str(row["reason"])) for row in rows}
    assert ends == {("made", "done", False), ("icub", "failed", True)}


def test_recordings_whose_names_are_no_utf8_are_evaluated_and_found_again(tmp_path):
    shelf = presses(tmp_path / "sh\udce9lf")
    (shelf / "press-0.h5").rename(shelf / "pr\udce9ss.h5")
    verbs, asked = Verbs(tmp_path, here=True), [shelf.name if word == "shelf" else word for word in ANY_SENSOR]
    rows = json.loads(verbs(*asked, "--out", "out").stdout)
    assert {row["status"] for row in rows} == {"done"}
    written = {path: path.stat().st_mtime_ns for path in (tmp_path / "out" / "cells").iterdir()}
    verbs(*asked, "--out", "out")
    assert {path: path.stat().st_mtime_ns for path in written} == written, "all were found finished"
    store = Store(tmp_path / "out")
    assert {path for row in store.rows() for _, path in store.recordings(row)} == {*shelf.iterdir()}
    for suffix in ("txt", "tex"):
        verbs("leaderboard", "out", "--to", f"board.{suffix}")
    (tmp_path / "out" / "leaderboard.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("rig", "says", "kept"),
    [
        ("evil-unbuilt", "OSError", 0),
        ("evil-dying", "SIGABRT", 2),
        ("evil-device", "2 s", 2),
    ],
)
def test_a_rig_that_cannot_record_gives_rows_that_say_so(tmp_path, rig, says, kept):
    asked = ("run", "--repeats", "1", "--rig", rig, "--sensor", "ideal", "--task", "force", "--protocol", "karl2016",
             "--estimator", "ols", "--timeout", "2", "--jobs", "2", "--format", "json")  # fmt: skip
    done = Verbs(tmp_path)(*asked, plugins=("evil",), code=1)
    rows = json.loads(done.stdout)
    assert {row["estimator"] for row in rows} == set(HONEST)
    assert all(says in row["reason"] for row in rows), rows[0]["reason"]
    found = [path.name for path in (tmp_path / "tactbench-results" / "recordings").rglob("*.h5")]
    assert len(found) == kept, "the other scenes are kept"
    if rig == "evil-device":
        assert Path(tmp_path / "let-go-of").read_text().splitlines().count("flat-validation") == 1
