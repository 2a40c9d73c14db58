"""``twin explain`` and ``twin verify``, and effects, rungs and scenarios that are asked for."""

import json

import pytest

from tests.conftest import Verbs

EXPLAIN = ("twin", "explain", "--sensor", "icub", "--task", "force", "--format", "json", "--rounds", "1")


@pytest.fixture
def verbs(tmp_path):
    return Verbs(tmp_path, here=True)


def test_a_plan_is_explained_with_reasons_costs_and_bounds(verbs):
    rows = {row["effect"]: row for row in json.loads(verbs(*EXPLAIN, "--effects=-force-noise").stdout)}
    assert (rows["force-noise"]["included"], rows["force-noise"]["asked"]) == (False, True)
    assert rows["contact"]["included"]
    assert rows["contact"]["cost_ms"] > 0
    assert (rows["core"]["included"], rows["core"]["change"]) == (False, 0)
    assert all(row["reason"] for row in rows.values())
    assert rows["creep"]["scenes"] == 3
    # The 0.69 N of the noise that was left out are most of the error.
    assert rows["contact"]["score"] < 0.3 < 0.6 < rows["contact"]["score_all_effects"]


def test_effects_rungs_and_scenarios_are_kept_with_the_recording(verbs):
    words = ("--profile", "ramp:duration=1", "--effects=-noise", "--set", "rung=default", "--set")
    verbs("record", "--sensor", "biotac", "--out", "a.h5", *words, "scenario=hard-handled")
    shown = verbs("inspect", "a.h5").stdout
    assert "white-noise (forced)" in next(line for line in shown.splitlines() if line.startswith("left out "))
    (about,) = json.loads(verbs("inspect", "a.h5", "--format", "json").stdout)
    simulation = about["meta"]["scene"]["simulation"]
    assert [simulation[key] for key in ("effects", "rung", "scenario")] == [["-noise"], "default", "hard-handled"]


def test_the_simulation_meets_its_laws_each_with_what_was_expected_and_a_bound(verbs):
    done = verbs("twin", "verify", "--format", "json")
    rows = json.loads(done.stdout)
    assert len(rows) <= 12
    assert all(row["met"] and row["source"] and abs(row["found"] - row["expected"]) <= row["bound"] for row in rows)
    assert f"{len(rows)} of {len(rows)}" in done.stderr


def test_a_law_that_is_missed_is_a_failure_and_says_so(verbs, monkeypatch):
    monkeypatch.setattr("tactbench.rigs.twin.verify.lag", lambda t_s, load, tau_s: load)
    done = verbs("twin", "verify", code=1)
    (missed,) = [line for line in done.stdout.splitlines() if line.startswith(" no ")]
    assert "creep" in missed
