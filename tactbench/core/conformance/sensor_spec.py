"""Checks of what a sensor says of itself: streams, ranges, places, nuisances. No code of its own runs."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tactbench.core.conformance.check import Subject, check, fail, skip
from tactbench.core.conformance.streams import limits_of
from tactbench.core.spec import units
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec, Vector
from tactbench.core.spec.skin import BondedLayer, FoamPad, SkinSheet

LARGEST_MM = 250.0  # distance of the outermost taxels from the origin: the skin of a forearm is 0.3 m long
OF_KIND = {
    "force": "N", "torque": "N*m", "position": "m", "dc_pressure": "Pa", "ac_pressure": "Pa", "dc_temperature": "K",
    "joint": "rad",
}  # fmt: skip
"""A unit of what a kind of channel measures."""
RAW = ("count", "V", "mV")
FASTEST_HZ, SLOWEST_HZ = 1e6, 0.1
SOONEST_S, LATEST_S = 20e-6, 0.25  # of a link's delay (assumed: an SPI word takes microseconds, a radio link 0.1 s)
SPREAD, FEW = 0.2, 3  # smallest extent of three or more taxels, of the skin's longer side
PRESS_N, PRESS_MM, LEAST_MM = 1.0, 2.5, 1e-3  # a press of a flat punch of this radius, and by what it indents a skin
EDGE_MM, UNIT_NORMAL = 1e-6, 1e-3  # rounding of a position in metres; data sheets state normals to three decimals


def on_sheet_mm(sheet: SkinSheet | None, position_m: Vector) -> tuple[float, float]:
    """Return the axial coordinate and the arc length at which a place of the sensor's frame lies on the sheet [mm]."""
    x_mm, y_mm, z_mm = (1e3 * part for part in position_m)
    if sheet is None or sheet.outer_radius is None:
        return x_mm, y_mm
    return x_mm, sheet.outer_radius.to("mm") * math.atan2(y_mm, -z_mm)


def _channels(subject: Subject) -> Iterator[tuple[str, StreamSpec, ChannelSpec]]:
    for stream in subject.spec.streams:
        for channel in stream.channels:
            yield f"spec.streams[{stream.name}].channels[{channel.name}]", stream, channel


@check("sensor")
def limits_are_in_order(subject: Subject) -> None:
    """Saturation, tolerances, windows and delays are computed from limits, rest levels and rates.

    State lower < upper, both within what the stream's dtype holds, and a rest level between them; whole numbers come
    from a converter and need both ends. Give force, torque, position and pressure channels a unit of that dimension,
    or ``count`` for raw readings; rate_hz in samples a second, and link_delay as a time.
    """
    for rated in subject.spec.streams:
        rate_hz = rated.rate_hz
        if rate_hz is not None and not SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
            text = f"{rate_hz:g} Hz is not within {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz: is it a period?"
            fail(f"spec.streams[{rated.name}].rate_hz", text)
    delay, slowest_hz = subject.spec.link_delay, min(one.rate_hz or 100.0 for one in subject.spec.streams)
    latest_s = max(LATEST_S, 2 / slowest_hz)
    if delay is not None and delay.to("s") != 0 and not SOONEST_S <= delay.to("s") <= latest_s:
        fail("spec.link_delay", f"{delay} is not 0, nor within {1e6 * SOONEST_S:g} us to {1e3 * latest_s:g} ms")
    for place, stream, channel in _channels(subject):
        unit = OF_KIND.get(channel.kind)
        if unit and channel.unit not in RAW and units.parse(channel.unit)[1] != units.parse(unit)[1]:
            fail(f"{place}.unit", f"a {channel.kind} is measured in {unit} or count, not in {channel.unit}")
        low, high = limits_of(channel)
        whole = np.iinfo(stream.dtype) if np.dtype(stream.dtype).kind in "iu" else None
        if whole is not None and (low < whole.min or high > whole.max):
            text = f"{low:g} to {high:g}: the converter's ends are needed, and must fit {stream.dtype}"
            fail(f"{place}.lower, upper", text)
        rest = low if channel.rest is None else channel.rest.to(channel.unit)
        if not low <= rest <= high:
            fail(f"{place}.rest", f"{rest:g} {channel.unit} is not within lower and upper, {low:g} to {high:g}")


@check("sensor")
def places_are_on_the_skin(subject: Subject) -> None:
    """Millimetres make a fingertip the size of a room; a taxel off the skin's sheet, or there twice, is a copied line.

    Convert position_m: 1 mm is 0.001, 1 inch 0.0254. Name the `site` that taxels share, and move them within the sheet:
    x from x_min to x_max, along the arc within half its width. State a unit vector as normal.
    """
    placed = [(place, one, one.position_m) for place, _, one in _channels(subject) if one.position_m is not None]
    if not placed:
        skip("it states no place of any channel")
    low, high, half, sheet = -LARGEST_MM, LARGEST_MM, LARGEST_MM, None
    if subject.spec.skin is not None:
        sheet = subject.spec.skin.sheet
        low, high, half = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm") / 2
    places: dict[Vector, tuple[str, str]] = {}
    spots = []
    for place, channel, position_m in placed:
        if channel.normal is not None and not abs(math.hypot(*channel.normal) - 1.0) <= UNIT_NORMAL:
            fail(f"{place}.normal", f"its length is {math.hypot(*channel.normal):.4g}, not 1")
        if channel.kind != "taxel":
            continue
        x_mm, s_mm = on_sheet_mm(sheet, position_m)
        spots.append((x_mm, s_mm))
        if not (low - EDGE_MM <= x_mm <= high + EDGE_MM and abs(s_mm) <= half + EDGE_MM):
            text = f"x {x_mm:.3g} mm, along the arc {s_mm:.3g} mm is off the sheet"
            fail(f"{place}.position_m", f"{text} (x {low:g} to {high:g} mm, arc {-half:g} to {half:g} mm): is it in m?")
        first, site = places.setdefault(position_m, (channel.name, channel.site or place))
        if site != (channel.site or place):
            fail(f"{place}.position_m", f"it is also that of {first}")
    side_mm = max(high - low, 2 * half)
    if sheet is not None and len(places) >= FEW and np.ptp(spots, axis=0).max() < SPREAD * side_mm:
        text = f"taxels lie within {np.ptp(spots, axis=0).max():.3g} mm of a skin of {side_mm:g} mm"
        fail("spec.streams.channels.position_m", text)


@check("sensor")
def skin_yields_as_skins_do(subject: Subject) -> None:
    """A modulus of another power of ten makes a sensor that feels everything, or nothing, and looks plausible.

    State young in the unit of its source (1 MPa is 1000 kPa), and the thickness in millimetres.
    """
    skin = subject.spec.skin
    if not isinstance(skin, BondedLayer | FoamPad):
        skip("it states no layer that a press indents by itself")
    young_mpa, thick_mm = skin.young.to("MPa"), skin.thickness.to("mm")
    # The softer of two bounds from above: a column below the punch, and a half-space of the same modulus under it
    # (Boussinesq's punch, Poisson's ratio left out: it changes this by a quarter).
    column_mm = PRESS_N * thick_mm / (young_mpa * math.pi * PRESS_MM**2)
    depth_mm = min(column_mm, PRESS_N / (2 * PRESS_MM * young_mpa))
    if not LEAST_MM <= depth_mm <= thick_mm:
        text = f"{skin.young} and {skin.thickness}: {PRESS_N:g} N on a punch of {PRESS_MM:g} mm indents it by "
        fail("spec.skin.young, thickness", f"{text}{depth_mm:.2g} mm, and it is {thick_mm:g} mm thick")


@check("sensor")
def nuisances_are_in_its_units(subject: Subject) -> None:
    """Amounts are added to readings as they are: volts on a channel of counts are off by its whole scale.

    Name a kind of channel that the sensor has, and state amounts in its unit, shares in 1, time constants in a time.
    """
    spec = subject.spec
    if not spec.nuisances:
        skip("it states no nuisances")
    device = spec.data_sheet.exists or any(np.dtype(one.dtype).kind in "iu" for one in spec.streams)
    for kind, nuisances in spec.nuisances.items():
        where, channels = f"spec.nuisances[{kind}]", spec.channels(kind)
        if not channels:
            fail(where, f"it has no {kind} channel; it has {', '.join({one.kind for one in spec.channels()})}")
        if device and nuisances.white.value == nuisances.step.value == 0:
            fail(where, "white and step are both 0: every reading is exact; state one of them")
        for field in nuisances.model_fields_set - {"creep"}:
            amount = getattr(nuisances, field)
            share = field.endswith("_scatter") or field in ("unit_gain", "offset_smooth")
            unit = "1" if share else channels[0].unit
            if amount is not None and not field.endswith("_tau") and amount.unit != unit:
                fail(f"{where}.{field}", f"its unit is {amount.unit!r}, and {unit!r} is needed")
