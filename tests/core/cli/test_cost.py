"""``cost`` of estimators and of the simulated rig, as a person meets it."""

import csv
import io
import json

from tests.conftest import Verbs
from tests.core.cost.test_ladder import presses

ASKED = ("cost", "--sensor", "made", "--task", "force", "--recordings", "shelf", "--rounds", "2")
CLUMSY = tuple(word for name in ("breaks", "tires", "lacks", "wavers", "ols") for word in ("--estimator", name))


def test_an_estimator_that_breaks_costs_its_own_row_only(shell):
    presses(shell.folder / "shelf")
    done = shell(*ASKED, *CLUMSY, "--format", "json", plugins=("clumsy",))
    rows = {row["estimator"]: row for row in json.loads(done.stdout)}
    assert {name: rows[name]["status"] for name in ("ols", "breaks", "tires", "lacks")} == {
        "ols": "done", "breaks": "failed", "tires": "failed", "lacks": "skipped",
    }  # fmt: skip
    assert "out of breath" in rows["breaks"]["reason"]
    files = {path.name for path in (shell.folder / "tactbench-results" / "cost").glob("made-force.*")}
    assert files == {f"made-force.{end}" for end in ("json", "csv", "png", "pdf")}
    verbs = Verbs(shell.folder, here=True)
    again = verbs(*ASKED, "--estimator", "ols", "--format", "csv")
    listed = list(csv.DictReader(io.StringIO(again.stdout)))
    assert {row["estimator"] for row in listed} == {"ols", "mean", "time-index"}
    assert all(float(row["answer_delay_ms"]) > 0 for row in listed)
    assert "2 rounds, 1 thread" in verbs(*ASKED, "--estimator", "ols").stdout
    assert verbs("leaderboard", code=2), "what is timed adds no row to the leaderboard"


def test_the_twins_cost_says_what_a_rung_scores_and_what_a_sensor_cannot_have(tmp_path):
    words = ("cost", "--twin", "--sensor", "bonded-pad", "--rounds", "1", "--task", "force", "--format", "json")
    done = Verbs(tmp_path, here=True)(*words, plugins=("bonded",))
    rows = {row["way"].rpartition(", up")[0] + (row["rung"] or ""): row for row in json.loads(done.stdout)}
    default, closed = rows["newton, 32 x 32default"], rows["closed form, 32 x 32closed-form"]
    assert default["error_rms"] > 0
    assert default["score_force"] > 0
    assert (closed["seconds"], closed["score_force"]) == (None, None)
    assert "Poisson's ratio 0.45" in closed["reason"]
    assert (tmp_path / "tactbench-results/cost/twin.png").exists()
