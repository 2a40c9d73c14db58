from tactbench.core.report.calibrated import Share, calibrated_from

PROCEDURE = {
    "outputs": [
        {"name": "a_force", "task": "force", "sensor": "a"},
        {"name": "b_force", "task": "force", "sensor": "b"},
    ]
}


def sensitivity(output, parameter, correlation, low, high):
    return {"output": output, "parameter": parameter, "correlation": correlation, "low": low, "high": high}


def tables(sensitivities=(), accepted=(0.6, 0.7)):
    published = {"published": 0.65, "use": "held out", "accepted_low": accepted[0], "accepted_high": accepted[1]}
    return {
        "published": [{"output": "a_force", **published}, {"output": "b_force", **published}],
        "sensitivity": list(sensitivities),
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


def test_a_number_goes_with_what_it_goes_with_beyond_chance_the_most_first():
    some = [
        sensitivity("a_force", "scatter", 0.3, 0.1, 0.5),
        sensitivity("a_force", "drift", -0.6, -0.8, -0.4),
        sensitivity("a_force", "noise", 0.2, -0.1, 0.5),
        sensitivity("a_force", "warmth", 0.25, 0.01, 0.4),
        sensitivity("b_force", "noise", 0.9, 0.8, 1.0),
    ]
    found = calibrated_from(PROCEDURE, tables(some), (), 0.8)
    assert list(found.range_for("force", "a", 0.65).goes_with.items()) == [("drift", -0.6), ("scatter", 0.3)]
    assert found.range_for("force", "b", 0.65).goes_with == {"noise": 0.9}
