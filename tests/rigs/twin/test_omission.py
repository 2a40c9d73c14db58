"""Leaving an effect out is a claim: here it is held against running with everything."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import ForceRamp, Indenter, Placement, Scene, load_registry
from tactbench.rigs.twin.planner import carried_out
from tactbench.rigs.twin.verify import omitted
from tests.rigs.twin.conftest import TWIN, named, q, unrounded


def _hidden(sensor, scene):
    """The least standard deviation of noise and rounding of an observed kind of channel."""
    stated = sensor.spec.nuisances
    return min(stated[kind].hidden(scene.environment.noise_scale) for kind in scene.observe if kind in stated)


@pytest.mark.parametrize("name", ["biotac", "icub"])
@pytest.mark.parametrize("task", ["force", "curvature"])
def test_scenes_of_the_default_matrix_lose_nothing(sensors, name, task):
    scene = load_registry().tasks[task].spec.scenes[0].scene
    (largest, bound), hidden = omitted(TWIN, sensors[name], scene), _hidden(sensors[name], scene)
    assert largest <= bound + 1e-9
    assert largest < hidden


def _slow(radius=20.0, end=5.0, duration=14400.0, samples=2000, **more):
    profile = ForceRamp(duration=q(duration, "s"), hold=q(0.0, "s"), end=q(end, "N"), samples=samples)
    indenter = Indenter(radius=None if radius is None else q(radius))
    return Scene(name="slow", indenter=indenter, profile=profile, **more)


def _creep(sensor, scene):
    """The entry of creep as the recording of `scene` keeps it."""
    plan = TWIN.plan(sensor, scene)
    return named(plan.settled(carried_out(sensor, scene, 1, plan).settled))["creep"]


OFF_THE_NOMINAL_PLACE = [
    ("biotac", {"radius": 2.0, "end": 12.0, "x": 4.0, "s": 1.0}),
    ("icub", {"radius": None, "x": -1.0, "s": 1.0, "tilt": 10.0}),
]


@pytest.mark.parametrize(("name", "drawn"), OFF_THE_NOMINAL_PLACE)
def test_the_bound_follows_the_place_of_the_contact(sensors, name, drawn):
    """Readings are up to three times as steep here as where a sensor's spec was once asked how steep they get."""
    sensor = sensors[name]
    tilt = q(drawn.get("tilt", 0.0), "deg")
    placement = Placement(x=q(drawn["x"]), s=q(drawn["s"]), tilt_x=tilt, scatter=q(0.0))
    found = []
    # From where creep is called for to where it is left out, and as near to that as a factor of two tells.
    for doubled in range(12):
        scene = _slow(drawn["radius"], drawn.get("end", 5.0), 60.0 * 2**doubled, 500, placement=placement)
        entry = _creep(sensor, scene)
        # Whatever was decided, the number is a bound.
        asked = Simulation(effects=("-creep" if entry.included else "+creep",))
        apart = _apart(sensor, scene, scene.model_copy(update={"simulation": asked}))
        assert apart <= entry.change
        found.append((entry.included, apart / entry.change))
        if not entry.included:
            break
    assert [included for included, _ in found[-2:]] == [True, False]
    # Not vacuous: the largest slope is met somewhere, and what lags there shows.
    assert found[-1][1] > 0.3


def _apart(sensor, one, other):
    ways = [unrounded(sensor, scene).tracks for scene in (one, other)]
    return max(float(np.abs(a.readings - b.readings).max()) for a, b in zip(*ways, strict=True))
