"""``cost`` of estimators and of the simulated rig."""

import json

from tests.conftest import Verbs
from tests.core.cost.test_ladder import presses
from tests.core.report.unrendered import unrendered

ASKED = ("cost", "--sensor", "made", "--task", "force", "--recordings", "shelf", "--rounds", "1", "--format", "json")


def test_an_estimator_that_breaks_costs_its_own_row_only(tmp_path):
    presses(tmp_path / "shelf")
    verbs = Verbs(tmp_path, here=True)
    with unrendered():
        rows = {
            row["estimator"]: row
            for row in json.loads(
                verbs(*ASKED, "--estimator", "evil-raise", "--estimator", "ols", plugins=("evil",)).stdout
            )
        }
    assert (rows["ols"]["status"], rows["evil-raise"]["status"]) == ("done", "failed")
    assert "out of breath" in rows["evil-raise"]["reason"]
    files = {path.name for path in (tmp_path / "tactbench-results" / "cost").glob("made-force.*")}
    assert files == {f"made-force.{end}" for end in ("json", "csv", "png", "pdf")}
    assert verbs("leaderboard", code=2), "what is timed adds no row to the leaderboard"


def test_the_twins_cost_says_what_a_rung_scores_and_what_a_sensor_cannot_have(tmp_path):
    words = ("cost", "--twin", "--sensor", "acme-pad", "--rounds", "1", "--task", "force", "--format", "json")
    with unrendered():
        done = Verbs(tmp_path, here=True)(*words, plugins=("good",))
    rows = {row["way"].rpartition(", up")[0] + (row["rung"] or ""): row for row in json.loads(done.stdout)}
    default, closed = rows["newton, 32 x 32default"], rows["closed form, 32 x 32closed-form"]
    assert default["error_rms"] > 0
    assert default["score_force"] > 0
    assert (closed["seconds"], closed["score_force"]) == (None, None)
    assert "Poisson's ratio 0.45" in closed["reason"]
    assert (tmp_path / "tactbench-results/cost/twin.png").exists()
