"""``tactbench why --again``: every cell comes out the same bit for bit, and what was changed by hand is found."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from tactbench.core.matrix.store import Store
from tests.conftest import Shell, Verbs
from tests.core.matrix.plugin_packages import write_acme

RUN = (
    "run", "--repeats", "1", "--sensor", "ideal", "--task", "force", "--estimator", "acme", "--estimator", "ols",
    "--estimator", "acme-raises", "--effects", "-drift", "--seed", "3",
)  # fmt: skip
CELLS = [f"ideal/force/twin/karl2016/{name}/1" for name in ("acme", "ols", "mean", "time-index")]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rerun")
    write_acme(folder / "site")
    verbs = Verbs(folder, here=True)
    verbs(*RUN, "--out", "results", plugins=(str(folder / "site"),), code=1)
    verbs("run", "--rig", "replay", "--recordings", "results/recordings/ideal", "--task", "force",
          "--estimator", "ols", "--protocol", "karl2016", "--out", "replayed")  # fmt: skip
    return folder


@pytest.fixture
def here(made, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(made, folder)

    def ask(*words, call=None, code=0):
        ask = call or Verbs(folder, here=True)
        return ask(*words, "--out", "results", plugins=(str(folder / "site"),), code=code).stdout

    def rerun(cell, *words, **options):
        return json.loads(ask("why", cell, "--again", *words, "--format", "json", **options))

    rerun.folder, rerun.ask = folder, ask
    return rerun


def every_file(folder):
    """Return all files but the index, which notes where recordings lie."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.suffix != ".sqlite"}


@pytest.mark.parametrize("cell", CELLS)
def test_every_cell_comes_out_the_same_and_nothing_in_the_folder_changes(here, cell):
    before = every_file(here.folder / "results")
    found = here(cell, call=Shell(here.folder) if cell == CELLS[0] else None)
    assert (found["answer"], found["differences"], found["recordings_made"]) == ("identical", [], 3)
    assert every_file(here.folder / "results") == before


def test_a_replayed_cell_is_answered_from_the_same_recordings(here):
    (row,) = [row for row in json.loads((here.folder / "replayed" / "leaderboard.json").read_text())
              if row["estimator"] == "ols"]  # fmt: skip
    found = json.loads(
        Verbs(here.folder)("why", row["cell"], "--again", "--out", "replayed", "--format", "json").stdout
    )
    assert (found["answer"], found["recordings_made"]) == ("identical", 0)


def test_another_prediction_in_the_folder_is_found(here):
    store = Store(here.folder / "results")
    (row,) = [row for row in store.rows() if row["cell"] == CELLS[0]]
    answers = store.answers(row["key"])
    y_pred = answers["test"].y_pred.copy()
    y_pred[3] = np.nextafter(y_pred[3], np.inf)
    store.keep(row, store.cell(row).sections, {**answers, "test": replace(answers["test"], y_pred=y_pred)})
    found = here(CELLS[0], code=1)
    assert found["answer"] == "different"
    (difference,) = found["differences"]
    assert difference.startswith("answers: test ")


def test_a_recording_changed_by_hand_is_found(here):
    folder = here.folder / "results" / "recordings" / "ideal"
    (test,), (train,) = folder.glob("flat-test-*.h5"), folder.glob("flat-train-*.h5")
    shutil.copy(train, test)
    found = here("mean/1")
    (changed,) = found["circumstances"]
    assert found["answer"] == "identical", "it is made anew, as the cell had it"
    assert changed.startswith(f"data: {test.stem} ")


def test_changed_code_is_named_beside_what_came_out(here):
    (here.folder / "site" / "acme" / "filters.py").write_text("LAW = 0.5\n")
    found = here(CELLS[0], code=1)
    assert any(difference.startswith("score ") for difference in found["differences"])
    (changed,) = found["circumstances"]
    assert changed.startswith("source: acme ")
    said = here.ask("why", CELLS[0], "--again", code=1)
    assert f"Since the cell was made, this has changed:\n  {changed}" in said


def test_a_cell_that_fails_fails_again_and_shows_where(here):
    found = here("acme-raises", code=1)
    assert (found["status"], found["differences"]) == ("failed", [])
    assert "the pad came off" in found["traceback"]
