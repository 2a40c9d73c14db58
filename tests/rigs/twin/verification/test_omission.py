"""Leaving an effect out is a claim: here it is held against running with everything."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.plugin import ForceRamp, Indenter, Placement, RigContext, Scene, assumed, load_registry
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.contact.stages import skin_under_load
from tactbench.rigs.twin.preparation import prepare
from tactbench.rigs.twin.rig import build
from tactbench.rigs.twin.verification.omission import difference


def _q(value, unit):
    return assumed(value, unit, "test")


@pytest.fixture(scope="module")
def twin():
    return build(RigContext(effects=tuple(tactbench_effects())))


@pytest.mark.parametrize("name", ["biotac", "icub"])
@pytest.mark.parametrize("task", ["force", "curvature"])
def test_scenes_of_the_default_matrix_lose_nothing(twin, sensors, name, task):
    # One scene a role here, the tasks' first; `tactbench twin verify` runs all of them.
    scene = load_registry().tasks[task].spec.scenes[0].scene
    largest, bound, hidden = difference(twin, sensors[name], scene)
    assert largest <= bound + 1e-9
    assert largest < hidden


def test_a_slow_ramp_goes_without_creep_and_the_bound_holds(twin, sensors):
    # 5 N in four hours: 1.1 counts/h behind at most.
    slow = ForceRamp(duration=_q(14400.0, "s"), hold=_q(0.0, "s"), samples=2000)
    scene = Scene(name="slow", indenter=Indenter(radius=_q(20.0, "mm")), profile=slow)
    entry = {entry.effect: entry for entry in twin.plan(sensors["biotac"], scene).entries}["creep"]
    assert not entry.included
    assert "slowly" in entry.reason
    largest, bound, hidden = difference(twin, sensors["biotac"], scene)
    # Not vacuous: within a factor of ten of what really happens, which is not nothing.
    assert bound / 10 < largest <= bound
    assert largest < hidden / 3


@pytest.mark.parametrize(("name", "radius"), [("biotac", 20.0), ("biotac", 40.0), ("icub", 40.0)])
def test_no_reading_is_steeper_than_the_spec_says(twin, sensors, name, radius):
    scene = Scene(name="steep", indenter=Indenter(radius=_q(radius, "mm")), placement=Placement(scatter=_q(0.0, "mm")))
    run = prepare(sensors[name], scene, 1, twin.plan(sensors[name], scene))
    table = skin_under_load(run)
    load = np.linspace(0.0, 5.0, 2001)
    steepest = float(np.abs(np.diff(table(load), axis=0)).max() / 0.0025)
    stated = sensors[name].spec.nuisances["taxel"].largest_slope.to("count/N")
    # Bounded, and not by a number from nowhere.
    assert stated / 2 < steepest <= stated


def test_a_ramp_of_a_minute_does_not(twin, sensors):
    scene = Scene(name="paper", indenter=Indenter(radius=_q(20.0, "mm")))
    entry = {entry.effect: entry for entry in twin.plan(sensors["biotac"], scene).entries}["creep"]
    assert entry.included
    asked = scene.model_copy(update={"simulation": scene.simulation.model_copy(update={"effects": ("-creep",)})})
    largest, bound, hidden = difference(twin, sensors["biotac"], asked)
    # Left out against the plan: nobody promises anything, and it shows.
    assert bound == float("inf")
    assert largest > 10 * hidden
    assert largest <= entry.change
