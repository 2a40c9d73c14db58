"""Profiles of a recording's normal force over time: a ramp, or a path of straight pieces; a staircase and a sine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise, takewhile
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from tactbench.core.errors import UsageError
from tactbench.core.spec.quantity import Frozen, Quantity, Source, assumed, sourced

PAPER = "Karl et al. 2016, ML-based tactile sensor calibration"


class ForceRamp(Frozen):
    """A ramp: the force stays at its start for `hold_s` and then rises linearly to its end."""

    kind: Literal["ramp"] = "ramp"
    start: Quantity = sourced(0.0, "N", PAPER)
    end: Quantity = sourced(5.0, "N", PAPER)
    hold: Quantity = assumed(7.2, "s", "the paper's first 600 samples: only the initialization of the setup")
    duration: Quantity = sourced(60.0, "s", PAPER)
    """Duration of the whole recording, including the hold [time]."""
    samples: int = Field(default=5000, ge=1)
    """Number of samples of the reference clock in the whole recording."""

    @property
    def largest_n(self) -> float:
        """The largest force of the profile [N]."""
        return max(self.start.to("N"), self.end.to("N"))

    @property
    def hold_s(self) -> float:
        """Time for which the force stays at its start, at most the duration of the recording [s]."""
        return min(self.hold.to("s"), self.duration.to("s"))

    @property
    def corners(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Times [s] and forces [N] of the corners between which the force is linear in time."""
        start, end, duration = self.start.to("N"), self.end.to("N"), self.duration.to("s")
        if self.hold_s >= duration:
            return (0.0, duration), (start, start)
        return (0.0, self.hold_s, duration), (start, start, end)


class ForcePath(Frozen):
    """A force profile that is linear between given points, as for presses, taps and ripples."""

    kind: Literal["path"] = "path"
    times_s: tuple[float, ...] = Field(min_length=2)
    """Times of the points, (k,), ascending from 0 [s]; the last is the end of the recording."""
    forces_n: tuple[Annotated[float, Field(ge=0)], ...]
    """Forces at the points, (k,) [N]."""
    samples: int = Field(ge=1)
    """Number of samples of the reference clock over the whole recording."""
    source: Source

    @model_validator(mode="after")
    def _runs(self) -> ForcePath:
        if len(self.times_s) != len(self.forces_n):
            raise ValueError("times_s and forces_n must have equal lengths, one force for each time")
        if self.times_s[0] != 0 or any(b <= a for a, b in pairwise(self.times_s)):
            raise ValueError("the times of a force path must ascend and begin at 0 s")
        return self

    @property
    def duration(self) -> Quantity:
        """Duration of the whole recording, the last of the times."""
        return Quantity(value=self.times_s[-1], unit="s", source=self.source)

    @property
    def largest_n(self) -> float:
        """The largest force of the profile [N]."""
        return max(self.forces_n)

    @property
    def hold_s(self) -> float:
        """Time for which the force stays at its start value [s]."""
        points = zip(self.times_s, self.forces_n, strict=True)
        return max(time for time, _ in takewhile(lambda point: point[1] == self.forces_n[0], points))

    @property
    def corners(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Times [s] and forces [N] of the points between which the force is linear in time."""
        return self.times_s, self.forces_n


def _profile_kind(given: Any) -> str:
    """Return the name of a profile's kind, by default `ramp`."""
    return str(given.get("kind", "ramp") if isinstance(given, Mapping) else getattr(given, "kind", "ramp"))


ForceProfile = Annotated[
    Annotated[ForceRamp, Tag("ramp")] | Annotated[ForcePath, Tag("path")], Discriminator(_profile_kind)
]
"""Any profile of the normal force, a ramp or a path."""


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
        Force of the highest level [N], and the number of levels above zero; UsageError unless the number is whole.
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
        Frequency [Hz], and the number of periods; UsageError unless the number is whole.
    rise, hold
        Time from zero to the lowest force (above 0), and without load before [s].
    rate
        Rate of the reference clock [Hz].
    """
    if amplitude > mean:
        raise UsageError(
            f"The profile 'sine': amplitude is {amplitude:g} N, which exceeds the mean force of {mean:g} N.",
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
            f"The profile {profile!r}: {name} is given as {given:g} where a whole number of at least 1 is expected."
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
