"""Between the thread that reads a device and the one that writes: a bounded queue, and a counted loss."""

from __future__ import annotations

import math
import threading
from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np

from tactbench.core.errors import RigError
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.sensor import StreamSpec

MOST_BYTES = 16 << 20
"""Of one queue, whatever the rate is said to be (assumed: 5 s of 64 channels of int16 at 5 kHz with their marks, stamps
and numbers are 5.4 MB)."""
_COLUMNS = ("t_ns", "data", "quality", "sequence", "device_ns")


class BlockQueue:
    """Rows of one stream, first in, first out.

    :meth:`put` never waits for room: a block that does not fit is dropped whole, its rows are counted in
    :attr:`dropped`, and the next row that gets in is marked with :attr:`~tactbench.core.samples.Quality.GAP`. So the
    newest are lost, and what is kept has no holes but the marked ones. One thread puts, another takes.

    Parameters
    ----------
    stream
        Its rate decides how many rows there is room for; without a rate, :data:`MOST_BYTES` does.
    seconds
        Of data there is room for.

    Attributes
    ----------
    rows
        Now in it.
    dropped
        Rows that did not fit so far.
    """

    def __init__(self, stream: StreamSpec, seconds: float) -> None:
        self.rows = self.dropped = 0
        self._room = math.inf if stream.rate_hz is None else math.ceil(stream.rate_hz * seconds)
        self._blocks: deque[Block] = deque()
        self._layout: dict[str, Any] = {}
        self._mark_next = False
        self._lock = threading.Lock()

    def put(self, block: Block) -> None:
        """Add the rows of `block`, or drop all of them.

        Raises
        ------
        RigError
            If the block has other columns, channels or types than the first one, or columns of several lengths.
        """
        n = len(block.data)
        if block.quality is None:
            block = replace(block, quality=np.zeros(block.data.shape, dtype=np.uint8))
        columns = {name: np.asarray(values) for name in _COLUMNS if (values := getattr(block, name)) is not None}
        layout = {name: (str(values.dtype), *values.shape[1:]) for name, values in columns.items()}
        with self._lock:
            if not self._layout:
                self._layout = layout
                row_bytes = sum(values.dtype.itemsize * math.prod(values.shape[1:]) for values in columns.values())
                self._room = min(self._room, MOST_BYTES // row_bytes)
            if layout != self._layout or any(len(values) != n for values in columns.values()):
                raise RigError(
                    f"A block of stream {block.stream!r} with {n} rows has {layout}, the first one had {self._layout}.",
                    hint="Correct the driver: all blocks of a stream have the same columns, and one of each a row.",
                )
            if self.rows + n > self._room:
                self._lose(n)
            elif n:
                if self._mark_next:
                    quality = columns["quality"].copy()
                    quality[0] |= np.uint8(Quality.GAP)
                    block, self._mark_next = replace(block, quality=quality), False
                self._blocks.append(block)
                self.rows += n

    def take(self, most: int) -> Block | None:
        """Remove and return the oldest rows as one block, at most `most`; None if there are none."""
        found: list[Block] = []
        with self._lock:
            while most and self._blocks:
                block = self._blocks.popleft()
                if len(block.data) > most:
                    self._blocks.appendleft(block.rows(slice(most, None)))
                    block = block.rows(slice(most))
                most -= len(block.data)
                self.rows -= len(block.data)
                found.append(block)
        if not found:
            return None
        whole = found[0]
        columns = {name: [getattr(one, name) for one in found] for name in _COLUMNS if name in self._layout}
        joined: dict[str, Any] = {name: np.concatenate(parts) for name, parts in columns.items()}
        if not joined["quality"].any():
            joined["quality"] = None
        return replace(whole, **joined)

    def discard(self) -> None:
        """Drop what is in it: nobody will take it."""
        with self._lock:
            self._lose(self.rows)
            self._blocks.clear()
            self.rows = 0

    def _lose(self, rows: int) -> None:
        self.dropped += rows
        self._mark_next |= rows > 0
