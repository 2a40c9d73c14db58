"""Nuisances by name: what a scene and a sensor declare can be set, alone and checked."""

import math

import pytest
from pydantic import ValidationError

from tactbench.core.errors import UsageError
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.scene import NUISANCES, ForceLoop, Scene, Simulation, Slide
from tactbench.plugin import load_registry

SCENE = Scene(name="a", drive=ForceLoop(), slide=Slide(speed=assumed(5.0, "mm/s", "test")))
SENSORS = [load_registry().sensors[name].spec for name in ("biotac", "icub", "ideal")]


@pytest.mark.parametrize("name", NUISANCES)
def test_every_nuisance_of_a_scene_is_set_alone_and_read_under_its_name(name):
    before = SCENE.nuisances()
    value = before.get(name, 1.0) * 0.9375 + 0.03125  # allowed of each of them: friction falls by less than a sixth
    changed = SCENE.with_nuisances({name: value})
    assert changed.nuisances() == {**before, name: pytest.approx(value, rel=1e-12)}
    assert Scene.model_validate_json(changed.model_dump_json()) == changed


@pytest.mark.parametrize("spec", SENSORS, ids=lambda spec: spec.name)
def test_every_nuisance_of_a_sensor_is_set_alone_and_read_under_its_name(spec):
    before = spec.settable()
    assert set(before).isdisjoint(NUISANCES)
    for name, amount in before.items():
        tau = {name.replace("_count", "_tau_s"): 7.0} if name.endswith(("_warm_up_count", "_wander_count")) else {}
        changed = spec.with_nuisances({name: amount.value + 0.5, **tau})
        values = {other: one.value for other, one in changed.settable().items()}
        assert values == {**{other: one.value for other, one in before.items()}, name: amount.value + 0.5, **tau}
        assert changed.settable()[name].source.tag == "assumed"


@pytest.mark.parametrize(
    ("changed", "values", "says"),
    [
        (SCENE, {"placement_scatter_mm": -0.1}, "placement_scatter_mm = -0.1"),
        (SCENE, {"surface_kinetic_friction": 2.0}, "surface_kinetic_friction = 2: "),
        (SENSORS[0], {"taxel_white_count": -1.0}, "taxel_white_count = -1"),
        (Scene(name="a"), {"drive_delay_ms": 5.0}, "drive_delay_ms: .*no drive"),
        (Scene(name="a"), {"surface_hurst": 0.5}, "surface_hurst: .*no slide"),
        (SENSORS[2], {"taxel_warm_up_count": 5.0}, "warm_up_tau"),
    ],
)
def test_a_value_that_cannot_be_is_refused_by_name(changed, values, says):
    with pytest.raises(UsageError, match=says):
        changed.with_nuisances(values)


def test_zero_is_an_amount():
    name = "taxel_white_count"
    assert SENSORS[0].with_nuisances({name: 0.0}).settable()[name].value == 0
    assert SCENE.with_nuisances({"placement_scatter_mm": 0.0}).placement.scatter.value == 0


def test_a_simulation_is_asked_with_nuisances_in_any_order():
    one = Simulation(nuisances={"noise_scale": 2, "drift_scale": 0.5})
    other = Simulation(nuisances={"drift_scale": 0.5, "noise_scale": 2.0})
    assert (one, hash(one)) == (other, hash(other))
    assert Simulation.model_validate_json(one.model_dump_json()) == one
    with pytest.raises(ValidationError):
        Simulation(nuisances={"noise_scale": math.nan})


def test_a_scene_is_asked_as_a_simulation_says():
    asked = SCENE.simulated_as(Simulation(rung="fine", nuisances={"placement_scatter_mm": 0.3}))
    assert asked.placement.scatter == assumed(0.3, "mm", "set for this run")
    assert asked.simulation.rung == "fine"
    assert asked.model_copy(update={"placement": SCENE.placement, "simulation": SCENE.simulation}) == SCENE
    own = SCENE.model_copy(update={"simulation": Simulation(effects=("+creep",))})
    assert own.simulated_as(Simulation(effects=("-drift",))).simulation.effects == ("+creep", "-drift")
