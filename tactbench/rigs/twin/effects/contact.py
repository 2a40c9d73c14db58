"""Contact: where the indenter is, the load table for it, and the sensor's readings along the load."""

from __future__ import annotations

import math
from functools import lru_cache

from tactbench.plugin import RigError, Skin, TransducerFactory, load_object
from tactbench.rigs.twin.contact.load_table import build_table
from tactbench.rigs.twin.contact.medium import Medium
from tactbench.rigs.twin.contact.skins import medium_of
from tactbench.rigs.twin.effects.signal import Signal
from tactbench.rigs.twin.geometry import Touch, gap_mm

TABLE_SHARE = 0.005
"""Share of the largest response to which a load table need be right; the grid's own error is three times that."""


def apply(signal: Signal) -> None:
    """Press, and write the change of every observed reading from rest.

    The table's tolerance is one step of the converter, or the white noise where that is more, or half a percent of the
    largest response: a third of what the grid itself is known to (docs/twin.md). What was achieved is kept in the
    recording.

    Raises
    ------
    RigError
        If the sensor has no skin or no transducer, the indenter is smaller than a cell of the grid, or its apex lies
        outside the skin.
    """
    sensor = signal.sensor
    if sensor.transducer is None:
        raise RigError(
            f"The sensor {sensor.name!r} has no transducer, so its readings cannot be simulated.",
            hint="Name one in its SensorDescriptor, or use --rig replay.",
        )
    if sensor.spec.skin is None:
        raise RigError(
            f"The sensor {sensor.name!r} declares no skin, so it cannot be pressed in simulation.",
            hint="Declare one of the media of tactbench.plugin, or use --rig replay.",
        )
    medium = _medium(sensor.spec.skin)
    touch = _touch(signal, medium)
    make: TransducerFactory = load_object(sensor.transducer)
    observe = make(sensor.spec, medium.grid, tuple(channel.name for channel in signal.channels))
    noise = signal.each(lambda n: max(n.white.value, n.step.value))
    seen = noise[noise > 0]
    gap = gap_mm(medium.grid, touch, medium.outer_radius_mm)
    largest = float(signal.load.max())
    tolerance = float(seen.min()) if len(seen) else _fine(signal)
    table = build_table(medium, gap, observe, largest, tolerance, TABLE_SHARE if len(seen) else 0.0)
    signal.response = table(signal.load) - table.readings[0]
    signal.drawn.update(
        contact_x_mm=touch.x_mm,
        contact_s_mm=touch.s_mm,
        table_solves=table.solves,
        table_nodes=len(table.loads_n),
        table_error=table.error,
        solver_residual=table.residual,
        largest_load_n=largest,
        depth_mm=table.deepest.depth_mm,
        contact_radius_mm=table.deepest.contact_radius_mm,
    )
    if medium.core_at_mm is not None:
        signal.drawn["touch_down_n"] = table.touch_down_n if table.touch_down_n is not None else "not reached"


def _fine(signal: Signal) -> float:
    """Return a tolerance for a sensor without noise: a ten-thousandth of the range it states, or of one newton's."""
    widths = [c.upper - c.lower for c in signal.channels if c.upper is not None and c.lower is not None]
    return 1e-4 * max(widths, default=1000.0)


@lru_cache(maxsize=8)
def _medium(skin: Skin) -> Medium:
    return medium_of(skin)


def _touch(signal: Signal, medium: Medium) -> Touch:
    """Return where the indenter touches: the sensor's contact point, the scene's offset, this recording's scatter."""
    scene, parameters = signal.scene, signal.sensor.spec.parameters
    x, s = (parameters[name].to("mm") if name in parameters else middle
            for name, middle in (("contact_x", float(medium.grid.x_mm.mean())), ("contact_s", 0.0)))  # fmt: skip
    scatter = scene.placement.scatter.to("mm")
    drawn = signal.generator("contact", "recording").normal(0.0, 1.0, size=2) * scatter
    x += scene.placement.x.to("mm") + float(drawn[0])
    s += scene.placement.s.to("mm") + float(drawn[1])
    if not (medium.grid.x_mm[0] <= x <= medium.grid.x_mm[-1] and medium.grid.s_mm[0] <= s <= medium.grid.s_mm[-1]):
        raise RigError(
            f"The indenter would touch {signal.sensor.name!r} at x = {x:.2f} mm, s = {s:.2f} mm, outside its skin.",
            hint="Move it with the scene's placement.",
        )
    radius = scene.indenter.radius.to("mm") if scene.indenter.radius else math.inf
    cell = max(medium.grid.cell_mm)
    if radius < cell:
        raise RigError(
            f"A cap of {radius:g} mm is smaller than a cell of the skin's grid ({cell:.2g} mm).",
            hint="Use a larger cap, or declare a finer grid in the sensor's skin.",
        )
    return Touch(radius, x, s)
