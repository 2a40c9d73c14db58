"""Force profiles by name: a staircase, a held press and a sine, in newtons, seconds and hertz."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tactbench.core.errors import UsageError
from tactbench.core.spec.profile import ForcePath
from tactbench.core.spec.quantity import Source

PER_PERIOD = 64
"""Points of a period of a sine; the straight lines between them are off by ``1 - cos(pi/64)``, 0.12 % of its
amplitude."""


def staircase(
    *,
    peak: float = 5.0,
    steps: float = 5,
    dwell: float = 3.0,
    rise: float = 0.5,
    hold: float = 3.0,
    rate: float = 100.0,
) -> ForcePath:
    """Return a path with equal steps up to a force and down again, as for a calibration curve with hysteresis.

    Parameters
    ----------
    peak
        Force of the highest level [N].
    steps
        Levels above zero, a whole number [1].
    dwell
        How long each level is held [s].
    rise
        How long the way to the next level takes, above 0 [s].
    hold
        How long nothing presses before the first step [s].
    rate
        Samples of the reference clock [Hz].

    Raises
    ------
    UsageError
        If `steps` is no whole number from 1 on.
    """
    count = _whole("staircase", "steps", steps)
    levels = [peak * level / count for level in (*range(1, count + 1), *range(count - 1, -1, -1))]
    return _path("staircase", [(hold, 0.0), *((span, level) for level in levels for span in (rise, dwell))], rate)


def press_hold_release(
    *,
    peak: float = 5.0,
    rise: float = 1.0,
    dwell: float = 10.0,
    release: float = 1.0,
    rest: float = 10.0,
    hold: float = 3.0,
    rate: float = 100.0,
) -> ForcePath:
    """Return a path with one press that is held and released, which shows creep and recovery.

    Parameters
    ----------
    peak
        Force that is held [N].
    rise
        How long pressing takes, above 0 [s].
    dwell
        How long the force is held [s].
    release
        How long releasing takes, above 0 [s].
    rest
        How long nothing presses afterwards [s].
    hold
        How long nothing presses before [s].
    rate
        Samples of the reference clock [Hz].
    """
    return _path("press-hold-release", [(hold, 0.0), (rise, peak), (dwell, peak), (release, 0.0), (rest, 0.0)], rate)


def sine(
    *,
    mean: float = 2.0,
    amplitude: float = 1.0,
    frequency: float = 1.0,
    periods: float = 10,
    rise: float = 1.0,
    hold: float = 3.0,
    rate: float = 200.0,
) -> ForcePath:
    """Return a path in which the force swings about a mean, beginning and ending at its lowest.

    It runs straight between 64 points a period, by which it is off by up to 0.12 % of the amplitude.

    Parameters
    ----------
    mean
        About which it swings [N].
    amplitude
        By how much it swings to either side, at most `mean` [N].
    frequency
        Periods a second [Hz].
    periods
        How many, a whole number [1].
    rise
        How long the way from zero to the lowest force takes, above 0 [s].
    hold
        How long nothing presses before [s].
    rate
        Samples of the reference clock [Hz].

    Raises
    ------
    UsageError
        If it would pull, or `periods` is no whole number from 1 on.
    """
    if amplitude > mean:
        raise UsageError(
            f"The profile 'sine': amplitude is given as {amplitude:g} N, and at most its mean, {mean:g} N, is "
            "expected.",
            hint="An indenter cannot pull.",
        )
    points = _whole("sine", "periods", periods) * PER_PERIOD
    step = 1.0 / (frequency * PER_PERIOD)
    swing = [(step, mean - amplitude * math.cos(2 * math.pi * point / PER_PERIOD)) for point in range(1, points + 1)]
    return _path("sine", [(hold, 0.0), (rise, mean - amplitude), *swing], rate)


def _whole(profile: str, name: str, given: float) -> int:
    """Return `given` as a count; raises UsageError if it is no whole number from 1 on."""
    if given < 1 or given != int(given):
        raise UsageError(
            f"The profile {profile!r}: {name} is given as {given:g}, and a whole number from 1 on is expected.",
            hint="For example 5.",
        )
    return int(given)


def _path(name: str, spans: Sequence[tuple[float, float]], rate_hz: float) -> ForcePath:
    """Return the path from 0 N over `spans`: how long each takes [s], and the force at its end [N]."""
    times, forces = [0.0], [0.0]
    for span, force in spans:
        if span > 0 or force != forces[-1]:  # a force that jumps is refused by the path
            times.append(times[-1] + span)
            forces.append(force)
    return ForcePath(
        times_s=tuple(times),
        forces_n=tuple(forces),
        samples=max(1, round(rate_hz * times[-1])),
        source=Source(tag="assumed", reference=f"the force profile {name}"),
    )
