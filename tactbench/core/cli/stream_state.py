"""What is known of a recording that is being made: of each stream its last sample, level, rate and losses."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tactbench.core.samples import Block, Quality

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray
    from tactbench.core.spec.scene import Scene
    from tactbench.core.spec.sensor import StreamSpec

LEVEL_S = 0.5
"""Seconds from a stream's first sample whose mean is its channels' level."""
RATE_S = 2.0
"""Seconds over which a rate is measured."""
COUNTED = (Quality.GAP, Quality.MISSING, Quality.SUSPECT, Quality.SATURATED)


class StreamState:
    """What is known of one stream so far.

    One thread calls :meth:`take`; another may read the attributes meanwhile: each is replaced as a whole, none is
    changed in place.
    """

    def __init__(self, spec: StreamSpec) -> None:
        self.spec = spec
        self.rows = 0
        self.latest: FloatArray | None = None
        """(channels,) the last sample of each that was not MISSING; NaN where there was none."""
        self.quality: Any = None
        """(channels,) of the last sample."""
        self.level: FloatArray | None = None
        """(channels,) mean over the first :data:`LEVEL_S` seconds."""
        self.largest: FloatArray | None = None
        """(channels,) largest distance from the level among the last samples of all blocks."""
        self.rate_hz: float | None = None
        """Over the last :data:`RATE_S` seconds, or over the last block if that is longer."""
        self.first_ns: int | None = None
        self.last_ns: int | None = None
        self.seen_s: float | None = None
        """When the last block came [s of `time.monotonic`]."""
        self.counts = dict.fromkeys(COUNTED, 0)
        """Rows with a sample that has the mark."""
        self.lost = 0
        """Rows that never came, by the device's numbers."""
        self._first_number: int | None = None
        self._levelled = False
        self._sums: tuple[Any, Any] = (0.0, 0)
        self._ends: deque[tuple[int, int]] = deque()

    def take(self, block: Block) -> None:
        """Remember what the block says: its last row, and counts over its rows."""
        import numpy as np

        if not len(block.data):
            return
        self._take_times(block)
        row = np.array(block.data[-1], dtype=float)
        if block.quality is not None:
            marks = np.bitwise_or.reduce(block.quality, axis=1)
            self.counts = {flag: self.counts[flag] + int(np.count_nonzero(marks & flag)) for flag in COUNTED}
            before = np.full(len(row), np.nan) if self.latest is None else self.latest
            row = np.where(block.quality[-1] & Quality.MISSING, before, row)
            self.quality = block.quality[-1].copy()
        if not self._levelled:
            self._take_level(block)
        self.latest = row
        if self.level is not None:
            distance = np.abs(row - self.level)
            self.largest = distance if self.largest is None else np.fmax(self.largest, distance)
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
        while len(self._ends) > 2 and self.last_ns - self._ends[1][0] >= RATE_S * 1e9:
            self._ends.popleft()
        began_ns, began_rows = self._ends[0]
        if self.last_ns > began_ns:
            self.rate_hz = (self.rows - began_rows) / (self.last_ns - began_ns) * 1e9

    def _take_level(self, block: Block) -> None:
        """Add rows of the first half second to the level; without times the first block is it."""
        import numpy as np

        rows = len(block.data)
        if block.t_ns is not None and self.first_ns is not None:
            rows = int(np.searchsorted(block.t_ns, self.first_ns + LEVEL_S * 1e9, side="right"))
        values = np.array(block.data[:rows], dtype=float)
        if block.quality is not None:
            values[(block.quality[:rows] & Quality.MISSING) != 0] = np.nan
        there = ~np.isnan(values)
        total, number = self._sums
        self._sums = total, number = total + np.where(there, values, 0.0).sum(axis=0), number + there.sum(axis=0)
        self.level = np.where(number > 0, total / np.maximum(number, 1), np.nan)
        self._levelled = rows < len(block.data) or block.t_ns is None


@dataclass(frozen=True)
class Watched:
    """A recording that is being made."""

    title: str
    scene: Scene
    sensor: tuple[StreamState, ...]
    reference: tuple[StreamState, ...]

    @property
    def streams(self) -> tuple[StreamState, ...]:
        """All of them."""
        return self.sensor + self.reference

    @property
    def elapsed_s(self) -> float | None:
        """Seconds from the first sample to the last one, by the samples' times; None: no times yet."""
        firsts = [state.first_ns for state in self.streams if state.first_ns is not None]
        lasts = [state.last_ns for state in self.streams if state.last_ns is not None]
        return (max(lasts) - min(firsts)) * 1e-9 if firsts and lasts else None

    @property
    def duration_s(self) -> float:
        """Seconds the scene lasts."""
        return self.scene.profile.duration.to("s")

    @property
    def setpoint_n(self) -> float | None:
        """Force of the scene's profile at this time [N]; None: no time yet."""
        import numpy as np

        elapsed_s = self.elapsed_s
        return None if elapsed_s is None else float(np.interp(elapsed_s, *self.scene.profile.corners))

    def force(self) -> tuple[StreamState, int] | None:
        """Return the stream and the place of the reference force: `normal` or `fz`, else the first of its kind."""
        found = [
            (state, place)
            for state in self.reference
            for place, channel in enumerate(state.spec.channels)
            if channel.kind == "force"
        ]
        named = [one for one in found if one[0].spec.channels[one[1]].name in ("normal", "fz")]
        return next(iter(named + found), None)
