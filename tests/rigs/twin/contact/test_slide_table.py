"""What a slide adds to the readings of a sensor that looks along its skin: from the states to the recording."""

from __future__ import annotations

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
)
from tactbench.plugin.simulation import BondedLayer, SkinSheet, Slide
from tactbench.rigs.twin.contact.load_table import build_table
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.contact.tangential import (
    build_slide_table,
    dragged_state,
    pressed_state,
    tangential_of,
    traction_shares,
)
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tactbench.rigs.twin.planner import plan_scene
from tests.rigs.twin.conftest import EFFECTS, q, unrounded

GUESS = Source(tag="assumed", reference="test")


SKIN = BondedLayer(
    sheet=SkinSheet(x_min=q(-8), x_max=q(8), arc=q(16), cells=(32, 32)),
    young=q(0.5, "MPa"), poisson=q(0.45, "1"), thickness=q(3), contact_stiffness=q(10, "MPa/mm"),
)  # fmt: skip
CHANNELS = ("force_x", "force_s", "moved_x", "moved_s", "field")
SPEC = SensorSpec(
    name="magnet", title="A magnet in a layer", principle="magnetic", principle_source=GUESS, skin=SKIN,
    streams=(StreamSpec(name="taxels", channels=tuple(ChannelSpec(name=name, kind="taxel") for name in CHANNELS)),),
    reads_shear=("taxel",),
)  # fmt: skip


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


def _scene(speed=5.0, angle_deg=0.0, **more):
    ramp = ForceRamp(start=q(0.5, "N"), end=q(1.5, "N"), hold=q(0, "s"), duration=q(2, "s"), samples=400)
    slide = Slide(speed=q(speed, "mm/s"), start=q(0.5, "s"), duration=q(1, "s"), direction=q(angle_deg, "deg"))
    return Scene(name="slide", indenter=Indenter(radius=q(8)), profile=ramp, slide=slide, observe=("taxel",),
                 placement=Placement(scatter=q(0)), **more)  # fmt: skip


def _readings(sensor, scene):
    run = unrounded(sensor, scene)
    return run, run.tracks[0].readings


def test_between_the_nodes_the_table_gives_what_the_states_give():
    grid, contact = skin_grid(SKIN.sheet), Contact(8.0, 0.0, 0.0)
    press, along = Press(medium_of(SKIN, grid), gap_mm(grid, contact), contact), tangential_of(SKIN, grid)
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


def test_it_costs_nothing_where_nobody_looks_along_the_skin():
    for spec, scene in (
        (SPEC.model_copy(update={"reads_shear": ()}), _scene()),
        (SPEC.model_copy(update={"reads_shear": ("dc_pressure",)}), _scene()),
        (SPEC, _scene().model_copy(update={"profile": ForceRamp(end=q(0, "N"))})),
    ):
        plan = plan_scene(EFFECTS, scene, spec)
        (entry,) = (entry for entry in plan.entries if entry.effect == "shear")
        assert not entry.included
        assert "shear" not in [effect.name for effect in plan.stages]


def test_a_tolerance_is_kept_in_the_slide_too():
    # With this ratio the surface hardly moves under the press, so that only the slide tells the rungs apart.
    still = SPEC.model_copy(update={"skin": SKIN.model_copy(update={"poisson": q(0.35, "1")})})
    sensor = SENSOR.model_copy(update={"spec": still})
    errors = {}
    for tolerance in (0.02, 0.002):
        run, _ = _readings(sensor, _scene(simulation=Simulation(tolerance=tolerance)))
        errors[run.rung] = run.rung_error
        assert 0 < run.rung_error <= tolerance
    assert len(errors) == 2
