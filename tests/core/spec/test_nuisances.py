"""Nuisances by name: what a scene and a sensor declare can be set, alone and checked."""

import json
import math

import pytest
from pydantic import ValidationError

from tactbench.core.errors import UsageError
from tactbench.core.spec.drive import ForceLoop
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.scene import NUISANCES, Scene, Simulation, Slide
from tactbench.plugin import load_registry
from tactbench.plugin.simulation import Nuisances
from tests.conftest import ROOT

SCENE = Scene(name="a", drive=ForceLoop(), slide=Slide(speed=assumed(5.0, "mm/s", "test")))
SENSORS = [load_registry().sensors[name].spec for name in ("biotac", "icub", "ideal")]


@pytest.mark.parametrize("name", NUISANCES)
def test_every_nuisance_of_a_scene_is_set_alone_and_read_under_its_name(name):
    before = SCENE.nuisances()
    value = before.get(name, 1.0) * 0.9375 + 0.03125  # allowed of each of them: friction falls by less than a sixth
    changed = SCENE.with_nuisances({name: value})
    assert changed.nuisances() == {**before, name: pytest.approx(value, rel=1e-12)}
    assert Scene.model_validate_json(changed.model_dump_json()) == changed


@pytest.mark.parametrize("name", NUISANCES)
def test_a_name_is_part_field_and_unit(name):
    way, unit = NUISANCES[name]
    told = unit.lower().replace("/", "_per_", 1).replace("/", "_")
    words = [*(way[-2:] if way[0] != "environment" else way[-1:]), *([] if unit == "1" else [told])]
    assert name == "_".join(words)


def test_the_document_names_every_nuisance_of_a_scene():
    text = (ROOT / "docs" / "twin.md").read_text(encoding="utf-8")
    assert [name for name in NUISANCES if f"`{name}`" not in text] == []


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


def test_what_is_of_somebody_else_is_passed_over():
    assert SCENE.with_nuisances({"taxel_white_count": 1.0}) == SCENE
    biotac, icub, _ = SENSORS
    assert icub.with_nuisances({"dc_pressure_white_count": 1.0, "noise_scale": 2.0}) is icub
    assert biotac.with_nuisances({"dc_pressure_white_count": 1.0}) != biotac


def test_numbers_that_belong_together_are_set_together():
    both = {"surface_static_friction": 0.3, "surface_kinetic_friction": 0.2}
    assert both.items() <= SCENE.with_nuisances(both).nuisances().items()
    both = {"surface_kinetic_friction": 0.9, "surface_static_friction": 1.0}
    assert both.items() <= SCENE.with_nuisances(both).nuisances().items()


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"placement_scatter_mm": -0.1}, "placement_scatter_mm = -0.1 is below 0"),
        ({"noise_scale": -1.0}, "noise_scale = -1 is below 0"),
        ({"surface_kinetic_friction": 2.0}, "surface_kinetic_friction = 2: .*friction must be static >= kinetic"),
    ],
)
def test_a_value_that_a_scene_cannot_have_is_refused_by_name(values, says):
    with pytest.raises(UsageError, match=says) as caught:
        SCENE.with_nuisances(values)
    assert caught.value.hint


@pytest.mark.parametrize("name", ["drive_delay_ms", "surface_roughness_um"])
def test_what_a_scene_lacks_is_not_made(name):
    with pytest.raises(UsageError, match=f"{name}: the scene has no (drive|slide)"):
        Scene(name="a").with_nuisances({name: 1.0})


def test_offsets_angles_and_temperatures_may_be_negative():
    values = {"placement_x_mm": -1.0, "placement_tilt_s_rad": -0.1, "ambient_degc": -5.0}
    assert values.items() <= SCENE.with_nuisances(values).nuisances().items()


def test_a_value_that_a_sensor_cannot_have_is_refused_by_name():
    biotac, _, ideal = SENSORS
    with pytest.raises(UsageError, match="taxel_white_count = -1 is below 0"):
        biotac.with_nuisances({"taxel_white_count": -1.0})
    with pytest.raises(UsageError, match="warm_up is not 0, so warm_up_tau is needed"):
        ideal.with_nuisances({"taxel_warm_up_count": 5.0})
    assert biotac.with_nuisances({"taxel_warm_up_count": -5.0}).settable()["taxel_warm_up_count"].value == -5.0


def test_a_simulation_is_asked_with_nuisances_in_any_order():
    one = Simulation(nuisances={"noise_scale": 2, "drift_scale": 0.5})
    other = Simulation(nuisances={"drift_scale": 0.5, "noise_scale": 2.0})
    assert one == other
    assert hash(one) == hash(other)
    assert one.model_dump(exclude_defaults=True) == {"nuisances": {"drift_scale": 0.5, "noise_scale": 2.0}}
    assert Simulation.model_validate(json.loads(one.model_dump_json())) == one
    for wrong in (math.nan, math.inf, "much", None):
        with pytest.raises(ValidationError):
            Simulation(nuisances={"noise_scale": wrong})


def test_a_scene_is_asked_as_a_simulation_says():
    asked = SCENE.simulated_as(Simulation(rung="fine", nuisances={"placement_scatter_mm": 0.3}))
    assert asked.placement.scatter == assumed(0.3, "mm", "set for this run")
    assert asked.simulation.rung == "fine"
    assert asked.model_copy(update={"placement": SCENE.placement, "simulation": SCENE.simulation}) == SCENE
    assert SCENE.simulated_as(Simulation()) is SCENE
    own = SCENE.model_copy(update={"simulation": Simulation(effects=("+creep",))})
    assert own.simulated_as(Simulation(effects=("-drift",))).simulation.effects == ("+creep", "-drift")


def test_what_nuisances_leave_out_is_zero():
    none = Nuisances()
    assert {one.value for name, (_, one) in none.by_name("taxel").items() if not name.endswith("_tau_s")} == {0.0}
    assert none.hidden() == 0.0
    assert Nuisances.model_validate_json(none.model_dump_json()) == none


@pytest.mark.parametrize("name", ["warm_up", "wander"])
def test_a_drift_needs_its_time_constant(name):
    amount = assumed(1.0, "count", "test")
    with pytest.raises(ValidationError, match=f"{name} is not 0, so {name}_tau is needed"):
        Nuisances(**{name: amount})
    assert getattr(Nuisances(**{name: amount, f"{name}_tau": assumed(9.0, "s", "test")}), name) == amount
