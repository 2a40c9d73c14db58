"""One draw on the real twin: recorded, answered, read off, gone."""

import pytest

from tactbench.core.calibration.trial import Trial, carry_out, checked
from tactbench.core.errors import UsageError
from tests.core.calibration.toy import procedure

FOREST = {"name": "forest", "params": {"n_estimators": 10}}


def _output(name, figure=None, **more):
    asked = {"name": name, "title": name, "sensor": "ideal", "task": "curvature", "estimator": FOREST, "every": 20}
    return {**asked, **more, **({"figure": figure} if figure else {})}


def _band(low, high):
    return {"kind": "band", "low_n": low, "high_n": high}


def _spec(outputs, **more):
    stated = {"scale": 1.0, "scale_reason": "r", "use": "fitted", "source": {"tag": "assumed", "reference": "a test"}}
    return procedure(
        outputs=outputs, published=[{"output": outputs[0]["name"], "value": 0.5, **stated}], findings=[], **more
    )


def _fixed(name, sets, value):
    return {
        "name": name, "sets": sets, "reason": "r", "source": "assumed",
        "prior": {"kind": "fixed", "value": value},
    }  # fmt: skip


def test_a_band_of_every_force_is_the_score_and_a_narrow_one_is_not(tmp_path):
    outputs = [
        _output("whole"), _output("every_force", _band(0, 5.1)), _output("weak", _band(0, 1.0)),
        _output("strong", _band(4.0, 5.1)),
    ]  # fmt: skip
    still = _fixed("still", "placement_scatter_mm", 0.0)
    draw, _ = carry_out(Trial(_spec(outputs, nuisances=[still]), 5, 0, tmp_path))
    assert draw.reason == ""
    assert draw.outputs["every_force"] == draw.outputs["whole"]
    # The model's own: caps that meet one place are told apart better at 4 N than below 1 N.
    assert draw.outputs["strong"] > draw.outputs["whole"] > draw.outputs["weak"]
    assert list(tmp_path.iterdir()) == []


def test_a_draw_has_every_output_it_shall_have(tmp_path):
    ramp = {"task": "force", "estimator": {"name": "time-index"}, "every": 3}
    spec = _spec([_output("ramp", **ramp), _output("again", **ramp), _output("dear", **ramp, only_first=2)])
    found = {number: carry_out(Trial(spec, 5, number, tmp_path))[0] for number in (1, 2)}
    assert list(found[1].outputs) == ["ramp", "again", "dear"]
    assert list(found[2].outputs) == ["ramp", "again"]
    assert len(set(found[1].outputs.values())) == 1  # the same question has the same answer
    assert found[1].outputs["ramp"] != found[2].outputs["ramp"]


def test_drawn_values_reach_the_simulation(tmp_path):
    rmse = {"task": "force", "estimator": {"name": "time-index"}, "every": 1}
    for value in (0.1, 0.9):
        nuisance = _fixed("force_noise", "force_noise_n", value)
        draw, cpu_s = carry_out(Trial(_spec([_output("rmse", **rmse)], nuisances=[nuisance]), 5, 0, tmp_path))
        # 4400 test samples: the standard error of an RMSE is 1/sqrt(2 n) = 1.1 %; four of them.
        assert draw.outputs["rmse"] == pytest.approx(value, rel=0.045)
        assert cpu_s > 0


def test_a_draw_that_cannot_be_carried_out_says_why(tmp_path):
    # A band beyond the ramp's 5 N: found out only once the answer is there.
    draw, _ = carry_out(Trial(_spec([_output("none", _band(6, 7), task="force",
                                             estimator={"name": "time-index"})]), 5, 0, tmp_path))  # fmt: skip
    assert draw.status == "failed"
    assert "from 6 to 7 N" in draw.reason
    assert draw.outputs == {}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"sensor": "icubb"}, "Did you mean 'icub'"),
        ({"task": "curvatur"}, "Did you mean 'curvature'"),
        ({"task": "grasp-stability"}, "plans no scenes"),
        ({"estimator": {"name": "forrest"}}, "Did you mean 'forest'"),
    ],
)
def test_what_an_output_asks_is_looked_at_before_anything_is_simulated(change, says):
    with pytest.raises(UsageError, match=says):
        checked(_spec([_output("one", **change)]))


def test_rigs_and_sensors_are_looked_at_too():
    with pytest.raises(UsageError, match="not simulated"):
        checked(_spec([_output("one")], rig="replay"))
    nuisance = procedure().nuisances[0].model_dump()
    with pytest.raises(UsageError, match="which no output asks"):
        checked(_spec([_output("one")], nuisances=[{**nuisance, "sensors": ["biotac"]}]))
    with pytest.raises(UsageError, match="drive_delay_ms: the scene has no drive"):
        checked(_spec([_output("one")], nuisances=[{**nuisance, "sets": "drive_delay_ms"}]))
