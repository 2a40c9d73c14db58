"""Checks of a sensor's transducer: what it reads from states of its skin, of which no equation has to be solved."""

from __future__ import annotations

import copy
import inspect
import math
from collections.abc import Sequence
from dataclasses import fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import check, code_of, fail, skip
from tactbench.core.conformance.common import difference
from tactbench.core.conformance.geometry import on_sheet_mm, patch_mm, pressed_locally, skin_grid
from tactbench.core.conformance.subject import Subject
from tactbench.core.samples import SkinState
from tactbench.core.spec.sensor import ChannelSpec

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray

READ_FROM_THE_SKIN = ("taxel", "dc_pressure")
"""Kinds of channels that a transducer answers for."""
GENTLE_N = 1.0
OVERLOAD_N = 100.0
"""A hundred times the gentle press: beyond what any fingertip is pressed with on purpose."""
SHEAR = 0.3
"""Tangential over normal force of a press that is dragged: what skin sticks to on most surfaces."""
MOST_PRESSED = 6
"""Channels that are pressed, evenly spread over the sensor's list: a wrong axis shows at each of them."""
REST_SHARE = 0.01
"""Of the channel's range, that the reading at rest may differ from the stated one."""
REST_COUNTS = 1.0
"""The same where no range is stated, and at least: a step of a converter [the channel's unit]."""
AS_STRONG = 0.5
"""A taxel that answers with this share of the strongest answer may be the one that is pressed: taxels differ in gain,
and currents or foam carry a press to their neighbours. Swapped or mirrored axes leave a thousandth."""


def observed_channels(subject: Subject) -> tuple[ChannelSpec, ...]:
    """Return the channels that the transducer answers for."""
    found: tuple[ChannelSpec, ...] = subject.descriptor.spec.channels(*READ_FROM_THE_SKIN)
    return found


@lru_cache(maxsize=2)
def _prepared(subject: Subject, channel_names: tuple[str, ...]) -> Any:
    descriptor = subject.descriptor
    factory = subject.code("transducer")
    asked = inspect.signature(factory).parameters
    # The twin gives its own to those that ask for them.
    given = {
        name: value
        for name, value in (("tolerance", 1e-6), ("refinement", 1))
        if name in asked and asked[name].default is inspect.Parameter.empty
    }
    with code_of("transducer", subject.package):
        return factory(descriptor.spec, skin_grid(descriptor.spec.skin.sheet), list(channel_names), **given)


def _names(channels: Sequence[ChannelSpec]) -> tuple[str, ...]:
    return tuple(channel.name for channel in channels)


def _read(subject: Subject, state: SkinState, channel_names: tuple[str, ...] | None = None) -> Any:
    """Return what the transducer gives for a state, whatever that is."""
    channel_names = _names(observed_channels(subject)) if channel_names is None else channel_names
    transducer = _prepared(subject, channel_names)
    with code_of("transducer", subject.package):
        return transducer(state)


def _state(
    subject: Subject,
    force_n: float,
    at_mm: tuple[float, float] | None = None,
    dragged: tuple[float, float] = (0.0, 0.0),
) -> SkinState:
    spec = subject.descriptor.spec
    sheet = spec.skin.sheet
    middle = ((sheet.x_min.to("mm") + sheet.x_max.to("mm")) / 2, 0.0)
    return pressed_locally(
        spec.skin, skin_grid(sheet), force_n, middle if at_mm is None else at_mm, dragged if spec.reads_shear else None
    )


@lru_cache(maxsize=32)
def _response(subject: Subject, force_n: float, at_mm: tuple[float, float] | None = None) -> FloatArray:
    """Return the (channels,) change of the readings against rest."""
    import numpy as np

    changed = np.asarray(_read(subject, _state(subject, force_n, at_mm)), dtype=np.float64)
    return np.asarray(changed - _at_rest(subject))


@lru_cache(maxsize=2)
def _at_rest(subject: Subject) -> FloatArray:
    """Return the (channels,) readings at zero load."""
    import numpy as np

    return np.asarray(_read(subject, _state(subject, 0.0)), dtype=np.float64)


@check("sensor", needs=("code-names-resolve", "skin-is-possible"), level="silver")
def transducer_builds(subject: Subject) -> None:
    """The twin calls it with the spec, a grid of the skin and the names of the channels that somebody looks at.

    Give it the arguments (spec, grid, channel_names), let it return a function of a SkinState, and name every channel.
    """
    if subject.descriptor.transducer is None:
        skip("it names no transducer: it can be recorded and replayed, not simulated")
    if not observed_channels(subject):
        skip("it has no channel that is read from the skin (taxel, dc_pressure)")
    made = _prepared(subject, _names(observed_channels(subject)))
    if not callable(made):
        fail("transducer", f"it returned a {type(made).__name__}, and a function of a SkinState is needed")


@check("sensor", needs=("transducer-builds",), level="silver")
def transducer_leaves_the_spec_alone(subject: Subject) -> None:
    """The spec is in every recording and key; a transducer that writes into its dictionaries changes them afterwards.

    Copy what you change: ``dict(spec.parameters)``.
    """
    spec = subject.descriptor.spec
    with code_of("transducer", subject.package):
        transducer = subject.code("transducer")(
            spec, skin_grid(spec.skin.sheet), list(_names(observed_channels(subject)))
        )
        transducer(_state(subject, GENTLE_N))
    place = difference(subject.as_it_was["spec"], spec.model_dump())
    if place:
        fail(f"spec.{place}", "the transducer has changed it")


@check("sensor", needs=("transducer-builds",), level="silver")
def readings_have_the_shape(subject: Subject) -> None:
    """Columns of a recording are the channels in the order that was asked for; one too few shifts all that follow.

    Return one number for each name in `channel_names`, as an array of shape (n,).
    """
    import numpy as np

    names = _names(observed_channels(subject))
    for channel_names in (names, names[:1]):
        given = np.asarray(_read(subject, _state(subject, GENTLE_N), channel_names))
        if given.shape != (len(channel_names),):
            fail(
                "transducer",
                f"shape {given.shape} for {len(channel_names)} requested channels; ({len(channel_names)},) is needed",
            )
        if given.dtype.kind not in "fiu":
            fail("transducer", f"values of type {given.dtype}, and numbers are needed")


@check("sensor", needs=("readings-have-the-shape",), level="silver")
def finite_at_zero_load(subject: Subject) -> None:
    """Every recording begins unloaded: no contact, no radius, nothing to divide by.

    Guard divisions by the force, the pressure or the contact radius, which are all 0 at rest.
    """
    import numpy as np

    with np.errstate(all="ignore"):
        given = np.asarray(_read(subject, _state(subject, 0.0)), dtype=np.float64)
    _finite(subject, given, "at zero load")


@check("sensor", needs=("finite-at-zero-load",), level="silver")
def finite_over_range(subject: Subject) -> None:
    """Presses go beyond what a sensor is made for; the converter clips a large number, and nothing mends a NaN.

    Limit what you divide by: a gap or a thickness that is used up.
    """
    import numpy as np

    with np.errstate(all="ignore"):
        given = np.asarray(_read(subject, _state(subject, OVERLOAD_N)), dtype=np.float64)
    _finite(subject, given, f"at {OVERLOAD_N:g} N, far over range")


def _finite(subject: Subject, given: FloatArray, when: str) -> None:
    import numpy as np

    names = _names(observed_channels(subject))
    bad = [name for name, value in zip(names, given, strict=True) if not np.isfinite(value)]
    if bad:
        fail("transducer", f"{len(bad)} readings are not finite {when}: {', '.join(bad[:4])}")


@check("sensor", needs=("finite-at-zero-load",), level="silver")
def rest_is_as_stated(subject: Subject) -> None:
    """The spec's rest level is what drivers, tares and tables take for unloaded; the twin begins where this reads.

    State the `rest` that the transducer gives at zero load, or add it there.
    """
    channels = observed_channels(subject)
    stated = [channel for channel in channels if channel.rest is not None]
    if not stated:
        skip("it states no rest level")
    given = _at_rest(subject)
    for channel, found in zip(channels, given, strict=True):
        if channel.rest is None:
            continue
        rest = channel.rest.to(channel.unit)
        span = channel.upper - channel.lower if channel.upper is not None and channel.lower is not None else 0.0
        if abs(found - rest) > max(REST_SHARE * span, REST_COUNTS):
            fail(f"channel {channel.name}: rest", f"{rest:g} {channel.unit} is stated, the transducer gives {found:g}")


@check("sensor", needs=("finite-at-zero-load",), level="silver")
def order_follows_the_request(subject: Subject) -> None:
    """A run asks for the channels that it observes, in its own order; a transducer that ignores it mixes taxels up.

    Look channels up by the names in `channel_names`; never rely on their number or order.
    """
    import numpy as np

    names = _names(observed_channels(subject))
    if len(names) < 2:
        skip("it has one channel")
    at_mm = _places(subject)[0][1] if _places(subject) else None
    whole = dict(zip(names, np.asarray(_read(subject, _state(subject, GENTLE_N, at_mm))).tolist(), strict=True))
    fewer = tuple(reversed(names[: max(2, len(names) // 2)]))
    given = np.asarray(_read(subject, _state(subject, GENTLE_N, at_mm), fewer))
    if given.shape != (len(fewer),):
        fail("transducer", f"shape {given.shape} for {len(fewer)} requested channels")
    for name, value in zip(fewer, given.tolist(), strict=True):
        # A solver may stop elsewhere for fewer channels.
        if not math.isclose(value, whole[name], rel_tol=1e-3, abs_tol=1e-6):
            fail(
                "transducer",
                f"{name} reads {value:g} where it is asked for in another order, and {whole[name]:g} before",
            )


@check("sensor", needs=("finite-at-zero-load",), level="silver")
def same_state_same_reading(subject: Subject) -> None:
    """Noise comes from the twin, under a seed; a transducer with a memory or a generator of its own repeats nothing.

    Leave noise, drift and creep to the nuisances, and keep nothing between two calls.
    """
    import numpy as np

    first = np.array(_read(subject, _state(subject, GENTLE_N)))
    _read(subject, _state(subject, 2 * GENTLE_N))
    again = np.array(_read(subject, _state(subject, GENTLE_N)))
    changed = [name for name, a, b in zip(_names(observed_channels(subject)), first, again, strict=True) if a != b]
    if changed:
        fail("transducer", f"{changed[0]} reads another value for the same state, the second time")


@check("sensor", needs=("readings-have-the-shape",), level="silver")
def state_is_not_changed(subject: Subject) -> None:
    """The twin uses a state for every effect and interpolates between states; one written into is wrong for all.

    Work on a copy: ``state.pressure_mpa.copy()``, and no ``+=`` on fields of the state.
    """
    import numpy as np

    state = _state(subject, GENTLE_N)
    before = copy.deepcopy(state)
    _read(subject, state)
    for part, old in ((state, before), (state.grid, before.grid)):
        for field in fields(part):
            if field.name != "grid" and not np.array_equal(getattr(part, field.name), getattr(old, field.name)):
                fail(f"state.{field.name}", "the transducer has changed it")


@check("sensor", needs=("finite-at-zero-load",), level="silver")
def it_answers_to_a_press(subject: Subject) -> None:
    """A channel that never changes tells nothing, and a table of it looks like a very quiet sensor.

    Look at units (mm, N, MPa in a SkinState; metres in position_m), and at the sensitivity.
    """
    import numpy as np

    places = _places(subject)
    pressed = [_response(subject, GENTLE_N, at_mm) for _, at_mm in places] or [_response(subject, GENTLE_N)]
    names = _names(observed_channels(subject))
    if not places and not np.any(pressed):
        fail("transducer", f"no channel changes under {GENTLE_N:g} N")
    for (own, _), change in zip(places, pressed, strict=False):
        if not any(change[names.index(name)] for name in own):
            fail("transducer", f"{', '.join(own)} does not change under {GENTLE_N:g} N on its own place")


@check("sensor", needs=("it-answers-to-a-press",), level="silver")
def response_is_where_it_is_pressed(subject: Subject) -> None:
    """Swapped axes, a mirrored layout or places in another frame give plausible readings of the wrong taxels.

    SkinState's arrays are (x, s): x along the finger, first; s across it. position_m is (x, y, z) in metres.
    """
    import numpy as np

    spec, names = subject.descriptor.spec, _names(observed_channels(subject))
    sites = _sites(subject)
    if len(sites) < 2:
        skip("it states no places of several taxels")
    # A neighbour may answer more strongly where the layout is finer than the press.
    near_mm = 2 * patch_mm(skin_grid(spec.skin.sheet))
    for own, at_mm in _places(subject):
        change = np.abs(_response(subject, GENTLE_N, at_mm))
        strength = {at: max(change[names.index(one)] for one in ones) for at, ones in sites.items()}
        strongest = max(strength, key=strength.__getitem__)
        if strength[at_mm] >= AS_STRONG * strength[strongest]:
            continue
        if math.dist(strongest, at_mm) > near_mm:
            fail(
                "transducer",
                f"pressed at {own[0]} (x {at_mm[0]:.3g} mm, arc {at_mm[1]:.3g} mm), {sites[strongest][0]} of "
                f"{spec.name} at (x {strongest[0]:.3g}, arc {strongest[1]:.3g}) answers most: are axes swapped?",
            )


@check("sensor", needs=("it-answers-to-a-press",), level="silver")
def sign_is_as_stated(subject: Subject) -> None:
    """Health checks, tares and plots rely on the stated sign of response.

    State sign = 1 where the reading rises under load, -1 where it falls, 0 where it does either.
    """
    channels = observed_channels(subject)
    names = _names(channels)
    signed = {name for name, channel in zip(names, channels, strict=True) if channel.sign}
    places = [(own, at_mm) for own, at_mm in _places(subject) if signed.intersection(own)]
    if not places:
        skip("it states no sign of a channel with a place")
    for own, at_mm in places:
        response = _response(subject, GENTLE_N, at_mm)
        for name in signed.intersection(own):
            stated, change = channels[names.index(name)].sign, response[names.index(name)]
            if change * stated < 0:
                fail(f"channel {name}: sign", f"{stated:+d} is stated, and it changes by {change:+.3g} under load")


@check("sensor", needs=("it-answers-to-a-press",), level="silver")
def more_load_more_response(subject: Subject) -> None:
    """A reading that falls back under more load gives two forces for one value, unless the sensor says so.

    Look for a limit that wraps, an absolute value, or a thickness that goes below 0.
    """
    import numpy as np

    places = _places(subject)
    if not places:
        skip("it states no place of any channel")
    names = _names(observed_channels(subject))
    own, at_mm = places[0]
    gentle, firm = (np.abs(_response(subject, force_n, at_mm)) for force_n in (0.5, 1.5))
    place = max((names.index(name) for name in own), key=lambda one: float(gentle[one]))
    # A sensor at its end gives the same reading twice; a hundredth is left to solvers.
    if firm[place] < 0.99 * gentle[place]:
        text = f"{names[place]} changes by {gentle[place]:.3g} under 0.5 N and by {firm[place]:.3g} under 1.5 N"
        fail("transducer", text)


@check("sensor", needs=("it-answers-to-a-press",), level="silver")
def shear_turns_with_its_direction(subject: Subject) -> None:
    """What is dragged the other way moves the other way; a size without its sign tells no direction.

    Read tangential_displacement_mm and shear_mpa with their signs: [0] along x, [1] along s. Or leave reads_shear out.
    """
    import numpy as np

    if not subject.descriptor.spec.reads_shear:
        skip("its spec names no kind of channel that reads shear")
    names = _names(observed_channels(subject))
    at_mm = _places(subject)[0][1] if _places(subject) else None

    def added(x: float, s: float) -> FloatArray:
        given = np.asarray(_read(subject, _state(subject, GENTLE_N, at_mm, (x, s))), dtype=np.float64)
        return np.asarray(given - _response(subject, GENTLE_N, at_mm) - _at_rest(subject))

    felt = False
    for axis, there, back in (("x", added(SHEAR, 0), added(-SHEAR, 0)), ("s", added(0, SHEAR), added(0, -SHEAR))):
        strongest = int(np.argmax(np.abs(there - back) + np.abs(there + back)))
        felt = felt or bool(there[strongest] or back[strongest])
        if there[strongest] * back[strongest] > 0:
            fail(
                f"channel {names[strongest]}",
                f"dragged along {axis} it changes by {there[strongest]:+.3g}, dragged back by {back[strongest]:+.3g}",
            )
    if not felt:
        fail("spec.reads_shear", "dragged along x or s, no channel changes")


def _places(subject: Subject) -> list[tuple[list[str], tuple[float, float]]]:
    """Return the names of the taxels at some places on the sheet, with these [mm]."""
    sites = _sites(subject)
    chosen = list(sites.items())
    step = max(1, math.ceil(len(chosen) / MOST_PRESSED))
    return [(names, at_mm) for at_mm, names in chosen[::step]]


@lru_cache(maxsize=2)
def _sites(subject: Subject) -> dict[tuple[float, float], list[str]]:
    """Return the names of the taxels at each place on the sheet [mm]."""
    sheet = subject.descriptor.spec.skin.sheet
    sites: dict[tuple[float, float], list[str]] = {}
    for channel in observed_channels(subject):
        if channel.kind == "taxel" and channel.position_m is not None:
            sites.setdefault(on_sheet_mm(sheet, channel.position_m), []).append(channel.name)
    return sites


CHECKS = (
    transducer_builds, transducer_leaves_the_spec_alone, readings_have_the_shape, finite_at_zero_load,
    finite_over_range, rest_is_as_stated, order_follows_the_request, same_state_same_reading, state_is_not_changed,
    it_answers_to_a_press, response_is_where_it_is_pressed, sign_is_as_stated, more_load_more_response,
    shear_turns_with_its_direction,
)  # fmt: skip
