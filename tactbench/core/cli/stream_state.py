"""What is known of a stream while its blocks come: last sample, change, rate and losses."""

from __future__ import annotations

import time
from collections import deque
from typing import TYPE_CHECKING

from tactbench.core.samples import Block, Quality

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray
    from tactbench.core.spec.sensor import StreamSpec

COUNTED = (Quality.GAP, Quality.MISSING, Quality.SUSPECT, Quality.SATURATED)


class StreamState:
    """What is known of one stream so far.

    One thread calls :meth:`take`; another may read the attributes meanwhile: each is replaced as a whole, none is
    changed in place.

    Parameters
    ----------
    rate_s
        Seconds over which the rate is measured, the newest ones.
    """

    def __init__(self, spec: StreamSpec, *, rate_s: float) -> None:
        self.spec = spec
        self.rows = 0
        self.first: FloatArray | None = None
        """(channels,) the first sample of each channel; NaN where none came yet."""
        self.latest: FloatArray | None = None
        """(channels,) the last sample of each channel that was not MISSING; NaN where there was none."""
        self.largest: FloatArray | None = None
        """(channels,) largest change from the first sample among the last samples of all blocks."""
        self.wrong: FloatArray | None = None
        """(channels,) marks of quality of the last sample."""
        self.rate_hz: float | None = None
        self.first_ns: int | None = None
        self.last_ns: int | None = None
        self.seen_s: float | None = None
        """When the last block came [s of `time.monotonic`]."""
        self.counts = dict.fromkeys(COUNTED, 0)
        """Rows with a sample that has the mark."""
        self.lost = 0
        """Rows that never came, by the device's numbers."""
        self._rate_ns = rate_s * 1e9
        self._first_number: int | None = None
        self._ends: deque[tuple[int, int]] = deque()

    def take(self, block: Block) -> None:
        """Remember the block's last row, and count over its rows."""
        import numpy as np

        if not len(block.data):
            return
        self._take_times(block)
        values = np.array(block.data[[0, -1]], dtype=float)
        if block.quality is not None:
            values[(block.quality[[0, -1]] & Quality.MISSING) != 0] = np.nan
            marks = np.bitwise_or.reduce(block.quality, axis=1)
            self.counts = {flag: self.counts[flag] + int(np.count_nonzero(marks & flag)) for flag in COUNTED}
            self.wrong = block.quality[-1].copy()
        first, latest = values
        self.first = first if self.first is None else np.where(np.isnan(self.first), first, self.first)
        self.latest = latest if self.latest is None else np.where(np.isnan(latest), self.latest, latest)
        change = np.abs(self.latest - self.first)
        self.largest = change if self.largest is None else np.fmax(self.largest, change)
        self.seen_s = time.monotonic()

    def _take_times(self, block: Block) -> None:
        rows = len(block.data)
        if block.sequence is not None:
            if self._first_number is None:
                self._first_number = int(block.sequence[0]) - self.rows
            self.lost = max(0, int(block.sequence[-1]) - self._first_number + 1 - self.rows - rows)
        self.rows += rows
        if block.t_ns is None:
            return
        if self.first_ns is None:
            self.first_ns = int(block.t_ns[0])
        self.last_ns = int(block.t_ns[-1])
        if not self._ends and self.last_ns > self.first_ns:  # else all of it was received at once
            self._ends.append((self.first_ns, self.rows - rows + 1))
        self._ends.append((self.last_ns, self.rows))
        while len(self._ends) > 2 and self.last_ns - self._ends[1][0] >= self._rate_ns:
            self._ends.popleft()
        began_ns, before = self._ends[0]
        if self.last_ns > began_ns:
            self.rate_hz = (self.rows - before) / (self.last_ns - began_ns) * 1e9
