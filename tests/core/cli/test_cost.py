"""``cost`` of estimators and of the simulated rig."""

import json

import pytest

from tactbench.core.cost import knobs
from tests.conftest import Verbs
from tests.core.cost.test_knobs import presses
from tests.core.report.unrendered import unrendered

ASKED = ("cost", "--sensor", "made", "--task", "force", "--recordings", "shelf", "--format", "json")


def test_an_estimator_that_breaks_costs_its_own_row_only(tmp_path):
    presses(tmp_path / "shelf")
    verbs = Verbs(tmp_path, here=True)
    with unrendered():
        found = json.loads(verbs(*ASKED, "--estimator", "ols", "--estimator", "evil-raise", plugins=("evil",)).stdout)
    rows = {row["value"]: row for row in found if row["knob"] == "estimator"}
    assert (rows["ols"]["status"], rows["evil-raise"]["status"]) == ("done", "failed")
    assert rows["evil-raise"]["reason"]
    files = {path.name for path in (tmp_path / "tactbench-results" / "cost").glob("made-force.*")}
    assert files == {f"made-force.{end}" for end in ("json", "png", "pdf")}
    assert verbs("leaderboard", code=2), "what is timed adds no row to the leaderboard"


def test_the_twins_cost_says_what_a_rung_scores_and_what_a_sensor_cannot_have(tmp_path, monkeypatch):
    monkeypatch.setattr(knobs, "TOLERANCES", (10.0,))
    words = ("cost", "--twin", "--sensor", "acme-pad", "--repeats", "1", "--task", "force", "--format", "json")
    with unrendered():
        done = Verbs(tmp_path, here=True)(*words, plugins=("good",))
    rows = {row["value"]: row for row in json.loads(done.stdout)}
    assert rows["default"]["score"] > 0
    assert rows["fine"]["sim_s"] > 0
    assert rows["10"]["simulation"]["tolerance"] == 10.0
    assert (rows["closed-form"]["sim_s"], rows["closed-form"]["score"]) == (None, None)
    assert "0.45" in rows["closed-form"]["reason"], "Poisson's ratio"


@pytest.mark.parametrize("more", [("--repeats", "2"), ("--estimator", "ols")])
def test_the_diagram_of_the_simulation_takes_no_option_of_answers(tmp_path, more):
    Verbs(tmp_path, here=True)("cost", "--twin", "--sensor", "icub", *more, code=2)
