"""What a run into a fresh folder reads ahead changes nothing: a limit of time has everything read in its turn."""

import json
from pathlib import Path

import h5py
import pytest

from tests.conftest import Shell
from tests.core.cost.test_ladder import presses
from tests.core.matrix.test_evil_cells import ASKED

IN_TURN = ("--timeout", "600")
CELLS = ("--estimator", "ols", "--estimator", "ridge", "--format", "json")


@pytest.fixture(scope="module")
def shell(tmp_path_factory):
    shell = Shell(tmp_path_factory.mktemp("ahead"))
    presses(shell.folder / "shelf")
    return shell


def test_scores_are_the_same_bytes(shell):
    shell(*ASKED, *CELLS, "--out", "ahead")
    shell(*ASKED, *CELLS, *IN_TURN, "--out", "in-turn")
    ahead, in_turn = ((shell.folder / out / "scores.json").read_bytes() for out in ("ahead", "in-turn"))
    assert ahead == in_turn


def test_a_recording_that_cannot_be_read_is_told_by_its_cells(tmp_path):
    shell = Shell(tmp_path)
    presses(tmp_path / "shelf")
    damaged = sorted(Path(tmp_path / "shelf").rglob("*.h5"))[0]
    with h5py.File(damaged, "a") as file:
        del file["streams"]
    told = []
    for number, more in enumerate(((), IN_TURN)):
        rows = json.loads(shell(*ASKED, *CELLS, *more, "--out", f"out{number}", code=1).stdout)
        told.append([(row["cell"], row["status"], row["reason"]) for row in rows])
    assert told[0] == told[1]
    assert all(status == "failed" and damaged.name in reason for _, status, reason in told[0])
