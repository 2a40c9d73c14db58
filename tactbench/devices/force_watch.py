"""Detection of problems in a stream of forces: too large, unknown, or too old. No input, output or clock.

An unknown force counts as too large a force.
"""

from __future__ import annotations

import math
from collections import deque
from statistics import fmean

import numpy as np

from tactbench.core.samples import Block, FloatArray, Quality
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.driver import SequenceCheck
from tactbench.devices.guard_messages import Limits, Trigger

DELAY_WINDOW_NS = 1_000_000_000
"""Half of the time over which the least delay of a device's samples is determined [ns] (assumed: clocks that differ by
100 ppm move apart by 0.2 ms in the full time)."""
MOST_BLOCKS = 50_000
"""Largest number of blocks stored for a rig, about 50 s at 1 kHz; after that the oldest are dropped."""
_LOOKED_AT = 3
"""Number of newest samples tested for a touch; two above the threshold count as a touch."""
_MOST_SOUND = 10_000
"""Largest number of samples in a mean: more than a second of the fastest force sensor (7 kHz)."""
UNRATED_HZ = 100.0
"""Assumed rate of a force sensor without a stated rate [Hz]: a low one."""


def samples(stream: StreamSpec, seconds: float) -> int:
    """Return the number of samples of a force stream in a time [s], at least 1.

    Means are over a number of samples, not a time: a busy host may receive no sample for a while, then many at once.
    """
    return max(1, round((stream.rate_hz or UNRATED_HZ) * seconds))


Problem = tuple[Trigger, str]


class ForceWatch:
    """Check of each sample in a stream of forces for values, losses and age.

    The age of a sample is the time since its receipt and, where the device has a clock of its own, its delay on the way
    beyond the least of the last second or two: a stream that is held up on its way is old although samples arrive. A
    constant delay cannot be detected. A duplicated or late sample is only checked for ceilings and unknown values; it
    affects neither touch nor age.

    Parameters
    ----------
    stream
        The stream; its channels of kind ``force`` and ``torque`` are checked.

    Attributes
    ----------
    blocks
        Blocks of samples for the rig, without duplicated and late samples.
    order
        Check of the samples' numbers for lost, late and duplicated samples.
    force_n
        Pressing force [N], less the zero, of the newest sample; NaN: no sample yet, or no limits.
    received, t_ns
        Number of samples so far, and time of receipt [ns] of the newest.
    changed
        Number of samples up to the newest that differs from the previous sample in any channel.
    """

    def __init__(self, stream: StreamSpec) -> None:
        kinds = np.array([channel.kind for channel in stream.channels])
        self._forces, self._torques = kinds == "force", kinds == "torque"
        self.blocks: deque[Block] = deque(maxlen=MOST_BLOCKS)
        self.order = SequenceCheck()
        self.force_n = math.nan
        self.received = self.t_ns = self.changed = 0
        self._delay_ns = 0
        self._offsets: deque[tuple[int, int]] = deque(maxlen=2)
        self._last = np.full((1, kinds.size), math.nan)
        self._same = 0
        self._pressing: deque[float] = deque(maxlen=_LOOKED_AT)
        self._sound: deque[tuple[int, float]] = deque(maxlen=_MOST_SOUND)

    def touched(self, touch_n: float) -> bool:
        """Return True if at least two of the last three samples are above a force [N]."""
        return sum(force > touch_n for force in self._pressing) >= _LOOKED_AT - 1

    def mean_n(self, since_ns: int, count: int) -> float:
        """Return the mean pressing force [N] of the newest `count` samples, if all were received after a time [ns].

        NaN: fewer samples were received after this time, or a sample had a problem.
        """
        while self._sound and (self._sound[0][0] < since_ns or len(self._sound) > count):
            self._sound.popleft()
        return fmean(force_n for _, force_n in self._sound) if len(self._sound) == count else math.nan

    def old(self, now_ns: int, limits: Limits) -> Problem | None:
        """Return the problem if the newest sample is too old; None if it is not."""
        age_s = 1e-9 * (now_ns - self.t_ns + self._delay_ns) if self.received else math.inf
        if age_s <= limits.force_age_s:
            return None
        return Trigger.FORCE_OLD, f"the force is {1e3 * age_s:.1f} ms old, limit {1e3 * limits.force_age_s:.1f} ms"

    def take(self, block: Block, limits: Limits | None, *, travelling: bool = False) -> Problem | None:
        """Check received samples; return the first problem found, or None.

        Parameters
        ----------
        block
            The samples received.
        limits
            Limits to check; None: only sample numbers, times and the count of equal samples are updated.
        travelling
            True if the force ceiling of travel applies, False for that of pressing.
        """
        lost = -self.order.gaps
        newer = self.order(block)
        lost += self.order.gaps
        same = self._same if newer is None else self._take_newer(newer)
        if limits is None or not len(block.data):
            return None
        zero = np.array(limits.zero)
        if newer is not None:
            self._pressing.extend(limits.pressing_n(newer.data[-_LOOKED_AT:]).tolist())
            self.force_n = self._pressing[-1]
        wrenches = block.data - zero
        problem = _unknown(wrenches, block) or self._too_large(wrenches, limits, travelling)
        if problem is None and lost > limits.lost_samples:
            problem = Trigger.FORCE_GAP, f"{lost} force samples are missing in one reading, limit {limits.lost_samples}"
        if problem is None and same >= limits.same_samples:
            problem = Trigger.FORCE_STUCK, f"{same} force samples in a row are equal in every channel"
        if problem is not None:
            self._sound.clear()
        elif newer is not None and newer.t_ns is not None:
            self._sound.extend(zip(newer.t_ns.tolist(), limits.pressing_n(newer.data).tolist(), strict=True))
        return problem

    def _take_newer(self, block: Block) -> int:
        """Update numbers and times; return the largest number of successive equal samples."""
        self.blocks.append(block)
        rows = block.data
        longest = 0
        repeats = (rows == np.concatenate((self._last, rows[:-1]))).all(axis=1)
        for repeated in repeats.tolist():
            self.received += 1
            if not repeated:
                self.changed, self._same = self.received, 0
            self._same += 1
            longest = max(longest, self._same)
        self._last = rows[-1:]
        self.t_ns = 0 if block.t_ns is None else int(block.t_ns[-1])
        if block.device_ns is not None:
            self._delay_ns = self._delayed(self.t_ns, int(block.device_ns[-1]))
        return longest

    def _too_large(self, wrenches: FloatArray, limits: Limits, travelling: bool) -> Problem | None:
        largest = float(np.linalg.norm(wrenches[:, self._forces], axis=1).max())
        ceiling = limits.travel_ceiling_n if travelling else limits.force_ceiling_n
        if largest >= ceiling:
            trigger = Trigger.TRAVEL_CEILING if travelling else Trigger.FORCE_CEILING
            return trigger, f"force {largest:.3f} N, ceiling {ceiling:g} N"
        torque = float(np.linalg.norm(wrenches[:, self._torques], axis=1).max())
        if limits.torque_ceiling_nm is not None and torque >= limits.torque_ceiling_nm:
            return Trigger.TORQUE_CEILING, f"torque {torque:.4f} N m, ceiling {limits.torque_ceiling_nm:g} N m"
        return None

    def _delayed(self, t_ns: int, device_ns: int) -> int:
        """Return the delay of a sample beyond the least delay of the last second or two [ns]."""
        offset = t_ns - device_ns
        if not self._offsets or t_ns - self._offsets[-1][0] > DELAY_WINDOW_NS:
            self._offsets.append((t_ns, offset))
        elif offset < self._offsets[-1][1]:
            self._offsets[-1] = (self._offsets[-1][0], offset)
        return offset - min(least for _, least in self._offsets)


def _unknown(wrenches: FloatArray, block: Block) -> Problem | None:
    if not np.isfinite(wrenches).all():
        return Trigger.FORCE_NOT_A_NUMBER, "a sample of the force sensor is not a number"
    marks = 0 if block.quality is None else int(np.bitwise_or.reduce(block.quality, axis=None))
    if marks & Quality.SATURATED:
        return Trigger.FORCE_SATURATED, "the force sensor reports a force at the end of its range"
    if marks & (Quality.MISSING | Quality.SUSPECT):
        return Trigger.FORCE_FLAGGED, "a sample of the force sensor is flagged as missing or suspect"
    return None
