"""Checks of a sensor's transducer: what it reads from states of its skin, of which no equation has to be solved."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from dataclasses import fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from tactbench.core.conformance.check import CheckFailed, Subject, check, code_of, fail, skip
from tactbench.core.conformance.sensor_spec import on_sheet_mm
from tactbench.core.conformance.streams import likely, limits_of
from tactbench.core.samples import FloatArray, SkinGrid, SkinState
from tactbench.core.spec.sensor import ChannelSpec, Nuisances
from tactbench.core.spec.skin import FluidBackedShell, SkinSheet

Place = tuple[float, float]
GENTLE_N, FIRM_N, OVERLOAD_N = 1.0, 2.0, 100.0  # the last is beyond what any fingertip is pressed with on purpose
SHEAR = 0.3  # tangential over normal force of a press that is dragged: what skin sticks to on most surfaces
MOST_PRESSED = 6  # places, evenly over the sensor's list: a wrong axis shows at each of them
REST_SHARE, REST_COUNTS = 0.01, 1.0  # of the range, and in the channel's unit, by which the rest may differ
STAYS = 0.02  # share of a press's way by which the answer moves along at least: swapped axes leave a thousandth
SHARES = (0.1, 1.5)  # of a load, that channels in newton sum to: taxels leave gaps, and some overlap (assumed)
PATCH_MM, PATCH_CELLS = 1.25, 1.5  # deviation of a local press: half a fingertip's contact, and so many cells at least
SHEAR_FIELDS = "reads_shear names no kind of channel, so tangential_displacement_mm and shear_mpa are None"


def observed(subject: Subject) -> tuple[ChannelSpec, ...]:
    """Return the channels that the transducer answers for."""
    return tuple(subject.spec.channels("taxel", "dc_pressure"))


def skin_grid(sheet: SkinSheet) -> SkinGrid:
    """Return the centres of the sheet's own cells."""
    along, across = sheet.cells
    low, high, arc = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm")
    x_mm: FloatArray = low + (np.arange(along) + 0.5) * (high - low) / along
    s_mm: FloatArray = -arc / 2 + (np.arange(across) + 0.5) * arc / across
    return SkinGrid(x_mm=x_mm, s_mm=s_mm)


def patch_mm(grid: SkinGrid) -> float:
    """Return the standard deviation of a local press."""
    return max(PATCH_CELLS * max(grid.cell_mm), PATCH_MM)


@lru_cache(maxsize=4)
def _prepared(subject: Subject, names: tuple[str, ...]) -> Any:
    with code_of("transducer", subject):
        return subject.code("transducer")(subject.spec, skin_grid(subject.spec.skin.sheet), list(names))


def _read(subject: Subject, state: SkinState, names: tuple[str, ...] = ()) -> FloatArray:
    """Return the readings of a state, all of them in the order of the spec by default."""
    names = names or tuple(one.name for one in observed(subject))
    transducer = _prepared(subject, names)
    try:
        with code_of("transducer", subject), np.errstate(all="ignore"):
            given = np.asarray(transducer(state))
    except CheckFailed as failure:
        if state.shear_mpa is None:
            sheared = np.zeros((2, *state.pressure_mpa.shape))
            with suppress(Exception):
                transducer(replace(state, shear_mpa=sheared, tangential_displacement_mm=sheared))
                failure = CheckFailed(f"spec.reads_shear, {failure.where}", f"{SHEAR_FIELDS}: {failure.text}")
        raise failure from failure.__cause__
    if given.shape != (len(names),) or given.dtype.kind not in "fiu":
        fail("transducer", f"{given.dtype} of shape {given.shape} for {len(names)} channels asked for")
    if not np.isfinite(given).all():
        bad = names[int(np.argmin(np.isfinite(given)))]
        fail("transducer", f"{bad} of {len(names)} channels not finite at {state.force_n:g} N")
    return given.astype(np.float64)


def _state(subject: Subject, force_n: float, at_mm: Place | None = None, dragged: Place = (0, 0)) -> SkinState:
    """Return the state that a narrow press would leave: a bell of pressure, and a dent of the same shape.

    No equation is solved. The dent goes a third of the way through the skin at 1 N and further in proportion, never
    through more than nine tenths. `dragged` is the tangential force over the normal one, along x and s: it moves the
    dent by a third of that share of its depth, and the press alone moves the skin away from its middle by as much.
    """
    skin, grid, at_mm = subject.spec.skin, skin_grid(subject.spec.skin.sheet), at_mm or _places(subject)[0]
    sigma = patch_mm(grid)
    apart = np.stack(np.meshgrid(grid.x_mm - at_mm[0], grid.s_mm - at_mm[1], indexing="ij")) / sigma
    bell = np.exp(-(apart**2).sum(axis=0) / 2)
    pressure = force_n / (2 * math.pi * sigma**2) * bell
    if isinstance(skin, FluidBackedShell):
        radius_mm = math.inf if skin.sheet.outer_radius is None else skin.sheet.outer_radius.to("mm")
        rest, least = skin.film.at(grid.x_mm, grid.s_mm / radius_mm), skin.residual_film.to("mm")
        fluid_mpa = 0.001 * force_n
    else:
        rest, least, fluid_mpa = np.full(bell.shape, skin.thickness.to("mm")), 0.0, 0.0
    deflection = min(force_n / 3, 0.9) * bell * rest
    way, sheared = np.array(dragged)[:, None, None], bool(subject.spec.reads_shear)
    return SkinState(
        grid=grid, force_n=force_n, deflection_mm=deflection, pressure_mpa=pressure,
        thickness_mm=np.maximum(rest - deflection, least), depth_mm=float(deflection.max()),
        fluid_pressure_mpa=fluid_mpa,
        contact_radius_mm=math.sqrt(5.0) * sigma if force_n else 0.0, residual=0.0,
        tangential_displacement_mm=(apart + way) * deflection / 3 if sheared else None,
        shear_mpa=way * pressure if sheared else None,
    )  # fmt: skip


@lru_cache(maxsize=2)
def _sites(subject: Subject) -> dict[Place, list[int]]:
    """Return the columns of the taxels at each place on the sheet [mm]."""
    sites: dict[Place, list[int]] = {}
    for column, channel in enumerate(observed(subject)):
        if channel.kind == "taxel" and channel.position_m is not None:
            sites.setdefault(on_sheet_mm(subject.spec.skin.sheet, channel.position_m), []).append(column)
    return sites


def _places(subject: Subject) -> list[Place]:
    """Return what is pressed: some of the taxels' places, or the middle of the sheet where none is stated."""
    sites, sheet = list(_sites(subject)), subject.spec.skin.sheet
    middle = (sheet.x_min.to("mm") + sheet.x_max.to("mm")) / 2, 0.0
    return sites[:: max(1, math.ceil(len(sites) / MOST_PRESSED))] or [middle]


@lru_cache(maxsize=4)
def _responses(subject: Subject, force_n: float) -> dict[Place, FloatArray]:
    """Return by pressed place the change of each reading against rest."""
    rest = _read(subject, _state(subject, 0.0))
    return {at: _read(subject, _state(subject, force_n, at)) - rest for at in _places(subject)}


@check("sensor", needs="code-names-resolve limits-are-in-order")
def transducer_reads(subject: Subject) -> None:
    """The twin calls it with the spec, a grid of the skin and the channels that are asked for, from rest to overload.

    Return one finite number for each name in `channel_names`, as an array of shape (n,); guard divisions by force,
    pressure and contact radius, which are 0 at rest, and by a thickness that is used up.
    """
    if subject.descriptor.transducer is None:
        skip("it names no transducer: it can be recorded and replayed, not simulated")
    if subject.spec.skin is None:
        fail("spec.skin", "it names a transducer and declares no skin to read from")
    if not observed(subject):
        skip("it has no channel that is read from the skin (taxel, dc_pressure)")
    for force_n in (0.0, GENTLE_N, OVERLOAD_N):
        _read(subject, _state(subject, force_n))


@check("sensor", needs="transducer-reads")
def rest_is_as_stated(subject: Subject) -> None:
    """The spec's rest level is what drivers, tares and tables take for unloaded; the twin begins where this reads.

    State the `rest` that the transducer gives at zero load, or add it there.
    """
    for channel, found in zip(observed(subject), _read(subject, _state(subject, 0.0)), strict=True):
        rest = found if channel.rest is None else channel.rest.to(channel.unit)
        low, high = limits_of(channel)
        span = high - low if math.isfinite(high - low) else 0.0
        if abs(found - rest) > max(REST_SHARE * span, REST_COUNTS):
            fail(f"channel {channel.name}: rest", f"{rest:g} {channel.unit} is stated, the transducer gives {found:g}")


@check("sensor", needs="transducer-reads")
def transducer_has_no_memory(subject: Subject) -> None:
    """The twin uses a state several times, asks for some of the channels in an order of its own, and adds the noise.

    Keep nothing between two calls, draw nothing, and copy what you change: ``state.pressure_mpa.copy()``. Look channels
    up by the names in `channel_names`; never rely on their number or order.
    """
    state, untouched = _state(subject, GENTLE_N), _state(subject, GENTLE_N)
    first = _read(subject, state)
    for field in fields(state):
        if field.name != "grid" and not np.array_equal(getattr(state, field.name), getattr(untouched, field.name)):
            fail(f"state.{field.name}", "the transducer has changed it")
    _read(subject, _state(subject, FIRM_N))
    changed = np.flatnonzero(first != _read(subject, untouched))
    if len(changed):
        fail("transducer", f"{observed(subject)[changed[0]].name} reads another value for the same state")
    names = [one.name for one in observed(subject)]
    fewer = names[max(1, len(names) // 2) :: -1]
    others = _read(subject, untouched, tuple(fewer))
    for name, value, before in zip(fewer, others, first[len(fewer) - 1 :: -1], strict=True):
        # A solver may stop elsewhere for fewer channels.
        if not math.isclose(value, before, rel_tol=1e-3, abs_tol=1e-6):
            fail("transducer", f"{name} reads {value:g} asked for in another order, and {before:g} before")


@check("sensor", needs="transducer-reads")
def it_answers_to_a_press(subject: Subject) -> None:
    """What changes by less than its noise and step tells nothing; newtons that are lost make a sensor too good.

    Look at units (mm, N, MPa in a SkinState; metres in position_m), and at the sensitivity. Channels in newton sum
    pressure over area: 1 MPa on 1 mm2 is 1 N, a gram-force 0.0098 N.
    """
    known, every = subject.spec.nuisances, observed(subject)
    own = [known.get(one.kind, Nuisances()) for one in every]
    least = np.array([max(one.white.value, one.step.value) for one in own])
    changes = list(_responses(subject, GENTLE_N).values())
    for change in changes:
        # Elsewhere it may be felt as well, and more: then it is the place that is wrong.
        if not (np.abs(change) > least).any():
            most = int(np.argmax(np.abs(change)))
            text = f"{GENTLE_N:g} N change {every[most].name} by {change[most]:.3g}: no more than noise and step"
            fail("transducer", text)
    forces = [one.unit == "N" for one in every]
    share = float(np.median([abs(change[forces].sum()) / GENTLE_N for change in changes]))
    if any(forces) and not SHARES[0] <= share <= SHARES[1]:
        fail("transducer", f"its channels sum to {share:.3g} N under {GENTLE_N:g} N{likely(share)}")


@check("sensor", needs="it-answers-to-a-press")
def response_is_where_it_is_pressed(subject: Subject) -> None:
    """Swapped axes, a mirrored layout or places in another frame give plausible readings of the wrong taxels.

    SkinState's arrays are (x, s): x along the finger, first; s across it. position_m is (x, y, z) in metres.
    """
    sites = _sites(subject)
    if len(sites) < 2:
        skip("it states no places of several taxels")
    places = np.array(list(sites))
    rest, ends = _read(subject, _state(subject, 0.0)), (places.min(axis=0), places.max(axis=0))
    for axis, name in enumerate(("x", "the arc")):
        if ends[1][axis] - ends[0][axis] < patch_mm(skin_grid(subject.spec.skin.sheet)) / 2:
            continue
        centres = []
        for end in ends:
            at = (ends[0] + ends[1]) / 2
            at[axis] = end[axis]
            change = np.abs(_read(subject, _state(subject, GENTLE_N, tuple(at))) - rest)
            weights = np.array([change[columns].max() for columns in sites.values()])
            centres.append(weights @ places[:, axis] / (weights.sum() or math.nan))
        if centres[1] - centres[0] <= STAYS * (ends[1] - ends[0])[axis]:
            text = f"pressed further along {name}, its answer stays or moves back: are axes swapped or mirrored?"
            fail("transducer", f"{text} Is position_m in metres?")


@check("sensor", needs="it-answers-to-a-press")
def sign_is_as_stated(subject: Subject) -> None:
    """Health checks, tares and plots rely on the stated sign of response, estimators on one load for one reading.

    State sign = 1 where the reading rises under load, -1 where it falls, 0 where it does either. Where it falls back
    under more load, look for a limit that wraps, an absolute value, or a thickness that goes below 0.
    """
    for at_mm, change in _responses(subject, GENTLE_N).items():
        for column in _sites(subject).get(at_mm, []):
            channel = observed(subject)[column]
            if change[column] * channel.sign < 0:
                text = f"{channel.sign:+d} is stated, and it changes by {change[column]:+.3g} under load"
                fail(f"channel {channel.name}: sign", text)
        firm, most = _responses(subject, FIRM_N)[at_mm], int(np.argmax(np.abs(change)))
        # A sensor at its end gives the same reading twice; a hundredth is left to solvers.
        if abs(firm[most]) < 0.99 * abs(change[most]):
            name = observed(subject)[most].name
            text = f"changes by {change[most]:.3g} under {GENTLE_N:g} N and by {firm[most]:.3g} under {FIRM_N:g} N"
            fail("transducer", f"{name} {text}")


@check("sensor", needs="it-answers-to-a-press")
def shear_turns_with_its_direction(subject: Subject) -> None:
    """What is dragged the other way moves the other way; a size without its sign tells no direction.

    Read tangential_displacement_mm and shear_mpa with their signs: [0] along x, [1] along s. Or leave reads_shear out.
    """
    if not subject.spec.reads_shear:
        skip("its spec names no kind of channel that reads shear")
    plain, felt = _read(subject, _state(subject, GENTLE_N)), False
    every = observed(subject)
    of_axis = {axis: [column for column, one in enumerate(every) if axis in axes_named(one.name)] for axis in "xy"}
    newtons = all(one.unit == "N" for one in every)
    moved: dict[str, dict[str, float]] = {}
    for axis, (x, s) in {"x": (SHEAR, 0.0), "y": (0.0, SHEAR)}.items():
        there, back = (_read(subject, _state(subject, GENTLE_N, None, one)) - plain for one in ((x, s), (-x, -s)))
        most = int(np.argmax(np.abs(there) + np.abs(back)))
        felt |= bool(there[most] or back[most])
        if there[most] * back[most] > 0:
            text = f"dragged along {axis} it changes by {there[most]:+.3g}, dragged back by {back[most]:+.3g}"
            fail(f"channel {every[most].name}", text)
        moved[axis] = {one: float(np.abs(there[columns]).sum()) for one, columns in of_axis.items()}
        if newtons and there[of_axis[axis]].sum() < 0:
            fail("transducer", f"dragged along {axis}, its {axis} channels fall: is a sign turned?")
    if not felt:
        fail("spec.reads_shear", "dragged along x or y, no channel changes")
    if moved["x"]["x"] * moved["y"]["y"] < moved["x"]["y"] * moved["y"]["x"]:
        fail("transducer", "dragged along x its y channels change more, and along y its x channels: are axes swapped?")


def axes_named(name: str) -> str:
    """Return the axes that a channel's name has as a word of their own, or behind f or b: ``x1``, ``t3_x``, ``Bx``."""
    return "".join(re.findall(r"(?:^|(?<=[^a-z]))[fb]?([xyz])(?=[^a-z]|$)", name.lower()))
