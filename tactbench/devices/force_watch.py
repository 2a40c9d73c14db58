"""Problems of a stream of forces: too large, not known, or too old. It has no input or output, and no clock.

An unknown force counts as too large a force.
"""

from __future__ import annotations

import math
from collections import deque
from statistics import fmean

import numpy as np

from tactbench.core.samples import Block, FloatArray, Quality
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.guard_messages import Limits, Trigger
from tactbench.devices.sequence import SequenceCheck

DELAY_WINDOW_NS = 1_000_000_000
"""Half of the time over which the least delay of a device's samples is taken (assumed: clocks that differ by 100 ppm
move apart by 0.2 ms in the whole)."""
MOST_BLOCKS = 50_000
"""Most blocks that wait for a rig: some 50 s at 1 kHz; then the oldest are dropped."""
_LOOKED_AT = 3
"""Number of samples of which two make a touch."""
_MOST_SOUND = 10_000
"""Most samples of a mean: more than a second of the quickest force sensor, 7 kHz."""
UNRATED_HZ = 100.0
"""Rate of a force sensor that states none (assumed: a slow one)."""


def samples(stream: StreamSpec, seconds: float) -> int:
    """Return the number of samples of a force stream in some seconds; one at least.

    A mean is taken over a number, not over a time: a busy host receives none for a while, and then many at once.
    """
    return max(1, round((stream.rate_hz or UNRATED_HZ) * seconds))


Problem = tuple[Trigger, str]


class ForceWatch:
    """Check of the samples of one force stream.

    The age of a sample is the time since its receipt and, where the device has a clock of its own, its delay on the way
    beyond the least of the last second or two: a stream that is held up on its way is old although samples arrive. A
    constant delay cannot be seen. Only the ceilings and unknown values are checked of a sample that is doubled or late:
    it makes no touch and no age.

    Parameters
    ----------
    stream
        The stream; its channels of kind ``force`` and ``torque`` are checked.

    Attributes
    ----------
    blocks
        Samples that are newer than each one before, for the rig.
    order
        Order and losses of the samples by their numbers.
    force_n
        Pressing force, less the zero, of the newest sample; NaN: none yet, or no limits.
    sequence, t_ns
        Number and time of receipt of that sample; -1 and 0: none yet.
    changed
        Number of the newest sample that differs from the one before it in any channel; -1: none yet.
    received
        Number of samples so far.
    """

    def __init__(self, stream: StreamSpec) -> None:
        kinds = np.array([channel.kind for channel in stream.channels])
        self._forces, self._torques = kinds == "force", kinds == "torque"
        self.blocks: deque[Block] = deque(maxlen=MOST_BLOCKS)
        self.order = SequenceCheck()
        self.force_n = math.nan
        self.sequence, self.t_ns, self.changed, self.received = -1, 0, -1, 0
        self._delay_ns = 0
        self._offsets: deque[tuple[int, int]] = deque(maxlen=2)
        self._last = np.full((1, kinds.size), math.nan)
        self._same = 0
        self._pressing: deque[float] = deque(maxlen=_LOOKED_AT)
        self._sound: deque[tuple[int, float]] = deque(maxlen=_MOST_SOUND)

    def touched(self, touch_n: float) -> bool:
        """Return whether two of the last three samples are above a force [N]."""
        return sum(force > touch_n for force in self._pressing) >= _LOOKED_AT - 1

    def mean_n(self, since_ns: int, count: int) -> float:
        """Return the mean pressing force [N] of the newest `count` samples, all of them received after a time.

        NaN: fewer were received since, or one of them had a problem.
        """
        while self._sound and (self._sound[0][0] < since_ns or len(self._sound) > count):
            self._sound.popleft()
        return fmean(force_n for _, force_n in self._sound) if len(self._sound) == count else math.nan

    def age_s(self, now_ns: int) -> float:
        """Return the age of the newest sample [s]; infinite: there is none."""
        return 1e-9 * (now_ns - self.t_ns + self._delay_ns) if self.received else math.inf

    def old(self, now_ns: int, limits: Limits) -> Problem | None:
        """Return the problem of a newest sample that is too old; None: it is not."""
        age_s = self.age_s(now_ns)
        if age_s <= limits.force_age_s:
            return None
        return Trigger.FORCE_OLD, f"the newest force is {1e3 * age_s:.1f} ms old, {1e3 * limits.force_age_s:.1f} may be"

    def take(self, block: Block, limits: Limits | None, *, travelling: bool = False) -> Problem | None:
        """Take samples; return their first problem.

        Parameters
        ----------
        block
            The samples received.
        limits
            The limits; None: only numbers, times and equal samples are updated.
        travelling
            Whether the ceiling of travel applies.
        """
        newer = self.order(block)
        lost, same = (0, self._same) if newer is None else self._take_newer(newer)
        if limits is None or not len(block.data):
            return None
        zero = np.array(limits.zero)
        if newer is not None:
            self._pressing.extend(limits.pressing_n(newer.data[-_LOOKED_AT:]).tolist())
            self.force_n = self._pressing[-1]
        wrenches = block.data - zero
        problem = _unknown(wrenches, block) or self._too_large(wrenches, limits, travelling)
        if problem is None and lost > limits.lost_samples:
            problem = Trigger.FORCE_GAP, f"{lost} force samples were lost in a row, {limits.lost_samples} may be"
        if problem is None and same >= limits.same_samples:
            problem = Trigger.FORCE_STUCK, f"{same} force samples in a row are the same in every channel"
        if problem is not None:
            self._sound.clear()
        elif newer is not None and newer.t_ns is not None:
            self._sound.extend(zip(newer.t_ns.tolist(), limits.pressing_n(newer.data).tolist(), strict=True))
        return problem

    def _take_newer(self, block: Block) -> tuple[int, int]:
        """Update numbers and times; return the most samples lost in a row, and the most equal ones."""
        self.blocks.append(block)
        rows = block.data
        numbers = self.sequence + 1 + np.arange(len(rows)) if block.sequence is None else block.sequence
        lost = int(np.diff(numbers, prepend=self.sequence if self.received else numbers[0] - 1).max()) - 1
        longest = 0
        repeats = (rows == np.concatenate((self._last, rows[:-1]))).all(axis=1)
        for number, repeated in zip(numbers.tolist(), repeats.tolist(), strict=True):
            if not repeated:
                self.changed, self._same = number, 0
            self._same += 1
            longest = max(longest, self._same)
        self._last = rows[-1:]
        self.received += len(rows)
        self.sequence = int(numbers[-1])
        self.t_ns = 0 if block.t_ns is None else int(block.t_ns[-1])
        if block.device_ns is not None:
            self._delay_ns = self._delayed(self.t_ns, int(block.device_ns[-1]))
        return lost, longest

    def _too_large(self, wrenches: FloatArray, limits: Limits, travelling: bool) -> Problem | None:
        largest = float(np.linalg.norm(wrenches[:, self._forces], axis=1).max())
        ceiling = limits.travel_ceiling_n if travelling else limits.force_ceiling_n
        if largest >= ceiling:
            trigger = Trigger.TRAVEL_CEILING if travelling else Trigger.FORCE_CEILING
            return trigger, f"{largest:.3f} N, the ceiling is {ceiling:g} N"
        torque = float(np.linalg.norm(wrenches[:, self._torques], axis=1).max())
        if limits.torque_ceiling_nm is not None and torque >= limits.torque_ceiling_nm:
            return Trigger.TORQUE_CEILING, f"{torque:.4f} N m, the ceiling is {limits.torque_ceiling_nm:g} N m"
        return None

    def _delayed(self, t_ns: int, device_ns: int) -> int:
        """Return the delay of a sample beyond the least one of the last time [ns]."""
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
        return Trigger.FORCE_SATURATED, "the force sensor reports an end of its range"
    if marks & (Quality.MISSING | Quality.SUSPECT):
        return Trigger.FORCE_FLAGGED, "a sample of the force sensor is flagged as missing or suspect"
    return None
