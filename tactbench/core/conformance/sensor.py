"""Checks of a sensor: its spec, and its transducer on approximate skin states, for which no equation is solved."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from typing import Any

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.streams import likely, limits_of
from tactbench.core.samples import FloatArray, SkinGrid, SkinState
from tactbench.core.spec import units
from tactbench.core.spec.sensor import ChannelSpec, Nuisances, StreamSpec, Vector
from tactbench.core.spec.skin import BondedLayer, FluidBackedShell, FoamPad, SkinSheet

LARGEST_MM = 250.0  # distance of the outermost taxels from the origin: the skin of a forearm is 0.3 m long
OF_KIND = {
    "force": "N", "torque": "N*m", "position": "m", "dc_pressure": "Pa", "ac_pressure": "Pa", "dc_temperature": "K",
    "joint": "rad",
}  # fmt: skip
"""A unit with the dimension of the quantity that a kind of channel measures."""
RAW = ("count", "V", "mV")
FASTEST_HZ, SLOWEST_HZ = 1e6, 0.1
SOONEST_S, LATEST_S = 20e-6, 0.25  # of a link's delay (assumed: an SPI word takes microseconds, a radio link 0.1 s)
SPREAD, FEW = 0.2, 3  # smallest extent of three or more taxels, of the skin's longer side
PRESS_N, PRESS_MM, LEAST_MM = 1.0, 2.5, 1e-3  # a press of a flat punch of this radius, and its least indentation
EDGE_MM, UNIT_NORMAL = 1e-6, 1e-3  # rounding of a position in metres; data sheets state normals to three decimals

Place = tuple[float, float]
GENTLE_N, FIRM_N, OVERLOAD_N = 1.0, 2.0, 100.0  # the last is beyond what any fingertip is pressed with on purpose
SHEAR = 0.3  # tangential over normal force of a press that is dragged: skin sticks to most surfaces up to it
MOST_PRESSED = 6  # places, drawn from the sensor's list: a wrong axis shows at each of them
REST_SHARE, REST_COUNTS = 0.01, 1.0  # tolerance of the rest, of the range, or without one in the channel's unit
STAYS = 0.02  # smallest motion of the response over that of the press: swapped axes leave a thousandth
SHARES = (0.1, 1.5)  # of a load, that channels in newton sum to: taxels leave gaps, and some overlap (assumed)
PATCH_MM, PATCH_CELLS = 1.25, 1.5  # deviation of a local press: half a fingertip's contact, and so many cells at least


def on_sheet_mm(sheet: SkinSheet | None, position_m: Vector) -> tuple[float, float]:
    """Return the axial coordinate and the arc length on the sheet [mm] of a place in the sensor's frame [m]."""
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
    """Saturation, tolerances, windows and delays are computed from the stated limits, rest levels and rates.

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
    """Positions in millimetres make a fingertip as large as a room; a taxel off the skin, or twice, is a copied line.

    Convert position_m: 1 mm is 0.001, 1 inch 0.0254. Name the `site` that taxels share, and move them within the sheet:
    x from x_min to x_max, along the arc within half its width. State a unit vector as normal.
    """
    placed = [(place, one, one.position_m) for place, _, one in _channels(subject) if one.position_m is not None]
    if not placed:
        skip("the sensor states no positions of channels")
    low, high, half, sheet = -LARGEST_MM, LARGEST_MM, LARGEST_MM, None
    if subject.spec.skin is not None:
        sheet = subject.spec.skin.sheet
        low, high, half = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm") / 2
    places: dict[Vector, tuple[str, str]] = {}
    spots = []
    for place, channel, position_m in placed:
        if channel.normal is not None and not abs(math.hypot(*channel.normal) - 1.0) <= UNIT_NORMAL:
            fail(f"{place}.normal", f"the length of the vector is {math.hypot(*channel.normal):.4g}, not 1")
        if channel.kind != "taxel":
            continue
        x_mm, s_mm = on_sheet_mm(sheet, position_m)
        spots.append((x_mm, s_mm))
        if not (low - EDGE_MM <= x_mm <= high + EDGE_MM and abs(s_mm) <= half + EDGE_MM):
            text = f"x {x_mm:.3g} mm, along the arc {s_mm:.3g} mm is off the sheet"
            fail(f"{place}.position_m", f"{text} (x {low:g} to {high:g} mm, arc {-half:g} to {half:g} mm): is it in m?")
        first, site = places.setdefault(position_m, (channel.name, channel.site or place))
        if site != (channel.site or place):
            fail(f"{place}.position_m", f"the position is the same as that of {first}")
    side_mm = max(high - low, 2 * half)
    if sheet is not None and len(places) >= FEW and np.ptp(spots, axis=0).max() < SPREAD * side_mm:
        text = f"taxels lie within {np.ptp(spots, axis=0).max():.3g} mm of a skin of {side_mm:g} mm"
        fail("spec.streams.channels.position_m", text)


@check("sensor")
def skin_yields_as_skins_do(subject: Subject) -> None:
    """A modulus wrong by a power of ten makes a sensor respond to everything or to nothing, and looks plausible.

    State young in the unit of its source (1 MPa is 1000 kPa), and the thickness in millimetres.
    """
    skin = subject.spec.skin
    if not isinstance(skin, BondedLayer | FoamPad):
        skip("the sensor has no skin with one elastic layer")
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
    """Amounts are added to readings in their stated unit: volts on a channel of counts are wrong by its whole scale.

    Name a kind of channel that the sensor has, and state amounts in its unit, shares in 1, time constants in s or ms.
    """
    spec = subject.spec
    if not spec.nuisances:
        skip("the sensor states no nuisances")
    device = spec.data_sheet.exists or any(np.dtype(one.dtype).kind in "iu" for one in spec.streams)
    for kind, nuisances in spec.nuisances.items():
        where, channels = f"spec.nuisances[{kind}]", spec.channels(kind)
        if not channels:
            fail(where, f"no channel is of kind {kind}; there are {', '.join({one.kind for one in spec.channels()})}")
        if device and nuisances.white.value == nuisances.step.value == 0:
            fail(where, "white and step are both 0: every reading is exact; state one of them")
        for field in nuisances.model_fields_set - {"creep"}:
            amount = getattr(nuisances, field)
            share = field.endswith("_scatter") or field in ("unit_gain", "offset_smooth")
            unit = "1" if share else channels[0].unit
            if amount is not None and not field.endswith("_tau") and amount.unit != unit:
                fail(f"{where}.{field}", f"the unit is {amount.unit!r}, and {unit!r} is needed")


def observed(subject: Subject) -> tuple[ChannelSpec, ...]:
    """Return the channels whose readings the transducer computes."""
    return tuple(subject.spec.channels("taxel", "dc_pressure"))


def skin_grid(sheet: SkinSheet) -> SkinGrid:
    """Return the centres of the grid cells of the sheet."""
    along, across = sheet.cells
    low, high, arc = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm")
    x_mm: FloatArray = low + (np.arange(along) + 0.5) * (high - low) / along
    s_mm: FloatArray = -arc / 2 + (np.arange(across) + 0.5) * arc / across
    return SkinGrid(x_mm=x_mm, s_mm=s_mm)


def patch_mm(grid: SkinGrid) -> float:
    """Return the standard deviation of the bell-shaped pressure of a local press [mm]."""
    return max(PATCH_CELLS * max(grid.cell_mm), PATCH_MM)


@cache
def _prepared(subject: Subject, names: tuple[str, ...]) -> Any:
    with code_of("transducer", subject):
        return subject.code("transducer")(subject.spec, skin_grid(subject.spec.skin.sheet), list(names))


def _read(subject: Subject, state: SkinState, names: tuple[str, ...] = ()) -> FloatArray:
    """Return the readings for a read-only state, by default of all channels in the spec's order."""
    names = names or tuple(one.name for one in observed(subject))
    transducer = _prepared(subject, names)
    for field in fields(state):
        if isinstance(array := getattr(state, field.name), np.ndarray):
            array.flags.writeable = False
    with code_of("transducer", subject), np.errstate(all="ignore"):
        given = np.asarray(transducer(state))
    if given.shape != (len(names),) or given.dtype.kind not in "fiu" or not np.isfinite(given).all():
        text = f"for {len(names)} channels at {state.force_n:g} N, the result is {given.dtype} of shape {given.shape}"
        fail("transducer", f"{text}, or no finite numbers: {given}")
    return given.astype(np.float64)


def _state(subject: Subject, force_n: float, at_mm: Place | None = None, dragged: Place = (0, 0)) -> SkinState:
    """Return the approximate state under a narrow press: a bell of pressure, and a dent of the same shape.

    No equation is solved. The dent goes a third of the way through the skin at 1 N and further in proportion, never
    through more than nine tenths. `dragged` is the tangential force over the normal one, along x and s: it moves the
    dent by a third of that share of its depth, and a press without it moves the skin away from its middle by as much.
    """
    skin, grid, at_mm = subject.spec.skin, skin_grid(subject.spec.skin.sheet), at_mm or _places(subject)[0]
    sigma = patch_mm(grid)
    apart = np.stack(np.meshgrid(grid.x_mm - at_mm[0], grid.s_mm - at_mm[1], indexing="ij")) / sigma
    bell = np.exp(-(apart**2).sum(axis=0) / 2)
    pressure = force_n / (2 * math.pi * sigma**2) * bell
    fluid, rest = isinstance(skin, FluidBackedShell), np.ones(bell.shape)
    if fluid:
        radius_mm = math.inf if skin.sheet.outer_radius is None else skin.sheet.outer_radius.to("mm")
        rest = skin.film.at(grid.x_mm, grid.s_mm / radius_mm)
    else:
        rest *= skin.thickness.to("mm")
    deflection = min(force_n / 3, 0.9) * bell * rest
    way, sheared = np.array(dragged)[:, None, None], bool(subject.spec.reads_shear)
    return SkinState(
        grid=grid, force_n=force_n, deflection_mm=deflection, pressure_mpa=pressure,
        thickness_mm=rest - deflection, depth_mm=float(deflection.max()), fluid_pressure_mpa=0.001 * force_n * fluid,
        contact_radius_mm=math.sqrt(5.0) * sigma if force_n else 0.0, residual=0.0,
        tangential_displacement_mm=(apart + way) * deflection / 3 if sheared else None,
        shear_mpa=way * pressure if sheared else None,
    )  # fmt: skip


@cache
def _sites(subject: Subject) -> dict[Place, list[int]]:
    """Return the columns of the taxels, grouped by place on the sheet [mm]."""
    sites: dict[Place, list[int]] = {}
    for column, channel in enumerate(observed(subject)):
        if channel.kind == "taxel" and channel.position_m is not None:
            sites.setdefault(on_sheet_mm(subject.spec.skin.sheet, channel.position_m), []).append(column)
    return sites


def _places(subject: Subject) -> list[Place]:
    """Return the places to press [mm]: those of some taxels, or the middle of the sheet if no position is stated."""
    sites, sheet = list(_sites(subject)), subject.spec.skin.sheet
    middle = (sheet.x_min.to("mm") + sheet.x_max.to("mm")) / 2, 0.0
    drawn = np.random.default_rng(0).permutation(len(sites))[:MOST_PRESSED]
    return [sites[one] for one in drawn] or [middle]


@cache
def _changes(subject: Subject, force_n: float = GENTLE_N) -> FloatArray:
    """Return the (places, channels) changes of the readings from rest under a press at each place."""
    rest = _read(subject, _state(subject, 0.0))
    return np.array([_read(subject, _state(subject, force_n, at)) for at in _places(subject)]) - rest


@check("sensor", needs="code-names-resolve limits-are-in-order")
def transducer_reads(subject: Subject) -> None:
    """A simulation reads states from rest to overload, repeatedly and for the requested channels only, and adds noise.

    Return one finite number for each name in `channel_names`, as an array of shape (n,), and look channels up by these
    names: never rely on their number or order. Guard divisions by force, pressure and contact radius, which are 0 at
    rest, and by a thickness that is used up. Keep nothing between two calls and draw nothing. The arrays of a state are
    read-only, and those of shear are None unless spec.reads_shear names a kind of channel.
    """
    if subject.descriptor.transducer is None:
        skip("the sensor has no transducer: it can be recorded and replayed, not simulated")
    if subject.spec.skin is None:
        fail("spec.skin", "the sensor has a transducer, but declares no skin")
    names = tuple(one.name for one in observed(subject))
    if not names:
        skip("the sensor has no channel that is read from the skin (taxel, dc_pressure)")
    _, first, _ = (_read(subject, _state(subject, force_n)) for force_n in (0.0, GENTLE_N, OVERLOAD_N))
    fewer = names[max(1, len(names) // 2) :: -1]
    again = dict(zip(fewer, _read(subject, _state(subject, GENTLE_N), fewer), strict=True))
    for name, value in zip(names, first, strict=True):
        # A solver may stop elsewhere for fewer channels.
        if not math.isclose(again.get(name, value), value, rel_tol=1e-3, abs_tol=1e-6):
            fail("transducer", f"{name} reads {value:g}, but {again[name]:g} in another order of channels")


@check("sensor", needs="transducer-reads")
def rest_is_as_stated(subject: Subject) -> None:
    """Drivers, tares and tables use the spec's rest level as unloaded; a simulation starts at the transducer's.

    State as `rest` the transducer's reading at zero load, or add `rest` in the transducer.
    """
    for channel, found in zip(observed(subject), _read(subject, _state(subject, 0.0)), strict=True):
        rest = found if channel.rest is None else channel.rest.to(channel.unit)
        low, high = limits_of(channel)
        if abs(found - rest) > (REST_SHARE * (high - low) if math.isfinite(high - low) else REST_COUNTS):
            fail(f"channel {channel.name}: rest", f"{rest:g} {channel.unit} is stated, the transducer gives {found:g}")


@check("sensor", needs="transducer-reads")
def it_answers_to_a_press(subject: Subject) -> None:
    """A change below noise and step carries no information; readings beyond the applied force make a sensor too good.

    Check units (mm, N, MPa in a SkinState; metres in position_m), and at the sensitivity. Channels in newton sum
    pressure over area: 1 MPa on 1 mm2 is 1 N, a gram-force 0.0098 N. If a reading decreases under more load, look for a
    limit that wraps, an absolute value, or a thickness that goes below 0.
    """
    every, changes = observed(subject), _changes(subject)
    own = [subject.spec.nuisances.get(one.kind, Nuisances()) for one in every]
    most, firm = (np.abs(one).max(axis=1) for one in (changes, _changes(subject, FIRM_N)))
    # A response at another place suffices: then the place is wrong.
    if not (np.abs(changes) > [max(one.white.value, one.step.value) for one in own]).any(axis=1).all():
        fail("transducer", f"{GENTLE_N:g} N change no channel by more than noise and step, but by {most.min():.3g}")
    # A sensor at its end gives the same reading twice; a hundredth is left to solvers.
    if (firm < 0.99 * most).any():
        fail("transducer", f"the largest changes are {most} under {GENTLE_N:g} N and {firm} under {FIRM_N:g} N")
    forces = [one.unit == "N" for one in every]
    share = float(np.median(np.abs(changes[:, forces].sum(axis=1)))) / GENTLE_N
    if any(forces) and not SHARES[0] <= share <= SHARES[1]:
        fail("transducer", f"the channels sum to {share:.3g} N under {GENTLE_N:g} N{likely(share)}")


@check("sensor", needs="it-answers-to-a-press")
def response_is_where_it_is_pressed(subject: Subject) -> None:
    """Swapped axes, a mirrored layout or positions in another frame give plausible readings of the wrong taxels.

    SkinState's arrays are (x, s): x along the finger, first; s across it. position_m is (x, y, z) in metres.
    """
    sites, pressed = _sites(subject), np.array(_places(subject))
    if len(sites) < 2:
        skip("the sensor states positions of fewer than two taxels")
    changes = np.abs(_changes(subject))
    weights = np.array([changes[:, columns].max(axis=1) for columns in sites.values()]).T
    centres = weights @ np.array(list(sites)) / weights.sum(axis=1, keepdims=True)
    slopes = np.linalg.lstsq(pressed - pressed.mean(axis=0), centres - centres.mean(axis=0))[0]
    wide = np.ptp(pressed, axis=0) >= patch_mm(skin_grid(subject.spec.skin.sheet)) / 2
    if (wide & ~(np.diag(slopes) > STAYS)).any():
        text = f"the response moves {np.diag(slopes).round(3)} times as far as a press along x and the arc"
        fail("transducer", f"{text}: are axes swapped or mirrored? Is position_m in metres?")


@check("sensor", needs="it-answers-to-a-press")
def shear_turns_with_its_direction(subject: Subject) -> None:
    """Dragging the skin in the opposite direction must reverse the shear readings; a magnitude alone has no direction.

    Read tangential_displacement_mm and shear_mpa with their signs: [0] along x, [1] along s. Or omit `reads_shear`.
    """
    if not subject.spec.reads_shear:
        skip("the spec names no kind of channel that reads shear")
    every, ways = observed(subject), SHEAR * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
    along_x, along_y, *back = (_read(subject, _state(subject, GENTLE_N, None, (x, y))) for x, y in ways)
    turned = np.array([along_x, along_y]) - back
    if not turned.any():
        fail("spec.reads_shear", "no channel changes under a drag along x or y, in either direction")
    named = np.array([[axis in axes_named(one.name) for one in every] for axis in "xy"], dtype=float)
    sums = np.abs(turned) @ named.T
    falls = all(one.unit == "N" for one in every) and ((turned * named).sum(axis=1) < 0).any()
    if falls or np.linalg.det(sums) < 0:
        text = f"under a drag along x, the x and y channels change by {sums[0]}, along y by {sums[1]}"
        fail("transducer", f"{text}: are axes swapped, or is a sign turned?")


def axes_named(name: str) -> str:
    """Return the axes in a channel's name, as a separate word or preceded by f or b: ``x1``, ``t3_x``, ``Bx``."""
    return "".join(re.findall(r"(?:^|(?<=[^a-z]))[fb]?([xyz])(?=[^a-z]|$)", name.lower()))
