"""What is wrong with a stream of forces: too large, not known, or too old. No input or output; a clock's numbers only.

An unknown force counts as too large a force.
"""

from __future__ import annotations

import math
import operator
from collections import deque
from collections.abc import Sequence
from itertools import chain, pairwise

import numpy as np

from tactbench.core.samples import Block, Quality
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.guard_messages import Limits, Trigger

DELAY_WINDOW_NS = 1_000_000_000
"""The least delay of a device's samples is looked for in this one and the one before (assumed: clocks that differ by
100 ppm move apart by 0.2 ms meanwhile)."""
_LOOKED_AT = 3
"""Samples of which two are a touch."""

Problem = tuple[Trigger, str]
_Rows = Sequence[Sequence[float]]
"""Samples as plain numbers: a guard looks at one or two at a time, of which numpy takes longer."""


class ForceWatch:
    """Watches one force stream.

    The age of a sample is the time since its receipt and, where the device has a clock of its own, its delay on the way
    beyond the least of the last second or two: a stream that is held up somewhere is old although it keeps coming. A
    constant delay cannot be seen. A sample that comes twice, or after newer ones, may be too large or not known, and is
    otherwise none: it makes no touch and no age.

    Parameters
    ----------
    stream
        Channels of kind ``force`` and ``torque`` are looked at.

    Attributes
    ----------
    force_n, norm_n
        Pressing force and norm of the force, less the zero, of the newest sample; NaN: none yet, or no limits.
    sequence, t_ns
        Number and receipt of that sample; -1 and 0: none yet.
    changed
        Number of the newest sample that is not in every channel the same as the one before it; -1: none yet.
    received
        Samples so far.
    """

    def __init__(self, stream: StreamSpec) -> None:
        kinds = [channel.kind for channel in stream.channels]
        self._forces = [n for n, kind in enumerate(kinds) if kind == "force"]
        self._torques = [n for n, kind in enumerate(kinds) if kind == "torque"]
        self.force_n = self.norm_n = math.nan
        self.sequence, self.t_ns, self.changed, self.received = -1, 0, -1, 0
        self._delay_ns = 0
        self._offsets: deque[tuple[int, int]] = deque(maxlen=2)
        self._last: Sequence[float] | None = None
        self._same = 0
        self._pressing: deque[float] = deque(maxlen=_LOOKED_AT)

    def touched(self, touch_n: float) -> bool:
        """Return whether two of the last three samples are above a force [N]."""
        return sum(force > touch_n for force in self._pressing) >= _LOOKED_AT - 1

    def age_s(self, now_ns: int) -> float:
        """Return the age of the newest sample [s]; infinite: there is none."""
        return 1e-9 * (now_ns - self.t_ns + self._delay_ns) if self.received else math.inf

    def old(self, now_ns: int, limits: Limits) -> Problem | None:
        """Return what is wrong if nothing newer has come by now."""
        age_s = self.age_s(now_ns)
        if age_s <= limits.force_age_s:
            return None
        return Trigger.FORCE_OLD, f"the newest force is {1e3 * age_s:.1f} ms old, {1e3 * limits.force_age_s:.1f} may be"

    def take(
        self, block: Block, newer: Block | None, limits: Limits | None, *, travelling: bool = False
    ) -> Problem | None:
        """Take samples; return the first thing that is wrong with them.

        Parameters
        ----------
        block
            All that came.
        newer
            Those of them that are newer than each one before, in order; None: there are none.
        limits
            None: only what needs none is kept up: numbers, times, equal samples.
        travelling
            Whether the ceiling of travel counts.
        """
        lost, same = (0, self._same) if newer is None else self._take_newer(newer)
        if limits is None or not len(block.data):
            return None
        wrenches = _without_zero(block, limits)
        if newer is not None:
            own = wrenches if newer is block else _without_zero(newer, limits)
            self._pressing.extend([limits.sign * wrench[limits.channel] for wrench in own[-_LOOKED_AT:]])
            self.force_n = self._pressing[-1]
            self.norm_n = _norm(own[-1], self._forces)
        return (
            self._unknown(wrenches, block.quality)
            or self._too_large(wrenches, limits, travelling)
            or self._irregular(lost, same, limits)
        )

    def _take_newer(self, block: Block) -> tuple[int, int]:
        """Keep up numbers and times; return the most samples lost in a row, and the most that were the same."""
        rows, first = block.data.tolist(), self.sequence + 1
        numbers = range(first, first + len(rows)) if block.sequence is None else block.sequence.tolist()
        before = self.sequence if self.received else numbers[0] - 1
        lost = max([number - last for last, number in pairwise((before, *numbers))]) - 1
        same = self._same_in_a_row(rows, numbers)
        self.received += len(rows)
        self.sequence = numbers[-1]
        self.t_ns = 0 if block.t_ns is None else int(block.t_ns[-1])
        if block.device_ns is not None:
            self._delay_ns = self._delayed(self.t_ns, int(block.device_ns[-1]))
        return lost, same

    def _unknown(self, wrenches: _Rows, quality: np.typing.NDArray[np.uint8] | None) -> Problem | None:
        if not all(map(math.isfinite, chain.from_iterable(wrenches))):
            return Trigger.FORCE_NOT_A_NUMBER, "a sample of the force sensor is not a number"
        if quality is None:
            return None
        marks = int(np.bitwise_or.reduce(quality, axis=None))
        if marks & Quality.SATURATED:
            return Trigger.FORCE_SATURATED, "the force sensor says that it is at an end of its range"
        if marks & (Quality.MISSING | Quality.SUSPECT):
            return Trigger.FORCE_FLAGGED, "a sample of the force sensor is flagged as missing or suspect"
        return None

    def _too_large(self, wrenches: _Rows, limits: Limits, travelling: bool) -> Problem | None:
        largest = max([_norm(wrench, self._forces) for wrench in wrenches])
        ceiling = limits.travel_ceiling_n if travelling else limits.force_ceiling_n
        if largest >= ceiling:
            trigger = Trigger.TRAVEL_CEILING if travelling else Trigger.FORCE_CEILING
            return trigger, f"{largest:.3f} N, the ceiling is {ceiling:g} N"
        if limits.torque_ceiling_nm is not None and self._torques:
            torque = max([_norm(wrench, self._torques) for wrench in wrenches])
            if torque >= limits.torque_ceiling_nm:
                return Trigger.TORQUE_CEILING, f"{torque:.4f} N m, the ceiling is {limits.torque_ceiling_nm:g} N m"
        return None

    def _irregular(self, lost: int, same: int, limits: Limits) -> Problem | None:
        if lost > limits.lost_samples:
            return Trigger.FORCE_GAP, f"{lost} force samples were lost in a row, {limits.lost_samples} may be"
        if same >= limits.same_samples:
            return Trigger.FORCE_STUCK, f"{same} force samples in a row are the same in every channel"
        return None

    def _same_in_a_row(self, rows: _Rows, numbers: Sequence[int]) -> int:
        """Return the longest run of equal samples that ends in these; 1: each is another one than that before."""
        longest = 0
        for row, number in zip(rows, numbers, strict=True):
            if self._last is None or any(map(operator.ne, row, self._last)):
                longest = max(longest, self._same)
                self.changed, self._same = number, 0
            self._last = row
            self._same += 1
        return max(longest, self._same)

    def _delayed(self, t_ns: int, device_ns: int) -> int:
        """Return by how much a sample took longer than the quickest of late [ns]."""
        offset = t_ns - device_ns
        if not self._offsets or t_ns - self._offsets[-1][0] > DELAY_WINDOW_NS:
            self._offsets.append((t_ns, offset))
        elif offset < self._offsets[-1][1]:
            self._offsets[-1] = (self._offsets[-1][0], offset)
        return offset - min(least for _, least in self._offsets)


def _without_zero(block: Block, limits: Limits) -> _Rows:
    return [[value - zero for value, zero in zip(row, limits.zero, strict=True)] for row in block.data.tolist()]


def _norm(wrench: Sequence[float], channels: Sequence[int]) -> float:
    square = 0.0  # added up in order: `sum` rounds otherwise from Python 3.12 on
    for channel in channels:
        square += wrench[channel] * wrench[channel]
    return math.sqrt(square)
