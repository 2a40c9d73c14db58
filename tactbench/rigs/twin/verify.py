"""Comparison of the simulation with physical laws and closed forms, for ``tactbench twin verify``.

Comparisons with boundary elements and fine grids are in the tests: ``pytest tests/oracles``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tactbench.plugin import FloatArray, PlanEntry, Quantity, Scene, SensorDescriptor, assumed, load_registry
from tactbench.plugin.simulation import BondedLayer, SkinSheet, Verdict, rig_context
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.stages import medium_of, press_of
from tactbench.rigs.twin.effects.heat import HeatedCore
from tactbench.rigs.twin.effects.memory import lag
from tactbench.rigs.twin.effects.stick_slip import Dragged, Drive, Mode
from tactbench.rigs.twin.geometry import Contact, skin_grid
from tactbench.rigs.twin.planner import carried_out, prepare
from tactbench.rigs.twin.rig import Twin, build
from tactbench.rigs.twin.synthesis import DEFAULT

RADIUS_MM = 10.0
_TASK = "force"
"""Name of the task whose first scene is simulated with each sensor."""


def verdicts() -> Iterator[Verdict]:
    """Yield the results of all comparisons; each is computed when the iteration reaches it."""
    yield _hertz()
    registry = load_registry()
    twin = build(rig_context(registry))
    for name in ("biotac", "icub"):
        scene = registry.tasks[_TASK].spec.scenes[0].scene
        yield from _skin(twin, registry.sensors[name], scene)
        yield _left_out(twin, registry.sensors[name], scene)
    yield from _memory()
    yield _stick_slip()


def omitted(twin: Twin, sensor: SensorDescriptor, scene: Scene) -> tuple[float, float]:
    """Return the error [count] by the effects left out of the plan of `scene`, and the plan's upper bound on it.

    The error is the largest difference of any observed reading, before rounding, between a run with every effect and a
    run with the plan's effects; the bound is the sum of the bounds that the plan states.
    """
    every = tuple(f"+{effect.name}" for effect in twin.effects if effect.name != "converter")
    simulation = scene.simulation.model_copy(update={"effects": (*scene.simulation.effects, *every)})
    planned, entries = _unrounded(twin, sensor, scene)
    whole, _ = _unrounded(twin, sensor, scene.model_copy(update={"simulation": simulation}))
    largest = max(float(np.abs(a - b).max()) for a, b in zip(planned, whole, strict=True))
    bounds = [math.inf if entry.change is None else entry.change for entry in entries if not entry.included]
    return largest, sum(bounds)


def _unrounded(twin: Twin, sensor: SensorDescriptor, scene: Scene) -> tuple[list[FloatArray], tuple[PlanEntry, ...]]:
    plan = twin.plan(sensor, scene)
    stages = tuple(effect for effect in plan.stages if effect.name != "converter")
    run = carried_out(sensor, scene, 1, replace(plan, stages=stages), DEFAULT, twin.indenters)
    return [track.readings for track in run.tracks], plan.settled(run.settled)


def _skin(twin: Twin, sensor: SensorDescriptor, scene: Scene) -> Iterator[Verdict]:
    """Yield checks of a sensor's skin under 2 N: balance of forces and, over a fluid, constant volume."""
    press = press_of(prepare(sensor, scene, 1, twin.plan(sensor, scene)), DEFAULT)
    state = press(2.0)
    carried = float(state.pressure_mpa.sum() * np.prod(state.grid.cell_mm))
    yield Verdict(f"{sensor.name}, {scene.name}: sum of the pressures under 2 N", carried, 2.0, 2e-9, "N",
                  "equilibrium; bound: rounding")  # fmt: skip
    if press.medium.zero_mean:
        yield Verdict(f"{sensor.name}, {scene.name}: mean sinking of the skin", float(state.deflection_mm.mean()), 0.0,
                      1e-14, "mm", "the volume of what it holds stays; bound: rounding")  # fmt: skip


def _left_out(twin: Twin, sensor: SensorDescriptor, scene: Scene) -> Verdict:
    largest, bound = omitted(twin, sensor, scene)
    # Rounding in the last digits of readings of thousands of counts.
    source = "0: the plan leaves out what changes nothing; bound: the sum of those that it states"
    return Verdict(f"{sensor.name}, {scene.name}: change by all effects that are left out", largest, 0.0, bound + 1e-9,
                   "count", source)  # fmt: skip


def _hertz() -> Verdict:
    """Return the check of a paraboloid on a bonded layer (E = 1 MPa, nu = 1/2) far thicker than the contact is wide."""

    def given(value: float, unit: str = "mm") -> Quantity:
        return assumed(value, unit, "an exercise")

    skin = BondedLayer(
        sheet=SkinSheet(x_min=given(-6.0), x_max=given(6.0), arc=given(12.0), cells=(128, 128)),
        young=given(1.0, "MPa"),
        poisson=given(0.5, "1"),
        thickness=given(20.0),
        contact_stiffness=given(1e4, "MPa/mm"),
    )
    grid, force_n = skin_grid(skin.sheet), 0.05
    gap = (grid.x_mm[:, None] ** 2 + grid.s_mm[None, :] ** 2) / (2 * RADIUS_MM)
    found = Press(medium_of(skin, grid), gap, Contact(RADIUS_MM, 0.0, 0.0))(force_n).contact_radius_mm
    hertz = math.cbrt(0.75 * force_n * RADIUS_MM * (1 - 0.5**2))
    return Verdict("contact radius on a layer of 30 such radii", found, hertz, 0.01 * hertz, "mm",
                   "Hertz 1882; bound: cells of a seventh of it")  # fmt: skip


def _memory() -> Iterator[Verdict]:
    tau = 7.0
    t_s = np.array([0.0, 0.0, 0.3, 40.0, 47.0])  # a repeated time stamp is a step
    late = float(lag(t_s, np.array([0.0, 1.0, 1.0, 1.0, 0.0]), tau)[-1])
    ramp = (1.0 - math.exp(-40.0 / tau) - 1.0) * math.exp(-1.0) + (1.0 - math.exp(-1.0))
    yield Verdict("creep: lag of a step that falls again", late, ramp, 1e-12, source="closed form; bound: rounding")
    core = HeatedCore(room_c=23.0, power_w=0.25, resistance_k_per_w=136.0, capacity_j_per_k=3.7)
    loss = 1 / 136.0 + 4e-3
    goal = (0.25 + 23.0 / 136.0 + 4e-3 * 5.0) / loss
    expected = goal + (57.0 - goal) * math.exp(-60.0 * loss / 3.7)
    t_s = np.array([0.0, 0.01, 59.0, 60.0])
    found = float(core.carried(t_s, np.full(4, 4e-3), 5.0, 57.0)[-1])
    yield Verdict("heated core a minute after it is touched", found, expected, 1e-10, "K",
                  "one lump, closed form; bound: rounding")  # fmt: skip


def _stick_slip() -> Verdict:
    static, kinetic, load_n, stiffness, speed, omega = 0.8, 0.5, 2.0, 3.0, 5.0, 600.0 * math.pi
    u = (static - kinetic) * load_n / stiffness
    period = 2 * u / speed + 2 / omega * (math.pi - math.atan(omega * u / speed))
    grid = np.linspace(0.0, 20 * period, 101)
    drive = Drive(
        speed_mm_s=speed, start_s=0.0, end_s=math.inf, static=static, kinetic=kinetic, stribeck_mm_s=0.0,
        mode=Mode(omega, 0.0), t_s=grid, load_n=np.full(101, load_n), stiffness=np.full(101, stiffness),
    )  # fmt: skip
    found = float(np.diff(Dragged(drive).let_go_s)[-1])
    law = "two coefficients, no damping: 2u/V + 2/w (pi - atan(w u/V)); bound: instants of 20 periods"
    return Verdict("period of stick-slip", found, period, 1e-7 * period, "s", law)
