"""Drawn values reach the place in a scene that their path names, and nothing else."""

import pytest

from tactbench.core.calibration.placing import with_parameters
from tactbench.core.errors import UsageError
from tactbench.core.spec.scene import Environment, Scene
from tests.core.calibration.toy import procedure

SCENE = Scene(name="a", session="3")


def _spec(path, unit="1", sensors=()):
    nuisance = {"name": "one", "path": path, "unit": unit, "sensors": list(sensors), "reason": "r", "source": "assumed",
                "prior": {"kind": "fixed", "value": 2.0}}  # fmt: skip
    return procedure(nuisances=[nuisance])


def _placed(path, value, **more):
    return with_parameters(SCENE, _spec(path, **more), "icub", {"one": value})


def test_a_quantity_gets_value_unit_and_tag():
    placed = _placed("placement.scatter", 250.0, unit="um")
    assert placed.placement.scatter.to("mm") == pytest.approx(0.25)
    assert placed.placement.scatter.source.tag == "assumed"
    assert placed.model_copy(update={"placement": SCENE.placement}) == SCENE


@pytest.mark.parametrize("name", ["noise_scale", "drift_scale", "offset_scale", "session_offset_scale"])
def test_a_factor_gets_a_bare_number(name):
    placed = _placed(f"environment.{name}", 0.5)
    assert placed.environment == Environment(**{name: 0.5})


def test_an_optional_quantity_can_be_drawn():
    assert _placed("environment.force_filter", 20.0, unit="Hz").environment.force_filter.to("Hz") == 20.0


def test_a_nuisance_of_one_sensor_leaves_the_other_as_it_is():
    spec = _spec("environment.noise_scale", sensors=["biotac"])
    assert with_parameters(SCENE, spec, "icub", {"one": 9.0}) == SCENE
    assert with_parameters(SCENE, spec, "biotac", {"one": 9.0}).environment.noise_scale == 9.0


@pytest.mark.parametrize(
    ("path", "value", "unit", "says"),
    [
        ("placement.scater", 0.1, "mm", "Did you mean 'scatter'"),
        ("environment.noise_scale", -1.0, "1", "noise_scale cannot be -1"),
        ("placement.scatter", 0.1, "s", "mm"),
        ("profile.samples", 10.0, "1", "not to a number"),
        ("session", 1.0, "1", "not to a number"),
        ("slide.speed", 1.0, "mm/s", "does not have"),
        ("environment.noise_scale.more", 1.0, "1", "does not have"),
    ],
)
def test_what_cannot_be_placed_is_refused_with_the_next_step(path, value, unit, says):
    with pytest.raises(UsageError, match=says) as caught:
        _placed(path, value, unit=unit)
    assert caught.value.hint
