"""Checks of what a sensor says of itself: streams, ranges, places, nuisances. No code of its own runs."""

from __future__ import annotations

import math
from collections.abc import Iterator

from tactbench.core.conformance.check import Subject, check, fail, skip
from tactbench.core.conformance.skin_state import on_sheet_mm
from tactbench.core.errors import UsageError
from tactbench.core.spec import units
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec, StreamSpec

LARGEST_M, SMALLEST_M = 0.5, 1e-4
"""Farthest and least distance of the outermost taxels [m]: the skin of a forearm is 0.3 m long, and taxels of a tenth
of a millimetre are the smallest that are made."""
OF_KIND = {
    "force": "N", "torque": "N*m", "position": "m", "dc_pressure": "Pa", "ac_pressure": "Pa", "dc_temperature": "K",
    "joint": "rad",
}  # fmt: skip
"""A unit of what a kind of channel measures."""
RAW = ("count", "V", "mV")
FASTEST_HZ, SLOWEST_HZ = 1e6, 0.1
EDGE_MM = 1e-6
"""Rounding of a position in metres."""
UNIT_NORMAL = 1e-3
"""Data sheets state normals to three decimals."""
INWARD = -0.5
"""Cosine between a stated normal and the sheet's own, below which it points into the sensor."""


def _channels(spec: SensorSpec) -> Iterator[tuple[str, StreamSpec, ChannelSpec]]:
    for stream in spec.streams:
        for channel in stream.channels:
            yield f"spec.streams[{stream.name}].channels[{channel.name}]", stream, channel


@check("sensor", needs=("numbers-are-finite",))
def limits_are_in_order(subject: Subject) -> None:
    """Saturation, tolerances and plots are told from lower, rest and upper.

    State lower < upper, both within what the stream's dtype holds, and a rest level between them; whole numbers come
    from a converter and need both ends.
    """
    import numpy as np

    for place, stream, channel in _channels(subject.spec):
        counts = np.dtype(stream.dtype).kind in "iu"
        for field, limit in (("lower", channel.lower), ("upper", channel.upper)):
            if counts and limit is None:
                fail(f"{place}.{field}", "its stream stores whole numbers, and the converter's end is not stated")
            if counts and limit is not None and not np.iinfo(stream.dtype).min <= limit <= np.iinfo(stream.dtype).max:
                fail(f"{place}.{field}", f"{limit:g} does not fit {stream.dtype}")
        low = -math.inf if channel.lower is None else channel.lower
        high = math.inf if channel.upper is None else channel.upper
        if not low < high:
            fail(f"{place}.lower", f"{low:g} is not below upper, {high:g}")
        if channel.rest is None:
            continue
        try:
            rest = channel.rest.to(channel.unit)
        except UsageError:
            fail(f"{place}.rest", f"its unit is {channel.rest.unit!r}, and {channel.unit!r} is needed")
        if not low <= rest <= high:
            fail(f"{place}.rest", f"{rest:g} {channel.unit} is not within lower and upper, {low:g} to {high:g}")


@check("sensor")
def units_are_of_the_kind(subject: Subject) -> None:
    """A task asks for kinds of channels and relies on their dimension: a force is a force, whatever its unit.

    Give force, torque, position and pressure channels a unit of that dimension, or ``count`` for raw readings.
    """
    for place, _, channel in _channels(subject.spec):
        unit = OF_KIND.get(channel.kind)
        if unit and channel.unit not in RAW and units.parse(channel.unit)[1] != units.parse(unit)[1]:
            fail(f"{place}.unit", f"a {channel.kind} is measured in {unit} or count, not in {channel.unit}")


@check("sensor")
def rates_and_delays_are_possible(subject: Subject) -> None:
    """Delays, windows and clocks are computed from the stated rate; a period given for a rate is off by thousands.

    State rate_hz in samples a second and link_delay as a time, or leave out what nobody states.
    """
    for stream in subject.spec.streams:
        if stream.rate_hz is not None and not SLOWEST_HZ <= stream.rate_hz <= FASTEST_HZ:
            period = f"; is it a period? One of {stream.rate_hz:g} s is {1 / stream.rate_hz:g} Hz"
            fail(f"spec.streams[{stream.name}].rate_hz", f"{stream.rate_hz:g} Hz{period if stream.rate_hz < 1 else ''}")
    delay = subject.spec.link_delay
    if delay is not None:
        try:
            seconds = delay.to("s")
        except UsageError:
            fail("spec.link_delay.unit", f"{delay.unit!r} is no time")
        if not 0 <= seconds <= 10:
            fail("spec.link_delay", f"{delay} is not within 0 to 10 s")


def _placed(subject: Subject) -> list[tuple[str, ChannelSpec]]:
    return [(place, one) for place, _, one in _channels(subject.spec) if one.position_m is not None]


@check("sensor")
def positions_are_in_metres(subject: Subject) -> None:
    """Places are in metres: millimetres make a fingertip the size of a room, inches forty times a finger.

    Convert position_m: 1 mm is 0.001, 1 inch 0.0254.
    """
    placed = _placed(subject)
    if not placed:
        skip("it states no place of any channel")
    sheet = subject.spec.skin.sheet if subject.spec.skin else None
    size_m = None if sheet is None else max(abs(sheet.x_min.to("m")), abs(sheet.x_max.to("m")), sheet.arc.to("m") / 2)
    place, channel = max(placed, key=lambda one: max(map(abs, one[1].position_m or ())))
    far_m = max(map(abs, channel.position_m or ()))
    if (size_m is not None and far_m > 2 * size_m) or far_m > LARGEST_M:
        likely = 1e-3 if size_m is None or far_m > 200 * size_m else 0.0254
        unit = {1e-3: "millimetres", 0.0254: "inches"}[likely]
        of = f" of a skin that reaches {1e3 * size_m:.3g} mm" if size_m else ""
        fail(f"{place}.position_m", f"{far_m:g} m from the sensor's origin{of}: are these {unit}?")
    if len({one.position_m for _, one in placed}) > 1 and far_m < SMALLEST_M:
        fail(f"{place}.position_m", f"no channel is farther than {far_m:g} m from the origin: is the unit larger?")


@check("sensor", needs=("positions-are-in-metres",))
def positions_are_apart(subject: Subject) -> None:
    """Two taxels in one place are usually a copied line.

    Correct position_m of one of them, or name the `site` that both belong to.
    """
    places: dict[tuple[float, ...], tuple[str, str]] = {}
    for place, channel in _placed(subject):
        if channel.kind == "taxel" and channel.position_m is not None:
            first, known = places.setdefault(channel.position_m, (place, channel.site or place))
            if known != (channel.site or place):
                fail(f"{place}.position_m", f"it is also that of {first.rpartition('[')[2].rstrip(']')}")


@check("sensor", needs=("positions-are-in-metres",))
def positions_are_on_the_sheet(subject: Subject) -> None:
    """A taxel off the skin's sheet is pressed by nothing, or by its periodic image on the other side.

    Move position_m within the sheet: x from x_min to x_max, along the arc within half its width; or widen the sheet.
    """
    if subject.spec.skin is None:
        skip("it declares no skin")
    sheet = subject.spec.skin.sheet
    low, high, half = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm") / 2
    for place, channel in _placed(subject):
        x_mm, s_mm = on_sheet_mm(sheet, channel.position_m or (0.0, 0.0, 0.0))
        off = not (low - EDGE_MM <= x_mm <= high + EDGE_MM and abs(s_mm) <= half + EDGE_MM)
        if channel.kind == "taxel" and off:
            text = f"x {x_mm:.3g} mm, along the arc {s_mm:.3g} mm is off the sheet"
            fail(f"{place}.position_m", f"{text} (x {low:g} to {high:g} mm, arc {-half:g} to {half:g} mm)")


@check("sensor", needs=("positions-are-in-metres",))
def normals_point_outwards(subject: Subject) -> None:
    """Forces are projected on normals; one of another length scales them, one that points inwards turns their sign.

    State the unit vector that leaves the skin there.
    """
    skin = subject.spec.skin
    stated = [(place, one) for place, one in _placed(subject) if one.normal is not None]
    for place, channel in stated:
        ahead = stated[0][1].normal
        assert channel.normal is not None
        assert ahead is not None
        length = math.hypot(*channel.normal)
        if not abs(length - 1.0) <= UNIT_NORMAL:
            fail(f"{place}.normal", f"its length is {length:.4g}, not 1")
        _, y, z = channel.position_m or (0.0, 0.0, 0.0)
        if skin is not None and skin.sheet.outer_radius is not None and math.hypot(y, z) > 0:
            outwards = (y * channel.normal[1] + z * channel.normal[2]) / math.hypot(y, z)
            if outwards < INWARD:
                fail(f"{place}.normal", "it points into the finger")
        if skin is not None and skin.sheet.outer_radius is None and channel.normal[2] * ahead[2] < INWARD:
            fail(f"{place}.normal", f"it points to the other side of the pad than {ahead}, the first one")


@check("sensor")
def nuisances_are_in_its_units(subject: Subject) -> None:
    """Amounts are added to readings as they are: volts on a channel of counts are off by its whole scale.

    Name a kind of channel that the sensor has, and state amounts in its unit, shares in 1, time constants in a time.
    """
    spec = subject.spec
    if not spec.nuisances:
        skip("it states no nuisances")
    for kind, nuisances in spec.nuisances.items():
        if not spec.channels(kind):
            kinds = sorted({channel.kind for channel in spec.channels()})
            fail(f"spec.nuisances[{kind}]", f"it has no {kind} channel; it has {', '.join(kinds)}")
        for field, amount in nuisances.by_name(kind).values():
            if field not in nuisances.model_fields_set and not field.startswith("creep_"):
                continue
            share = field.endswith(("_fraction", "_scatter")) or field in ("unit_gain", "offset_smooth")
            unit = "1" if share else spec.channels(kind)[0].unit
            if not field.endswith("_tau") and amount.unit != unit:
                fail(f"spec.nuisances[{kind}].{field}", f"its unit is {amount.unit!r}, and {unit!r} is needed")
            if amount.value < 0 and field != "warm_up":
                fail(f"spec.nuisances[{kind}].{field}", f"{amount} is below 0")
