"""Units of a sensor: the first is as it was before there were others; what differs is said."""

import numpy as np
import pytest

from tactbench.plugin import ForceRamp, Indenter, Scene, assumed
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.effects.channels import gain, rest_spread, unit_rest
from tactbench.rigs.twin.planner import plan_scene
from tactbench.rigs.twin.preparation import prepare

EFFECTS = tactbench_effects()
NO_NOISE = Environment(force_noise=assumed(0.0, "N", "test"))


def scene(unit="1", **more):
    cap = Indenter(radius=assumed(10.0, "mm", "test"))
    return Scene(name="a", indenter=cap, unit=unit, profile=ForceRamp(samples=40), **more)


def prepared(sensor, unit, seed=1):
    return prepare(sensor, scene(unit), seed, plan_scene(EFFECTS, scene(unit), sensor.spec))


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_units_differ_by_what_belongs_to_a_unit_and_by_nothing_else(sensors, name):
    first, second, third = (prepared(sensors[name], unit) for unit in "123")
    assert len({run.of_unit("gain", "taxel").standard_normal() for run in (first, second, third)}) == 3
    for scope in ("of_recording", "of_session"):
        assert getattr(first, scope)("x").standard_normal() == getattr(second, scope)("x").standard_normal()
    assert first.contact == second.contact, "the same mounting, on another unit"


def over_units(sensors, name, effects):
    found = []
    for number in range(2, 122):
        run = prepared(sensors[name], str(number))
        run.tracks[0].readings[:] = 0.0
        for effect in effects:
            effect(run)
        found.append(run.tracks[0])
    return found


def test_rest_levels_of_units_spread_as_stated(sensors):
    stated = sensors["biotac"].spec.nuisances["taxel"]
    levels = np.array([track.readings[0] for track in over_units(sensors, "biotac", [unit_rest])])
    shared, own = stated.unit_rest_shared.value, stated.unit_rest_own.value
    # 120 units: a standard deviation of 120 numbers is known to 6.5 %, of 120 x 18 to 1.5 %; four of each. The mean of
    # 19 electrodes scatters by what is shared and a nineteenth of the own variance.
    assert levels.mean(axis=1).std() == pytest.approx(np.hypot(shared, own / np.sqrt(19)), rel=0.26)
    within = levels - levels.mean(axis=1, keepdims=True)
    assert within.std() == pytest.approx(own * np.sqrt(18 / 19), rel=0.06)


def test_rest_levels_of_an_icub_unit_are_its_own_too(sensors):
    levels = np.array([track.readings[0] for track in over_units(sensors, "icub", [unit_rest, rest_spread])])
    # rest_spread (2 counts) belongs to the unit: every unit draws its own. 120 x 11 numbers are known to 2 %.
    assert (levels - levels.mean(axis=1, keepdims=True)).std() == pytest.approx(2.0 * np.sqrt(11 / 12), rel=0.08)


def test_gains_of_units_differ_as_a_whole_and_never_turn_round(sensors):
    gains = np.array([track.gain for track in over_units(sensors, "icub", [gain])])
    # sd 0.1 shared, known to 6.5 % from 120 units; 0.05 each adds 0.0144 to the mean of 12.
    assert gains.mean(axis=1).std() == pytest.approx(np.hypot(0.1, 0.05 / np.sqrt(12)), rel=0.26)
    assert (gains > 0).all()


def test_the_plan_includes_rest_levels_of_another_unit_only(sensors):
    for unit, wanted in (("1", False), ("2", True)):
        plan = plan_scene(EFFECTS, scene(unit), sensors["biotac"].spec)
        (entry,) = [entry for entry in plan.entries if entry.effect == "unit-rest"]
        assert entry.included is wanted
        assert unit in entry.reason
