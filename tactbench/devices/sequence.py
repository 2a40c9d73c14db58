"""Counters of devices: counted on over their wraps, and what they say of rows lost, doubled or late."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import UsageError
from tactbench.core.samples import Block, IntArray, Quality


class Unwrap:
    """A counter of `bits` bits, counted on over its wraps.

    The difference d from the highest count so far, modulo 2^bits, says what a count is: 0 a duplicate, 1 the next one,
    up to 2^(bits-1) - 1 one after a gap of d - 1, above that a late one (derived: half of the range each way; for 32
    bits the same as pyNetFT's sequence.cpp). A late one gets the number it has, and the highest stays.

    Nothing of this holds once the counter may have advanced by more than half a wrap unseen. With `rate_hz`, a longer
    time since the last count is a break: the counts go on with the least number above the highest that ends in the
    same bits. By how many wraps more it has advanced is not known.

    Parameters
    ----------
    bits
        Of the counter: 2 to 62.
    rate_hz
        Counts a second, as fast as it may go; None: breaks are not looked for.

    Attributes
    ----------
    breaks
        How often the host saw nothing for more than half a wrap, or :meth:`restart` was called after the first count.

    Raises
    ------
    UsageError
        If `bits` or `rate_hz` is out of range.
    """

    def __init__(self, bits: int, rate_hz: float | None = None) -> None:
        if not 2 <= bits <= 62:
            raise UsageError(f"A counter of {bits} bits was given.", hint="Give 2 to 62 bits.")
        if rate_hz is not None and not rate_hz > 0:
            raise UsageError(f"A counter's rate of {rate_hz} Hz is not positive.", hint="Give counts per second.")
        self.breaks = 0
        self._modulus = 1 << bits
        self._longest_ns = math.inf if rate_hz is None else 1e9 * self._modulus / 2 / rate_hz
        self._highest: int | None = None
        self._seen_ns: int | None = None
        self._restarted = False

    @property
    def wraps(self) -> int:
        """How often the counter began anew, over the breaks at least."""
        return 0 if self._highest is None else self._highest // self._modulus

    def restart(self) -> None:
        """Take the next count as one after a break: the device was started anew."""
        self._restarted = self._highest is not None

    def __call__(self, counts: npt.ArrayLike, t_ns: npt.ArrayLike | None = None) -> IntArray:
        """Return the numbers of `counts`, in the order in which they came.

        Parameters
        ----------
        counts
            (n,) as the device sent them.
        t_ns
            (n,) or one for all: when they were received, nanoseconds; needed to find breaks.

        Returns
        -------
        (n,) int64. The first of all is its own number; in order, the next is one more.

        Raises
        ------
        UsageError
            If `rate_hz` was given and there are no times.
        """
        if t_ns is None and self._longest_ns < math.inf:
            raise UsageError("Breaks of a counter are found by time, and none came.", hint="Give t_ns, or no rate_hz.")
        now = np.asarray(counts).astype(np.int64)
        if not len(now):
            return now
        now %= self._modulus
        times = np.asarray(0 if t_ns is None else t_ns, dtype=np.int64)
        highest = int(now[0]) if self._highest is None else self._highest
        seen_ns = int(times.flat[0]) if self._seen_ns is None else self._seen_ns
        restarted, self._restarted = self._restarted, False
        if len(now) == 1:  # drivers give a row or two a millisecond, of which numpy takes longer than one by one
            return self._with_late(now, [times.item()], highest, seen_ns, restarted=restarted)
        times = np.broadcast_to(times, now.shape)
        steps = _steps(highest, now) % self._modulus
        broken = _steps(seen_ns, times) > self._longest_ns
        broken[0] |= restarted
        if np.all((steps < self._modulus // 2) | broken):
            numbers = highest + np.cumsum(np.where(broken & (steps == 0), self._modulus, steps))
            self.breaks += int(np.count_nonzero(broken))
            self._highest, self._seen_ns = int(numbers[-1]), int(times[-1])
            return numbers
        return self._with_late(now, times.tolist(), highest, seen_ns, restarted=restarted)

    def _with_late(
        self, counts: IntArray, times: list[int], highest: int, seen_ns: int, *, restarted: bool
    ) -> IntArray:
        """Return the numbers one by one: after a late count, differences are from the highest, not from it."""
        numbers = np.empty_like(counts)
        for k, (count, t_ns) in enumerate(zip(counts.tolist(), times, strict=True)):
            step = (count - highest) % self._modulus
            if (restarted and k == 0) or t_ns - seen_ns > self._longest_ns:
                self.breaks += 1
                step = step or self._modulus
            elif step >= self._modulus // 2:
                numbers[k] = highest + step - self._modulus
                continue
            highest, seen_ns = highest + step, t_ns
            numbers[k] = highest
        self._highest, self._seen_ns = highest, seen_ns
        return numbers


def _steps(before: int, values: IntArray) -> IntArray:
    """Return the difference of each value from the one before it."""
    steps = values.copy()
    steps[0] -= before
    steps[1:] -= values[:-1]
    return steps


class SequenceCheck:
    """What the numbers of one stream's rows say: duplicates and late rows are kept out, the row after a gap is marked.

    A stream without numbers passes as it is. Its gaps are not guessed from its times: an interval of more than 1.5
    periods is as often a late host as a lost row, and only the fitted clocks can tell.

    Attributes
    ----------
    received
        Rows that came, whatever became of them.
    duplicates
        Rows kept out that had the highest number so far.
    late
        Rows kept out that had a lower one.
    gaps
        Rows that were missing where they were due; late ones are among them.
    """

    def __init__(self) -> None:
        self.received = 0
        self.duplicates = 0
        self.late = 0
        self.gaps = 0
        self._highest: int | None = None

    def __call__(self, block: Block) -> Block | None:
        """Return `block` with the rows that are passed on, all channels of those after a gap marked; None without."""
        self.received += len(block.data)
        if not len(block.data):
            return None
        numbers = block.sequence
        if numbers is None:
            return block
        before = int(numbers[0]) - 1 if self._highest is None else self._highest
        if len(numbers) == 1 and numbers[0] == before + 1:
            self._highest = before + 1
            return block
        ahead = np.maximum.accumulate(np.concatenate(([before], numbers)))
        lost = numbers - ahead[:-1] - 1
        self._highest = int(ahead[-1])
        if not lost.any():
            return block
        self.duplicates += int(np.count_nonzero(lost == -1))
        self.late += int(np.count_nonzero(lost < -1))
        self.gaps += int(lost[lost > 0].sum())
        quality = np.zeros(block.data.shape, dtype=np.uint8) if block.quality is None else block.quality.copy()
        quality[lost > 0] |= np.uint8(Quality.GAP)
        kept = lost >= 0
        if not kept.any():
            return None
        return replace(
            block,
            t_ns=None if block.t_ns is None else block.t_ns[kept],
            data=block.data[kept],
            quality=quality[kept],
            sequence=numbers[kept],
            device_ns=None if block.device_ns is None else block.device_ns[kept],
        )
