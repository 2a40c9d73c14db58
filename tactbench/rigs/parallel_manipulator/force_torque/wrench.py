"""What both force-torque sensors have in common: their stream, what moves their emulators, counters that wrap."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from tactbench.plugin import ChannelSpec, RigError, StreamSpec

IntArray = npt.NDArray[np.int64]

AXES = ("fx", "fy", "fz", "tx", "ty", "tz")
STREAM = "force_torque"

RESTART_RUN = 4
"""Samples behind the newest, each next after the other, that mean a counter begun anew and not late datagrams
(assumed)."""


def stream(rate_hz: float | None) -> StreamSpec:
    """Return the stream of forces [N] and torques [N*m] in the sensor's own axes."""
    return StreamSpec(
        name=STREAM,
        rate_hz=rate_hz,
        channels=tuple(
            ChannelSpec(name=name, kind="force", unit="N")
            if name.startswith("f")
            else ChannelSpec(name=name, kind="torque", unit="N*m")
            for name in AXES
        ),
    )


def wrench_of(senses: Mapping[str, float]) -> tuple[float, ...]:
    """Return fx, fy, fz [N], tx, ty, tz [N*m]; those that `senses` leaves out are 0."""
    return tuple(senses.get(name, 0.0) for name in AXES)


class Counter:
    """A counter of 32 bits, counted on over its wraps.

    A difference from one number to the next is that of the least magnitude modulo 2^32, so that a number that comes
    late is below those before it: 0 a duplicate, 1 in order, more a gap, below 0 late (as pyNetFT, sequence.cpp, tells
    them apart, sourced). Half a wrap without a sample is beyond it: 3.5 days at 7 kHz, 36 minutes of microseconds.
    """

    def __init__(self) -> None:
        self._last: int | None = None

    def counted_on(self, numbers: npt.ArrayLike) -> IntArray:
        """Return (n,) numbers counted on, of (n,) numbers in the order in which they came."""
        given = np.asarray(numbers, dtype=np.int64)
        last = int(given[0]) if self._last is None else self._last
        steps = np.diff(given, prepend=last)
        found: IntArray = last + np.cumsum((steps + (1 << 31)) % (1 << 32) - (1 << 31))
        self._last = int(found[-1])
        return found


class SampleCounter(Counter):
    """A counter of samples, which must not begin anew."""

    def __init__(self, device: str) -> None:
        super().__init__()
        self._device = device
        self._newest: int | None = None
        self._previous = 0
        self._behind = 0

    def counted_on(self, numbers: npt.ArrayLike) -> IntArray:
        """Return as :class:`Counter`.

        Raises
        ------
        RigError
            If the device has begun to count anew: it was without power, or another host commands it.
        """
        found = super().counted_on(numbers)
        if self._newest is None or (np.diff(found, prepend=self._newest) <= 0).any() or self._behind:
            self._look_back(found)
        else:
            self._newest = self._previous = int(found[-1])
        return found

    def _look_back(self, found: IntArray) -> None:
        for number in found.tolist():
            if self._newest is None or number > self._newest:
                self._newest, self._behind = number, 0
            elif number == self._previous + 1:
                self._behind += 1
            elif number != self._previous:
                self._behind = 1
            self._previous = number
            if self._behind >= RESTART_RUN:
                raise RigError(
                    f"{self._device} has begun to count its samples anew: it was without power, or another "
                    "host commands it.",
                    hint="Check power and network; start it again unloaded, since a bias set before may be lost.",
                )
