"""Checks of a sensor's transducer: what it reads from states of its skin, of which no equation has to be solved."""

from __future__ import annotations

import copy
import inspect
import math
from dataclasses import fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import CheckFailed, Subject, check, code_of, fail, skip
from tactbench.core.conformance.skin_state import on_sheet_mm, patch_mm, pressed_locally, skin_grid
from tactbench.core.spec.sensor import ChannelSpec

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray, SkinState

GENTLE_N, OVERLOAD_N = 1.0, 100.0
"""The overload is beyond what any fingertip is pressed with on purpose."""
SHEAR = 0.3
"""Tangential over normal force of a press that is dragged: what skin sticks to on most surfaces."""
MOST_PRESSED = 6
"""Places that are pressed, evenly spread over the sensor's list: a wrong axis shows at each of them."""
REST_SHARE, REST_COUNTS = 0.01, 1.0
"""Of the channel's range that the reading at rest may differ from the stated one, and at least [channel's unit]."""
AS_STRONG = 0.5
"""A taxel that answers with this share of the strongest answer may be the one that is pressed: taxels differ in gain,
and currents or foam carry a press to their neighbours. Swapped or mirrored axes leave a thousandth."""
SHEAR_FIELDS = "reads_shear names no kind of channel, so tangential_displacement_mm and shear_mpa are None"


@lru_cache(maxsize=2)
def observed(subject: Subject) -> dict[str, ChannelSpec]:
    """Return the channels that the transducer answers for, by name."""
    return {one.name: one for one in subject.spec.channels("taxel", "dc_pressure")}


@lru_cache(maxsize=4)
def _prepared(subject: Subject, names: tuple[str, ...]) -> Any:
    factory = subject.code("transducer")
    asked = inspect.signature(factory).parameters
    # The twin gives its own to those that ask for them.
    given = {
        name: value
        for name, value in (("tolerance", 1e-6), ("refinement", 1))
        if name in asked and asked[name].default is inspect.Parameter.empty
    }
    with code_of("transducer", subject):
        return factory(subject.spec, skin_grid(subject.spec.skin.sheet), list(names), **given)


def _read(subject: Subject, state: SkinState, names: tuple[str, ...] = ()) -> FloatArray:
    """Return the readings of a state, all of them in the order of the spec by default."""
    import numpy as np

    names = names or tuple(observed(subject))
    transducer = _prepared(subject, names)
    try:
        with code_of("transducer", subject), np.errstate(all="ignore"):
            given = np.asarray(transducer(state))
    except CheckFailed as failure:
        if "NoneType" in failure.text and not subject.spec.reads_shear:
            raise CheckFailed(f"spec.reads_shear, {failure.where}", f"{SHEAR_FIELDS}: {failure.text}") from failure
        raise
    if given.shape != (len(names),) or given.dtype.kind not in "fiu":
        fail("transducer", f"{given.dtype} of shape {given.shape} for {len(names)} channels asked for")
    bad = [name for name, value in zip(names, given, strict=True) if not np.isfinite(value)]
    if bad:
        fail("transducer", f"{', '.join(bad[:4])} of {len(names)} channels not finite at {state.force_n:g} N")
    return given.astype(np.float64)


def _state(
    subject: Subject, force_n: float, at_mm: tuple[float, float] | None = None, dragged: tuple[float, float] = (0, 0)
) -> SkinState:
    spec = subject.spec
    sheet = spec.skin.sheet
    place = at_mm or ((sheet.x_min.to("mm") + sheet.x_max.to("mm")) / 2, 0.0)
    return pressed_locally(spec.skin, skin_grid(sheet), force_n, place, dragged if spec.reads_shear else None)


@lru_cache(maxsize=32)
def _response(subject: Subject, force_n: float, at_mm: tuple[float, float] | None = None) -> dict[str, float]:
    """Return the change of each reading against rest."""
    change = _read(subject, _state(subject, force_n, at_mm)) - _read(subject, _state(subject, 0.0))
    return dict(zip(observed(subject), change.tolist(), strict=True))


@lru_cache(maxsize=2)
def _sites(subject: Subject) -> dict[tuple[float, float], list[str]]:
    """Return the names of the taxels at each place on the sheet [mm]."""
    sites: dict[tuple[float, float], list[str]] = {}
    for name, channel in observed(subject).items():
        if channel.kind == "taxel" and channel.position_m is not None:
            sites.setdefault(on_sheet_mm(subject.spec.skin.sheet, channel.position_m), []).append(name)
    return sites


def _pressed_places(subject: Subject) -> list[tuple[float, float]]:
    sites = list(_sites(subject))
    return sites[:: max(1, math.ceil(len(sites) / MOST_PRESSED))]


@check("sensor", needs=("code-names-resolve", "limits-are-in-order"))
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


@check("sensor", needs=("transducer-reads",))
def rest_is_as_stated(subject: Subject) -> None:
    """The spec's rest level is what drivers, tares and tables take for unloaded; the twin begins where this reads.

    State the `rest` that the transducer gives at zero load, or add it there.
    """
    for channel, found in zip(observed(subject).values(), _read(subject, _state(subject, 0.0)), strict=True):
        if channel.rest is None:
            continue
        rest = channel.rest.to(channel.unit)
        span = channel.upper - channel.lower if channel.upper is not None and channel.lower is not None else 0.0
        if abs(found - rest) > max(REST_SHARE * span, REST_COUNTS):
            fail(f"channel {channel.name}: rest", f"{rest:g} {channel.unit} is stated, the transducer gives {found:g}")


@check("sensor", needs=("transducer-reads",))
def order_follows_the_request(subject: Subject) -> None:
    """A run asks for the channels that it observes, in its own order; a transducer that ignores it mixes taxels up.

    Look channels up by the names in `channel_names`; never rely on their number or order.
    """
    names = tuple(observed(subject))
    at_mm = next(iter(_sites(subject)), None)
    state = _state(subject, GENTLE_N, at_mm)
    whole = dict(zip(names, _read(subject, state).tolist(), strict=True))
    fewer = tuple(reversed(names[: max(2, len(names) // 2)]))
    for name, value in zip(fewer, _read(subject, state, fewer).tolist(), strict=True):
        # A solver may stop elsewhere for fewer channels.
        if not math.isclose(value, whole[name], rel_tol=1e-3, abs_tol=1e-6):
            fail("transducer", f"{name} reads {value:g} asked for in another order, and {whole[name]:g} before")


@check("sensor", needs=("transducer-reads",))
def transducer_has_no_memory(subject: Subject) -> None:
    """The twin interpolates between states and uses each several times; noise comes from the twin, under a seed.

    Keep nothing between two calls, draw nothing, and copy what you change: ``state.pressure_mpa.copy()``.
    """
    import numpy as np

    state = _state(subject, GENTLE_N)
    before = copy.deepcopy(state)
    first = _read(subject, state)
    for field in fields(state):
        if field.name != "grid" and not np.array_equal(getattr(state, field.name), getattr(before, field.name)):
            fail(f"state.{field.name}", "the transducer has changed it")
    _read(subject, _state(subject, 2 * GENTLE_N))
    changed = np.flatnonzero(first != _read(subject, _state(subject, GENTLE_N)))
    if len(changed):
        fail("transducer", f"{list(observed(subject))[changed[0]]} reads another value for the same state")


@check("sensor", needs=("transducer-reads",))
def it_answers_to_a_press(subject: Subject) -> None:
    """A channel that changes by less than its noise and step tells nothing, and looks like a very quiet sensor.

    Look at units (mm, N, MPa in a SkinState; metres in position_m), and at the sensitivity.
    """
    nuisances = subject.spec.nuisances

    def felt(name: str, change: float) -> bool:
        own = nuisances.get(observed(subject)[name].kind)
        least = 0.0 if own is None else max(own.white.value, own.step.value)
        return abs(change) > least

    places: list[tuple[float, float] | None] = [*_pressed_places(subject)] or [None]
    for at_mm in places:
        change = _response(subject, GENTLE_N, at_mm)
        own = _sites(subject)[at_mm] if at_mm else list(change)
        # Elsewhere it may be felt as well, and more: then it is the place that is wrong.
        if not any(felt(name, change[name]) for name in change):
            most = max(own, key=lambda name: abs(change[name]))
            where = f"{most} on its own place" if at_mm else f"{most} most of all"
            fail("transducer", f"{GENTLE_N:g} N change {where} by {change[most]:.3g}: no more than noise and step")


@check("sensor", needs=("it-answers-to-a-press",))
def response_is_where_it_is_pressed(subject: Subject) -> None:
    """Swapped axes, a mirrored layout or places in another frame give plausible readings of the wrong taxels.

    SkinState's arrays are (x, s): x along the finger, first; s across it. position_m is (x, y, z) in metres.
    """
    sites = _sites(subject)
    if len(sites) < 2:
        skip("it states no places of several taxels")
    # A neighbour may answer more strongly where the layout is finer than the press.
    near_mm = 2 * patch_mm(skin_grid(subject.spec.skin.sheet))
    for at_mm in _pressed_places(subject):
        change = _response(subject, GENTLE_N, at_mm)
        strength = {at: max(abs(change[one]) for one in ones) for at, ones in sites.items()}
        most = max(strength, key=strength.__getitem__)
        if strength[at_mm] < AS_STRONG * strength[most] and math.dist(most, at_mm) > near_mm:
            fail(
                "transducer",
                f"pressed at {sites[at_mm][0]} (x {at_mm[0]:.3g} mm, arc {at_mm[1]:.3g} mm), {sites[most][0]} at "
                f"(x {most[0]:.3g}, arc {most[1]:.3g}) answers most: are axes swapped or mirrored?",
            )
        felt = {
            there: max(abs(_response(subject, GENTLE_N, there)[one]) for one in sites[at_mm])
            for there in _pressed_places(subject)
        }
        most = max(felt, key=felt.__getitem__)
        if felt[at_mm] < AS_STRONG * felt[most] and math.dist(most, at_mm) > near_mm:
            text = f"{sites[at_mm][0]} answers most to a press at {sites[most][0]}: is position_m read in another unit?"
            fail("transducer", text)


@check("sensor", needs=("it-answers-to-a-press",))
def sign_is_as_stated(subject: Subject) -> None:
    """Health checks, tares and plots rely on the stated sign of response.

    State sign = 1 where the reading rises under load, -1 where it falls, 0 where it does either.
    """
    for at_mm in _pressed_places(subject):
        for name in _sites(subject)[at_mm]:
            stated, change = observed(subject)[name].sign, _response(subject, GENTLE_N, at_mm)[name]
            if change * stated < 0:
                fail(f"channel {name}: sign", f"{stated:+d} is stated, and it changes by {change:+.3g} under load")


@check("sensor", needs=("it-answers-to-a-press",))
def more_load_more_response(subject: Subject) -> None:
    """A reading that falls back under more load gives two forces for one value.

    Look for a limit that wraps, an absolute value, or a thickness that goes below 0.
    """
    for at_mm in _pressed_places(subject)[:1]:
        gentle, firm = (_response(subject, force_n, at_mm) for force_n in (0.5, 1.5))
        name = max(_sites(subject)[at_mm], key=lambda one: abs(gentle[one]))
        # A sensor at its end gives the same reading twice; a hundredth is left to solvers.
        if abs(firm[name]) < 0.99 * abs(gentle[name]):
            fail("transducer", f"{name} changes by {gentle[name]:.3g} under 0.5 N and by {firm[name]:.3g} under 1.5 N")


@check("sensor", needs=("it-answers-to-a-press",))
def shear_turns_with_its_direction(subject: Subject) -> None:
    """What is dragged the other way moves the other way; a size without its sign tells no direction.

    Read tangential_displacement_mm and shear_mpa with their signs: [0] along x, [1] along s. Or leave reads_shear out.
    """
    import numpy as np

    if not subject.spec.reads_shear:
        skip("its spec names no kind of channel that reads shear")
    at_mm = next(iter(_sites(subject)), None)
    plain = _read(subject, _state(subject, GENTLE_N, at_mm))
    felt = False
    for axis, way in (("x", np.array([SHEAR, 0])), ("s", np.array([0, SHEAR]))):
        there, back = (_read(subject, _state(subject, GENTLE_N, at_mm, tuple(one))) - plain for one in (way, -way))
        most = int(np.argmax(np.abs(there - back) + np.abs(there + back)))
        felt |= bool(there[most] or back[most])
        if there[most] * back[most] > 0:
            text = f"dragged along {axis} it changes by {there[most]:+.3g}, dragged back by {back[most]:+.3g}"
            fail(f"channel {list(observed(subject))[most]}", text)
    if not felt:
        fail("spec.reads_shear", "dragged along x or s, no channel changes")
