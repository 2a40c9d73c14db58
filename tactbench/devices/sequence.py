"""Counters of devices: counted on over their wraps, and what they say of rows lost, doubled or late."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tactbench.core.samples import Block, IntArray, Quality

RESTARTED = 20
"""Rows behind the highest number, each one above the one before, after which a counter has begun anew (assumed: a
network holds back fewer datagrams in order)."""


class Unwrap:
    """A counter of `bits` bits, counted on over its wraps.

    The difference d from the highest count so far, modulo 2^bits, says what a count is: 0 a duplicate, 1 the next one,
    up to 2^(bits-1) - 1 one after a gap of d - 1, above that a late one (derived: half of the range each way; for 32
    bits the same as pyNetFT's sequence.cpp). A late one gets the number it has, and the highest stays. Nothing of this
    holds once the counter may have advanced by more than half a wrap unseen: 32 bits at 7 kHz take 85 hours for that.
    """

    def __init__(self, bits: int) -> None:
        self._modulus = 1 << bits
        self._highest: int | None = None

    def __call__(self, counts: npt.ArrayLike) -> IntArray:
        """Return (n,) int64 numbers of (n,) `counts`, in the order in which they came; the first is its own number."""
        now = np.asarray(counts).astype(np.int64) % self._modulus
        for place, count in enumerate(now.tolist()):
            highest = count if self._highest is None else self._highest
            step = (count - highest) % self._modulus
            late = step >= self._modulus // 2
            now[place] = highest + step - late * self._modulus
            self._highest = highest if late else highest + step
        return now


class SequenceCheck:
    """What the numbers of one stream's rows say: duplicates and late rows are kept out, the row after a gap is marked.

    A device that was started anew counts from its beginning: after `RESTARTED` rows that seemed late, which are lost,
    numbers go on from the highest one, with a gap of one row or more.

    A stream without numbers passes as it is. Its gaps are not guessed from its times: an interval of more than 1.5
    periods is as often a late host as a lost row, and only the fitted clocks can tell.

    Attributes
    ----------
    received
        Rows that came, whatever became of them.
    duplicates, late
        Rows kept out that had the highest number so far, or a lower one.
    gaps
        Rows that were missing where they were due; late ones are among them.
    """

    def __init__(self) -> None:
        self.received = self.duplicates = self.late = self.gaps = 0
        self._highest: int | None = None
        self._shift, self._behind = 0, (0, 0)

    def __call__(self, block: Block) -> Block | None:
        """Return `block` with the rows that are passed on, all channels of those after a gap marked; None without."""
        self.received += len(block.data)
        if block.sequence is None or not len(block.sequence):
            return block if len(block.data) else None
        numbers = self._counted_on(block.sequence)
        if self._shift:
            block = replace(block, sequence=numbers)
        before = int(numbers[0]) - 1 if self._highest is None else self._highest
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
        kept = replace(block, quality=quality).rows(lost >= 0)
        return kept if len(kept.data) else None

    def _counted_on(self, numbers: IntArray) -> IntArray:
        """Return numbers that go on where the device's counter has begun anew."""
        numbers = numbers + self._shift
        highest = int(numbers[0]) - 1 if self._highest is None else self._highest
        if numbers[0] > highest and (np.diff(numbers) > 0).all():
            self._behind = (0, 0)
            return numbers
        added = 0
        for place, number in enumerate(numbers.tolist()):
            last, rows = self._behind
            if number + added < highest:
                self._behind = (number, rows + 1 if number == last + 1 else 1)
                if self._behind[1] == RESTARTED:
                    added = highest + 2 - number
                    # Those before were counted as late, which stands for rows that were gaps before: they are lost.
                    self.gaps += 2 * (RESTARTED - 1)
            elif number + added > highest:
                self._behind = (0, 0)
            numbers[place] += added
            highest = max(highest, number + added)
        self._shift += added
        return numbers
