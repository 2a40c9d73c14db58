"""Named force profiles: a staircase and a sine. Forces are in N, times in s and rates in Hz."""

from __future__ import annotations

import math

from tactbench.core.errors import UsageError
from tactbench.core.spec.profile import ForcePath
from tactbench.core.spec.quantity import Source

PER_PERIOD = 64
"""Number of points for each period of a sine; the straight lines between them deviate by at most ``1 - cos(pi/64)``,
0.12 % of the amplitude."""


def staircase(
    *,
    peak: float = 5.0,
    steps: float = 5,
    dwell: float = 3.0,
    rise: float = 0.5,
    hold: float = 3.0,
    rate: float = 100.0,
) -> ForcePath:
    """Return a path of equal steps up to a peak force and down again, as for a calibration curve with hysteresis.

    One step is a press that is held and released, which shows creep and recovery.

    Parameters
    ----------
    peak, steps
        Force of the highest level [N], and the number of levels above zero; UsageError unless it is whole.
    dwell, rise, hold
        Durations of each level, of each step between levels (above 0), and of the unloaded start [s].
    rate
        Rate of the reference clock [Hz].
    """
    count = _whole("staircase", "steps", steps)
    levels = [peak * level / count for level in (*range(1, count + 1), *range(count - 1, -1, -1))]
    return _path("staircase", rate, (hold, 0.0), *((span, level) for level in levels for span in (rise, dwell)))


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
    """Return a path in which the force oscillates as a sine about a mean, beginning and ending at its lowest value.

    It is linear between 64 points of each period, which deviates by up to 0.12 % of the amplitude from a sine.

    Parameters
    ----------
    mean, amplitude
        Mean of the force, and amplitude of the swing [N]. UsageError is raised if the amplitude exceeds the mean.
    frequency, periods
        Frequency [Hz], and the number of periods: UsageError unless it is whole.
    rise, hold
        Time from zero to the lowest force (above 0), and without load before [s].
    rate
        Rate of the reference clock [Hz].
    """
    if amplitude > mean:
        raise UsageError(
            f"The profile 'sine': amplitude is given as {amplitude:g} N, and at most the mean force, {mean:g} N, is "
            "expected.",
            hint="Give a smaller amplitude or a larger mean: an indenter cannot pull.",
        )
    points = _whole("sine", "periods", periods) * PER_PERIOD
    step = 1.0 / (frequency * PER_PERIOD)
    swing = ((step, mean - amplitude * math.cos(2 * math.pi * point / PER_PERIOD)) for point in range(1, points + 1))
    return _path("sine", rate, (hold, 0.0), (rise, mean - amplitude), *swing)


def _whole(profile: str, name: str, given: float) -> int:
    """Return the parameter `given` as an integer; raise UsageError unless it is a whole number of at least 1."""
    if given < 1 or given != int(given):
        raise UsageError(
            f"The profile {profile!r}: {name} is given as {given:g}, and a whole number, 1 or more, is expected."
        )
    return int(given)


def _path(name: str, rate_hz: float, *spans: tuple[float, float]) -> ForcePath:
    """Return a path from 0 N over `spans`, each given as its duration [s] and the force at its end [N]."""
    times, forces = [0.0], [0.0]
    for span, force in spans:
        if span > 0 or force != forces[-1]:  # ForcePath refuses a force that jumps
            times.append(times[-1] + span)
            forces.append(force)
    return ForcePath(
        times_s=tuple(times),
        forces_n=tuple(forces),
        samples=max(1, round(rate_hz * times[-1])),
        source=Source(tag="assumed", reference=f"the force profile {name}"),
    )
