"""``twin explain``, ``twin verify`` and ``cost`` as a person meets them."""

import json

import pytest

from tactbench.core.cli import explanations
from tactbench.core.plugins.registry import load_registry
from tests.conftest import Verbs
from tests.core.cli.test_screens import assert_one_clear_screen


@pytest.fixture
def verbs(tmp_path):
    return Verbs(tmp_path, here=True)


def test_a_plan_is_explained_with_reasons_costs_and_bounds(verbs):
    words = ("twin", "explain", "--sensor", "icub", "--task", "force", "--rounds", "1")
    done = verbs(*words, "--format", "json")
    rows = {row["effect"]: row for row in json.loads(done.stdout)}
    assert rows["contact"]["included"]
    assert rows["contact"]["cost_s"] > 0
    assert not rows["core"]["included"]
    assert rows["core"]["change"] == 0
    assert all(row["reason"] for row in rows.values())
    assert rows["creep"]["scenes"] == 3
    # Nothing that the plan leaves out touches these scenes: not a digit of the score.
    assert rows["contact"]["score"] == rows["contact"]["score_all_effects"]


@pytest.mark.parametrize(("task", "slides"), [("slip", True), ("force", False)])
def test_friction_and_vibration_are_explained_where_a_task_slides_alone(verbs, task, slides):
    words = ("twin", "explain", "--sensor", "biotac", "--task", task, "--rounds", "0", "--format", "json")
    rows = {row["effect"]: row for row in json.loads(verbs(*words).stdout)}
    for effect, why in (
        ("friction", "slides at 10 mm/s"),
        ("skin-vibration", "a profile of 2 um rms passes, its spectrum even up to 100 Hz"),
    ):
        assert rows[effect]["included"] == slides
        assert rows[effect]["reason"].startswith(why if slides else "no tangential motion: the scene does not slide")


def test_what_an_effect_that_is_left_out_does_to_the_score_shows(verbs):
    words = ("twin", "explain", "--sensor", "icub", "--task", "force", "--effects=-force-noise", "--format", "json")
    (row, *_) = json.loads(verbs(*words, "--rounds", "1").stdout)
    # Its 0.69 N are most of the error.
    assert row["score"] < 0.3 < 0.6 < row["score_all_effects"]
    assert row["sim_s"] > 0
    assert row["sim_s_all_effects"] > 0
    (row, *_) = json.loads(verbs(*words, "--rounds", "0").stdout)
    assert "score" not in row


def test_the_twins_cost_says_what_a_rung_scores_and_what_a_sensor_cannot_have(verbs):
    words = ("cost", "--twin", "--sensor", "bonded-pad", "--rounds", "1", "--task", "force", "--format", "json")
    done = verbs(*words, plugins=("bonded",))
    rows = {row["way"].rpartition(", up")[0] + (row["rung"] or ""): row for row in json.loads(done.stdout)}
    default = rows["newton, 32 x 32default"]
    assert default["error_rms"] > 0
    assert default["score_force"] > 0
    closed = rows["closed form, 32 x 32closed-form"]
    assert closed["seconds"] is None
    assert "Poisson's ratio 0.45" in closed["reason"]
    assert closed["score_force"] is None
    assert "Poisson's ratio 0.45" in closed["score_force_reason"]
    assert (verbs.folder / "tactbench-results/cost/twin.png").exists()


def test_what_was_asked_for_shows(verbs):
    words = ("twin", "explain", "--sensor", "icub", "--task", "force", "--rounds", "0", "--format", "csv")
    done = verbs(*words, "--effects", "-drift,+fluid-pressure")
    lines = {line.split(",")[4]: line for line in done.stdout.splitlines()}
    assert ",True,True,asked for" in lines["fluid-pressure"]
    assert ',False,True,"left out as asked' in lines["wander"]


def test_asked_effects_and_rungs_are_kept_with_the_recording(verbs):
    words = ("--profile", "ramp:duration=2", "--effects=-noise", "--set", "rung=closed-form")
    verbs("record", "--sensor", "icub", "--out", "a.h5", *words)
    shown = verbs("inspect", "a.h5").stdout
    left_out = next(line for line in shown.splitlines() if "left out:" in line)
    assert "white-noise (asked)" in left_out
    assert "force-noise (asked)" in left_out
    assert "effects = -noise" in shown
    assert "rung = closed-form" in shown


def test_a_scenario_is_listed_and_kept_with_the_recording(verbs):
    listed = verbs("list", "scenarios").stdout
    assert "hard-handled" in listed
    assert "biotac: pressed hard" in listed
    words = ("--profile", "ramp:duration=1", "--set", "scenario=hard-handled")
    verbs("record", "--sensor", "biotac", "--out", "a.h5", *words)
    assert "scenario = hard-handled" in verbs("inspect", "a.h5").stdout


def test_a_scenario_is_asked_for_by_a_matrix_file(verbs):
    matrix = {
        "sensors": ["biotac", "icub"], "tasks": [{"name": "force", "estimators": ["ols"]}], "latency": False,
        "repeats": 1, "simulation": {"scenario": "hard-handled"},
    }  # fmt: skip
    (verbs.folder / "hard.yaml").write_text(json.dumps(matrix))
    rows = json.loads(verbs("run", "--config", "hard.yaml", "--format", "json").stdout)
    of = {row["sensor"]: row for row in rows if row["estimator"] == "ols"}
    assert of["biotac"]["assumptions"]["scenario"] == "hard-handled"
    # Nobody has handled an iCub's fingertip hard and watched it: no row, and the reason.
    assert of["icub"]["status"] == "skipped"
    assert "states no scenario 'hard-handled'" in of["icub"]["reason"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("twin", "explain", "--sensor", "icub", "--task", "grasp-stability"), "plans no scenes"),
        (("twin", "explain", "--sensor", "icub", "--task", "forse"), "Did you mean 'force'"),
        (("run", "--effects", "drift"), "Write +drift or -drift"),
        (("run", "--effects", "+creeep"), "Did you mean 'creep'"),
        (("run", "--set", "rung=defaut"), "Did you mean 'default'"),
        (("run", "--set", "rung=fine", "--set", "tolerance=1"), "picks the rung"),
        (("run", "--set", "scenario=hard-handed"), "Did you mean 'hard-handled'"),
        (("run", "--rig", "replay", "--recordings", ".", "--set", "scenario=hard-handled"), "for simulated rigs"),
        (("run", "--rig", "replay", "--recordings", ".", "--set", "rung=fine"), "for simulated rigs"),
        (("cost",), "--twin"),
    ],
)
def test_wrong_words_are_answered_with_the_next_step(verbs, arguments, says):
    assert_one_clear_screen(verbs(*arguments, code=2), says)


def test_the_simulation_meets_its_laws_each_with_what_was_expected_and_a_bound(verbs):
    done = verbs("twin", "verify", "--format", "json")
    rows = json.loads(done.stdout)
    assert len(rows) <= 12
    assert all(row["met"] and row["source"] and abs(row["found"] - row["expected"]) <= row["bound"] for row in rows)
    assert f"{len(rows)} of {len(rows)} within their bounds" in done.stderr


def test_a_law_that_is_missed_is_a_failure_and_says_so(verbs, monkeypatch):
    monkeypatch.setattr("tactbench.rigs.twin.verify.lag", lambda t_s, load, tau_s: load)
    done = verbs("twin", "verify", code=1)
    (missed,) = [line for line in done.stdout.splitlines() if "MISS" in line]
    assert "creep" in missed


def test_a_score_that_takes_long_is_made_only_if_asked_for(monkeypatch, capsys):
    monkeypatch.setattr(explanations, "LONGEST_S", 0.0)
    explanations.print_explanations(load_registry(), "twin", "icub", "force", None, 1, "table")
    said = capsys.readouterr()
    assert "No score" in said.err
    assert "--effects +all, does it" in said.err
    assert "RMSE" not in said.out
