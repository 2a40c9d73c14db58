"""What both force-torque sensors have in common: their stream, what moves their emulators, counters that wrap."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from tactbench.plugin import ChannelSpec, RigError, StreamSpec
from tactbench.plugin.devices import Unwrap

IntArray = npt.NDArray[np.int64]

AXES = ("fx", "fy", "fz", "tx", "ty", "tz")
STREAM = "force_torque"

RESTART_RUN = 41
"""Samples behind the newest, each next after the other, that mean a counter begun anew (derived: a late datagram of a
Net F/T box has up to 40)."""


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
    return tuple([senses.get(name, 0.0) for name in AXES])


class SampleCounter:
    """A counter of samples of 32 bits, which must not begin anew."""

    def __init__(self, device: str) -> None:
        self._unwrap = Unwrap(32)
        self._device = device
        self._newest: int | None = None
        self._previous = 0
        self._behind = 0

    def counted_on(self, numbers: npt.ArrayLike) -> IntArray:
        """Return (n,) numbers counted on over wraps, of (n,) numbers in the order in which they came.

        Raises
        ------
        RigError
            If the device has begun to count anew: it was without power, or another host commands it.
        """
        found = self._unwrap(numbers)
        in_order = self._newest is not None and found[0] > self._newest and (found[1:] > found[:-1]).all()
        if not in_order or self._behind:
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
