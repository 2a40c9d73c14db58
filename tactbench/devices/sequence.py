"""Counters of devices: unwrapped after an overflow, and checked for lost, duplicated or late rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tactbench.core.samples import Block, IntArray, Quality

RESTARTED = 20
"""Number of successive rows with rising numbers below the highest number, after which a counter counts as restarted
(assumed: a network holds back fewer datagrams in order)."""


class Unwrap:
    """Conversion of a device's counter of `bits` bits to numbers without overflow.

    The difference d from the highest count so far, modulo 2^bits, classifies a count: 0 is a duplicate, 1 the next one,
    up to 2^(bits-1) - 1 one after a gap of d - 1, above that a late one (derived: half of the range each way; for 32
    bits the same as pyNetFT's sequence.cpp). A late row gets its own number, and the highest stays. The counter must
    not advance by more than half a wrap between two counts: 32 bits at 7 kHz take 85 hours for that.
    """

    def __init__(self, bits: int) -> None:
        self._modulus = 1 << bits
        self._highest: int | None = None

    def __call__(self, counts: npt.ArrayLike) -> IntArray:
        """Return (n,) int64 numbers for (n,) `counts` in the order of receipt; the first number equals its count."""
        now = np.asarray(counts).astype(np.int64) % self._modulus
        for place, count in enumerate(now.tolist()):
            highest = count if self._highest is None else self._highest
            step = (count - highest) % self._modulus
            late = step >= self._modulus // 2
            now[place] = highest + step - late * self._modulus
            self._highest = highest if late else highest + step
        return now


class SequenceCheck:
    """Filter of one stream's rows by their numbers: drops duplicated and late rows, and marks the row after a gap.

    The counter of a device that was restarted begins again: after `RESTARTED` rows that seemed late, which are lost,
    numbers continue from the highest one, with a gap of one row or more.

    A stream without numbers passes unchanged. Its gaps are not guessed from its times: an interval of more than 1.5
    periods is as often due to a late host as to a lost row.

    Attributes
    ----------
    received
        Number of rows received.
    duplicates, late
        Number of dropped rows with the highest number so far, and with a lower number.
    gaps
        Number of rows missing at their place, including rows that came late.
    """

    def __init__(self) -> None:
        self.received = self.duplicates = self.late = self.gaps = 0
        self._highest: int | None = None
        self._shift, self._behind = 0, (0, 0)

    def __call__(self, block: Block) -> Block | None:
        """Return the block without dropped rows, with rows after a gap marked in all channels; None: no row is left."""
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
        """Return numbers that continue from the highest number after the device's counter has restarted."""
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
                    # The rows before were counted as late, which are among gaps: they are lost.
                    self.gaps += 2 * (RESTARTED - 1)
            elif number + added > highest:
                self._behind = (0, 0)
            numbers[place] += added
            highest = max(highest, number + added)
        self._shift += added
        return numbers
