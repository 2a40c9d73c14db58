"""Between the thread that reads a device and the one that writes: a bounded queue, and a counted loss."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import RigError
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.sensor import StreamSpec

MOST_BYTES = 16 << 20
"""Of one queue, whatever the rate is said to be (assumed: 5 s of 64 channels of int16 at 5 kHz with their marks, stamps
and numbers are 5.4 MB)."""


@dataclass(frozen=True)
class Loss:
    """Rows of one stream that were not written because writing was behind."""

    rows: int = 0
    blocks: int = 0
    first_sequence: int | None = None
    """The least of their own numbers; None where they have none."""
    last_sequence: int | None = None
    """The greatest; rows between the two may have been written."""


class BlockQueue:
    """Rows of one stream, first in, first out, in memory that is allocated once, with the first block.

    :meth:`put` never waits for room: a block that does not fit is dropped whole, its rows are counted in :attr:`loss`,
    and the next row that gets in is marked with :attr:`~tactbench.core.samples.Quality.GAP`. So the newest are lost,
    and what is kept has no holes but the marked ones. One thread puts, another takes.

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
    high_water
        The most rows that were ever in it.
    loss
        What was dropped so far.
    """

    def __init__(self, stream: StreamSpec, seconds: float) -> None:
        self.rows = 0
        self.high_water = 0
        self.loss = Loss()
        self._stream = stream
        self._seconds = seconds
        self._room = 0
        self._first = 0
        self._columns: dict[str, npt.NDArray[Any]] = {}
        self._mark_next = False
        self._lock = threading.Lock()

    def put(self, block: Block) -> None:
        """Add the rows of `block`, or drop all of them.

        Raises
        ------
        RigError
            If the block has other columns, channels or types than the first one.
        """
        columns = _columns(block)
        n = len(block.data)
        with self._lock:
            if not self._columns:
                self._allocate(columns)
            if _layout(columns) != _layout(self._columns) or any(len(values) != n for values in columns.values()):
                has, had = ({name: str(values.dtype) for name, values in c.items()} for c in (columns, self._columns))
                raise RigError(
                    f"A block of stream {block.stream!r} with {n} rows has {has}, which does not fit the first: {had}.",
                    hint="Correct the driver: all blocks of a stream have the same columns, and one of each a row.",
                )
            if self.rows + n > self._room:
                self._lose(n, block.sequence)
                return
            where = self._places(self.rows, n)
            for name, values in columns.items():
                self._columns[name][where] = values
            if self._mark_next and n:
                self._columns["quality"][where[0]] |= np.uint8(Quality.GAP)
                self._mark_next = False
            self.rows += n
            self.high_water = max(self.high_water, self.rows)

    def take(self, most: int) -> Block | None:
        """Remove and return the oldest rows as one block, at most `most`; None if there are none."""
        with self._lock:
            n = min(most, self.rows)
            if not n:
                return None
            where = self._places(0, n)
            columns = {name: values[where] for name, values in self._columns.items()}
            self._first = (self._first + n) % self._room
            self.rows -= n
        return Block(
            stream=self._stream.name,
            t_ns=columns.get("t_ns"),
            data=columns["data"],
            quality=columns["quality"] if columns["quality"].any() else None,
            sequence=columns.get("sequence"),
            device_ns=columns.get("device_ns"),
        )

    def discard(self) -> None:
        """Drop what is in it: nobody will take it."""
        with self._lock:
            if self.rows:
                numbers = self._columns.get("sequence")
                self._lose(self.rows, None if numbers is None else numbers[self._places(0, self.rows)])
                self.rows = 0

    def _allocate(self, columns: dict[str, npt.NDArray[Any]]) -> None:
        row_bytes = sum(values.dtype.itemsize * math.prod(values.shape[1:]) for values in columns.values())
        self._room = MOST_BYTES // row_bytes
        if self._stream.rate_hz is not None:
            self._room = min(self._room, math.ceil(self._stream.rate_hz * self._seconds))
        self._columns = {
            name: np.empty((self._room, *values.shape[1:]), dtype=values.dtype) for name, values in columns.items()
        }

    def _places(self, skipped: int, n: int) -> npt.NDArray[np.intp]:
        """Return where the `n` rows after the first `skipped` are, or go."""
        return (self._first + skipped + np.arange(n)) % self._room

    def _lose(self, rows: int, numbers: npt.NDArray[np.int64] | None) -> None:
        lost = [] if numbers is None else [int(numbers[0]), int(numbers[-1])]
        lost += [end for end in (self.loss.first_sequence, self.loss.last_sequence) if end is not None]
        self.loss = Loss(
            rows=self.loss.rows + rows,
            blocks=self.loss.blocks + 1,
            first_sequence=min(lost, default=None),
            last_sequence=max(lost, default=None),
        )
        self._mark_next = True


def _columns(block: Block) -> dict[str, npt.NDArray[Any]]:
    """Return the columns that a block has, and its marks in any case."""
    quality = np.zeros(block.data.shape, dtype=np.uint8) if block.quality is None else block.quality
    stamps = {"t_ns": block.t_ns, "sequence": block.sequence, "device_ns": block.device_ns}
    found = {"data": block.data, "quality": quality}
    return found | {name: np.asarray(values, np.int64) for name, values in stamps.items() if values is not None}


def _layout(columns: dict[str, npt.NDArray[Any]]) -> dict[str, tuple[Any, ...]]:
    return {name: (values.dtype, *values.shape[1:]) for name, values in columns.items()}
