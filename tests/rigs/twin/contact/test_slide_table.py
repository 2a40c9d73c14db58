"""What a slide adds to the readings of a sensor that looks along its skin: from the states to the recording."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import (
    ChannelSpec,
    ForceRamp,
    Indenter,
    Placement,
    Scene,
    SensorDescriptor,
    SensorSpec,
    Source,
    StreamSpec,
    assumed,
)
from tactbench.plugin.simulation import BondedLayer, SkinSheet, Slide
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.contact.load_table import build_table
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.pressing import medium_of
from tactbench.rigs.twin.contact.slide_table import build_slide_table, dragged_state, traction_shares
from tactbench.rigs.twin.contact.stages import forget_tables
from tactbench.rigs.twin.contact.tangential import pressed_state, tangential_of
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tactbench.rigs.twin.planner import plan_scene
from tactbench.rigs.twin.preparation import carried_out

GUESS = Source(tag="assumed", reference="test")


def _q(value, unit):
    return assumed(value, unit, "test")


SKIN = BondedLayer(
    sheet=SkinSheet(x_min=_q(-8, "mm"), x_max=_q(8, "mm"), arc=_q(16, "mm"), cells=(32, 32)),
    young=_q(0.5, "MPa"), poisson=_q(0.45, "1"), thickness=_q(3, "mm"), contact_stiffness=_q(10, "MPa/mm"),
)  # fmt: skip
CHANNELS = ("force_x", "force_s", "moved_x", "moved_s", "field")
SPEC = SensorSpec(
    name="magnet",
    title="A magnet in a layer",
    principle="magnetic",
    principle_source=GUESS,
    streams=(StreamSpec(name="taxels", channels=tuple(ChannelSpec(name=name, kind="taxel") for name in CHANNELS)),),
    skin=SKIN,
    reads_shear=("taxel",),
)


def build(sensor, grid, wanted):
    """Read the forces on the surface, how it moves at one place, and the field of a magnet there (not linear)."""
    area = float(np.prod(grid.cell_mm))
    near = np.exp(-((grid.x_mm[:, None] - 1.0) ** 2 + (grid.s_mm[None, :] + 0.5) ** 2) / 2)
    near /= near.sum()

    def read(state):
        force = state.shear_mpa.sum((1, 2)) * area
        moved = (state.tangential_displacement_mm * near).sum((1, 2))
        r = np.array([*moved, 2.0 - float((state.deflection_mm * near).sum())])
        values = dict(zip(CHANNELS, [*force, *moved, 3 * r[0] * r[2] / np.linalg.norm(r) ** 5], strict=True))
        return np.array([values[name] for name in wanted])

    return read


SENSOR = SensorDescriptor(spec=SPEC, transducer=f"{__name__}:build")
BLIND = SENSOR.model_copy(update={"spec": SPEC.model_copy(update={"reads_shear": ()})})


def _scene(speed=5.0, angle_deg=0.0, **more):
    ramp = ForceRamp(start=_q(0.5, "N"), end=_q(1.5, "N"), hold=_q(0, "s"), duration=_q(2, "s"), samples=400)
    slide = Slide(speed=_q(speed, "mm/s"), start=_q(0.5, "s"), duration=_q(1, "s"), direction=_q(angle_deg, "deg"))
    return Scene(name="slide", indenter=Indenter(radius=_q(8, "mm")), profile=ramp, slide=slide, observe=("taxel",),
                 placement=Placement(scatter=_q(0, "mm")), **more)  # fmt: skip


def _readings(sensor, scene):
    run = carried_out(sensor, scene, 1, plan_scene(tactbench_effects(), scene, sensor.spec))
    (track,) = run.tracks
    return run, track.readings


def test_between_the_nodes_the_table_gives_what_the_states_give():
    grid, contact = skin_grid(SKIN.sheet), Contact(8.0, 0.0, 0.0)
    press, along = Press(medium_of(SKIN, grid), gap_mm(grid, contact, math.inf), contact), tangential_of(SKIN, grid)
    transducer = build(SPEC, grid, CHANNELS)

    def read(state):
        return transducer(state if state.shear_mpa is not None else pressed_state(state, along))

    friction, way = 0.7, (0.8, -0.6)
    table = build_table(press, read, largest_n=2.0, tolerance=np.full(5, 1e-3))
    slide = build_slide_table(press, read, table, SKIN, way, friction)
    largest = np.abs(slide(*(np.array([v]) for v in (2.0, 2.0, 2.0 * friction, 0.0)))).max()
    # After a first push, in full slip, and in a push after a slip (b < 1), at a load that is no node.
    for share, stick_ratio in ((0.4, 0.6 ** (1 / 3)), (0.93, 0.07 ** (1 / 3)), (0.8, 0.0), (-0.6, 0.0), (0.7, 0.9)):
        load, pushed = 1.37, share * friction * 1.37
        s, inner, b = traction_shares(*(np.array([v]) for v in (load, pushed, stick_ratio)), friction)
        state = press(load)
        exact = dragged_state(
            state, press(load * float(inner[0])), along, way,
            friction * float((s + b * inner)[0]), friction * float(b[0]),
        )  # fmt: skip
        added = slide(*(np.array([v]) for v in (load, load, pushed, stick_ratio)))[0]
        # A cubic in load, a polynomial through five nodes in each share: 0.0009 was found.
        np.testing.assert_allclose(added, read(exact) - read(state), atol=0.002 * largest)


def test_readings_follow_the_tangential_force_of_the_recording():
    run, readings = _readings(SENSOR, _scene(angle_deg=30.0))
    seen = run.sliding(run.t_s)
    assert run.drawn["slips"] > 5
    # Nothing lies between: the sum of tractions is linear in them, and the load table of it as well.
    np.testing.assert_allclose(readings[:, 0], math.cos(math.pi / 6) * seen.force_n, atol=1e-9)
    np.testing.assert_allclose(readings[:, 1], math.sin(math.pi / 6) * seen.force_n, atol=1e-9)
    # Dragged along the slide, before it not at all.
    assert readings[run.t_s < 0.5, :2].any() == 0
    assert np.all(readings[seen.force_n > 0.1][:, 2] > readings[0, 2])


def test_the_other_way_everything_tangential_turns():
    # The magnet is beside the contact: what the press alone does is taken off. No profile lifts the skin.
    smooth = Simulation(effects=("-skin-vibration",))
    _, there = _readings(SENSOR, _scene(simulation=smooth))
    _, back = _readings(SENSOR, _scene(angle_deg=180.0, simulation=smooth))
    _, still = _readings(SENSOR, _scene(simulation=smooth).model_copy(update={"slide": None}))
    assert np.abs(there - still)[:, :4].max() > 0.05
    np.testing.assert_allclose((back - still)[:, :4], -(there - still)[:, :4], atol=1e-12)


def test_it_costs_nothing_where_nobody_looks_along_the_skin():
    for spec, scene in (
        (BLIND.spec, _scene()),
        (SPEC.model_copy(update={"reads_shear": ("dc_pressure",)}), _scene()),
        (SPEC, _scene().model_copy(update={"profile": ForceRamp(end=_q(0, "N"))})),
    ):
        plan = plan_scene(tactbench_effects(), scene, spec)
        (entry,) = (entry for entry in plan.entries if entry.effect == "shear")
        assert not entry.included
        assert "shear" not in [effect.name for effect in plan.stages]
    asked = []
    plan = plan_scene(tactbench_effects(), _scene(), BLIND.spec)
    transducer = f"{__name__}:{build_blind.__name__}"
    build_blind.seen = asked
    forget_tables()
    carried_out(BLIND.model_copy(update={"transducer": transducer}), _scene(), 1, plan)
    assert asked
    assert all(state.shear_mpa is None and state.tangential_displacement_mm is None for state in asked)


def build_blind(sensor, grid, wanted):
    """Remember the states."""

    def read(state):
        build_blind.seen.append(state)
        return np.zeros(len(wanted))

    return read


def test_a_tolerance_is_kept_in_the_slide_too():
    # With this ratio the surface hardly moves under the press, so that only the slide tells the rungs apart.
    still = SPEC.model_copy(update={"skin": SKIN.model_copy(update={"poisson": _q(0.35, "1")})})
    sensor = SENSOR.model_copy(update={"spec": still})
    errors = {}
    for tolerance in (0.02, 0.002):
        run, _ = _readings(sensor, _scene(simulation=Simulation(tolerance=tolerance)))
        errors[run.rung] = run.rung_error
        assert 0 < run.rung_error <= tolerance
    assert len(errors) == 2


def test_left_out_by_name_nothing_moves_along_the_skin():
    scene = _scene()
    scene = scene.model_copy(update={"simulation": scene.simulation.model_copy(update={"effects": ("-shear",)})})
    _, readings = _readings(SENSOR, scene)
    assert not readings.any()


def test_fields_are_of_the_grid_and_of_nothing_else():
    grid = skin_grid(SKIN.sheet)
    rest = Press(medium_of(SKIN, grid), gap_mm(grid, Contact(8.0, 0.0, 0.0), math.inf), Contact(8.0, 0.0, 0.0))(0.5)
    found = pressed_state(rest, tangential_of(SKIN, grid))
    assert found.shear_mpa.shape == found.tangential_displacement_mm.shape == (2, *rest.pressure_mpa.shape)
    others = [field.name for field in dataclasses.fields(rest)][:-2]
    assert all(getattr(found, name) is getattr(rest, name) for name in others)
