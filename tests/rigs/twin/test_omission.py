"""Leaving an effect out is a claim: here it is held against running with everything."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactbench.plugin import ForceRamp, Indenter, Placement, RigContext, Scene, assumed, load_registry
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.contact.stages import skin_under_load
from tactbench.rigs.twin.effects.called_for import widest_contact_mm
from tactbench.rigs.twin.preparation import carried_out, prepare
from tactbench.rigs.twin.rig import build
from tactbench.rigs.twin.verify import omitted


def _q(value, unit):
    return assumed(value, unit, "test")


@pytest.fixture(scope="module")
def twin():
    return build(RigContext(effects=tuple(tactbench_effects())))


@pytest.mark.parametrize("name", ["biotac", "icub"])
@pytest.mark.parametrize("task", ["force", "curvature"])
def test_scenes_of_the_default_matrix_lose_nothing(twin, sensors, name, task):
    scene = load_registry().tasks[task].spec.scenes[0].scene
    largest, bound, hidden = omitted(twin, sensors[name], scene)
    assert largest <= bound + 1e-9
    assert largest < hidden


def _slow(radius=20.0, end=5.0, duration=14400.0, samples=2000, **more):
    profile = ForceRamp(duration=_q(duration, "s"), hold=_q(0.0, "s"), end=_q(end, "N"), samples=samples)
    indenter = Indenter(radius=None if radius is None else _q(radius, "mm"))
    return Scene(name="slow", indenter=indenter, profile=profile, **more)


def _creep(twin, sensor, scene):
    """The entry of creep as the recording of `scene` keeps it."""
    plan = twin.plan(sensor, scene)
    return {entry.effect: entry for entry in plan.settled(carried_out(sensor, scene, 1, plan).settled)}["creep"]


def test_a_slow_ramp_goes_without_creep_and_the_bound_holds(twin, sensors):
    # 5 N in four hours: 1.1 counts/h behind at most.
    scene = _slow()
    entry = _creep(twin, sensors["biotac"], scene)
    assert not entry.included
    assert "slowly" in entry.reason
    assert "load table" in entry.reason
    largest, bound, hidden = omitted(twin, sensors["biotac"], scene)
    assert bound == entry.change
    # Not vacuous: within a factor of ten of what really happens, which is not nothing.
    assert bound / 10 < largest <= bound
    assert largest < hidden / 3


OFF_THE_NOMINAL_PLACE = [
    ("biotac", {"radius": 2.0, "end": 12.0, "x": 4.0, "s": 1.0}),
    ("biotac", {"radius": 2.0, "x": 0.1, "s": 3.0, "tilt": 12.0}),
    ("biotac", {"radius": 5.0, "x": -3.0, "s": -2.0}),
    ("icub", {"radius": 2.0, "end": 12.0, "x": 2.0, "s": -1.5}),
    ("icub", {"radius": None, "x": -1.0, "s": 1.0, "tilt": 10.0}),
]


@pytest.mark.parametrize(("name", "drawn"), OFF_THE_NOMINAL_PLACE)
def test_the_bound_follows_the_place_of_the_contact(twin, sensors, name, drawn):
    """Readings are up to three times as steep here as where a sensor's spec was once asked how steep they get."""
    sensor = sensors[name]
    tilt = _q(drawn.get("tilt", 0.0), "deg")
    placement = Placement(x=_q(drawn["x"], "mm"), s=_q(drawn["s"], "mm"), tilt_x=tilt, scatter=_q(0.0, "mm"))
    found = []
    # From where creep is called for to where it is left out, and as near to that as a factor of two tells.
    for doubled in range(12):
        scene = _slow(drawn["radius"], drawn.get("end", 5.0), 60.0 * 2**doubled, 500, placement=placement)
        entry = _creep(twin, sensor, scene)
        # Whatever was decided, the number is a bound.
        words = "-creep" if entry.included else "+creep"
        other = scene.model_copy(update={"simulation": scene.simulation.model_copy(update={"effects": (words,)})})
        apart = _apart(twin, sensor, scene, other)
        assert apart <= entry.change
        found.append((entry.included, apart / entry.change))
        if not entry.included:
            break
    assert [included for included, _ in found[-2:]] == [True, False]
    # Not vacuous: the largest slope is met somewhere, and what lags there shows.
    assert found[-1][1] > 0.3


def _apart(twin, sensor, one, other):
    ways = [carried_out(sensor, scene, 1, _unrounded(twin.plan(sensor, scene))) for scene in (one, other)]
    return max(float(np.abs(a.readings - b.readings).max()) for a, b in zip(*(run.tracks for run in ways), strict=True))


def _unrounded(plan):
    return replace(plan, stages=tuple(effect for effect in plan.stages if effect.name != "converter"))


def test_a_ramp_of_a_minute_does_not(twin, sensors):
    scene = Scene(name="paper", indenter=Indenter(radius=_q(20.0, "mm")))
    entry = _creep(twin, sensors["biotac"], scene)
    assert entry.included
    asked = scene.model_copy(update={"simulation": scene.simulation.model_copy(update={"effects": ("-creep",)})})
    largest, bound, hidden = omitted(twin, sensors["biotac"], asked)
    # Left out against the plan: nobody promises anything, and it shows.
    assert bound == float("inf")
    assert largest > 10 * hidden
    assert largest <= entry.change


@pytest.mark.parametrize(
    "drawn", [*(case for name, case in OFF_THE_NOMINAL_PLACE if name == "biotac"), {"radius": None}]
)
def test_no_contact_is_wider_than_the_bound_of_heat_takes_it_to_be(twin, sensors, drawn):
    sensor = sensors["biotac"]
    tilt = _q(drawn.get("tilt", 0.0), "deg")
    placement = Placement(x=_q(drawn.get("x", 0.0), "mm"), s=_q(drawn.get("s", 0.0), "mm"), tilt_x=tilt)
    scene = _slow(drawn["radius"], drawn.get("end", 12.0), placement=placement)
    widest = widest_contact_mm(scene, sensor.spec.skin.sheet)
    table = skin_under_load(prepare(sensor, scene, 1, twin.plan(sensor, scene)))
    radii = table.skin(np.linspace(0.0, table.loads_n[-1], 200)).contact_radius_mm
    # Not by more than the few times that a contact at the very rim, or across the whole sheet, would take.
    assert widest / 10 < radii.max() <= widest
