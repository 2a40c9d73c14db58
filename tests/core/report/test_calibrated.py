import pytest

from tactbench.core.report.calibrated import Share, calibrated_from

PROCEDURE = {
    "outputs": [
        {"name": "a_force", "task": "force", "sensor": "a"},
        {"name": "b_force", "task": "force", "sensor": "b"},
    ],
    "nuisances": [
        {"name": "scatter", "sensors": [], "prior": {"kind": "uniform"}},
        {"name": "drift", "sensors": ["a"], "prior": {"kind": "log-uniform"}},
    ],
}


def parameter(name, prior, accepted, unit="1"):
    (low, high), (first, last) = prior, accepted
    return {"name": name, "unit": unit, "prior_low": low, "prior_high": high, "accepted_low": first,
            "accepted_high": last}  # fmt: skip


def tables(parameters=(), accepted=(0.6, 0.7)):
    published = {"published": 0.65, "use": "held out", "accepted_low": accepted[0], "accepted_high": accepted[1]}
    return {
        "published": [{"output": "a_force", **published}, {"output": "b_force", **published}],
        "parameters": list(parameters),
        "findings": [
            {"statement": "It is so.", "reference": "they", "reason": "by much", "prior_share": 0.5, "prior_low": 0.4,
             "prior_high": 0.6, "prior_n": 90, "accepted_share": None, "accepted_low": 0.0, "accepted_high": 1.0,
             "accepted_n": 0}
        ],
    }  # fmt: skip


def test_a_range_belongs_to_its_task_sensor_and_number():
    found = calibrated_from(PROCEDURE, tables(), ("note",), 0.8)
    assert found.range_for("force", "a", 0.65).high == 0.7
    assert found.range_for("force", "c", 0.65) is None
    assert found.range_for("force", "a", 0.66) is None
    assert found.range_for("curvature", "a", 0.65) is None


def test_too_few_draws_are_no_range_and_no_share():
    found = calibrated_from(PROCEDURE, tables(accepted=(None, None)), (), 0.8)
    assert found.ranges == ()
    assert found.findings[0].accepted is None
    assert found.findings[0].prior == Share(0.5, 0.4, 0.6, 90)


def test_only_nuisances_that_became_narrower_are_asked_for_each_by_its_own_sensors():
    # 0.1 … 10 is two decades: 1 … 10 is half of it, though nine tenths in plain numbers.
    narrowed = [parameter("scatter", (0, 1), (0.1, 0.95), "mm"), parameter("drift", (0.1, 10), (1, 10))]
    found = calibrated_from(PROCEDURE, tables(narrowed), (), 0.8)
    assert found.range_for("force", "a", 0.65).asks == {"drift": (1, 10)}
    assert found.range_for("force", "b", 0.65).asks == {}
    narrower = calibrated_from(PROCEDURE, tables([parameter("scatter", (0, 1), (0.2, 0.6), "mm")]), (), 0.8)
    assert narrower.range_for("force", "b", 0.65).asks == {"scatter [mm]": pytest.approx((0.2, 0.6))}
