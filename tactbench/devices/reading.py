"""Several devices read at once: a thread a driver in real time, one after the other in virtual time."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Self

import numpy as np

from tactbench.core.errors import LinkError, RigError, UsageError
from tactbench.core.samples import COLUMNS, Block, Quality, join_blocks
from tactbench.core.spec.recording import StreamCounts
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.driver import Driver, fault_text
from tactbench.devices.sequence import SequenceCheck
from tactbench.links.link import Clock

QUEUE_S = 5.0
"""Of data that a caller may be behind [s]."""
UNRATED_HZ = 10_000.0
"""Taken for the rate of a stream that states none (assumed: above that of any tactile sensor's)."""
BLOCK_S = 0.05
"""Between two blocks of a stream, about [s]; one of a caller who takes them too slowly holds all since."""
READ_S = 0.05
"""Longest wait of one read: after this time at the latest a reader sees that it is to stop."""
STEP_S = 0.02
"""Virtual time between two reads of a device, so that the buffers of its link do not overflow (derived: the usual 256
datagrams of a UDP socket are 37 ms at 7 kHz, the fastest stream of a Net F/T)."""
STOP_S = 5.0
"""How long readers are waited for (assumed: a read, a stop and what they send, each within a link's time-outs)."""


class StreamQueue:
    """One stream on its way from driver to caller: bounded, first in, first out.

    :meth:`put` never waits for room: a block that does not fit is dropped whole, its rows are counted, and the next row
    that gets in is marked with :attr:`~tactbench.core.samples.Quality.GAP`. So the newest are lost, and what is kept
    has no holes but the marked ones. One thread puts, another takes.

    Attributes
    ----------
    check
        What the rows' numbers say.
    came_ns
        When the last block came.
    written, dropped
        Rows that were taken, and that did not fit.
    """

    def __init__(self, device: str, spec: StreamSpec) -> None:
        self.device, self.rated = device, spec.rate_hz is not None
        self.check = SequenceCheck()
        self.came_ns = self.written = self.dropped = 0
        self._rows, self._room = 0, math.ceil(QUEUE_S * (spec.rate_hz or UNRATED_HZ))
        self._blocks: list[Block] = []
        self._layout: dict[str, tuple[int, ...]] = {}
        self._lossy = False
        self._lock = threading.Lock()

    def put(self, block: Block, now_ns: int) -> None:
        """Add what is new of a block; raises RigError if it has other columns than the first one."""
        kept = self.check(block)
        if kept is None:
            return
        self.came_ns, rows = now_ns, len(kept.data)
        kept = replace(kept, quality=np.zeros(kept.data.shape, np.uint8) if kept.quality is None else kept.quality)
        found = {name: column for name in COLUMNS if (column := getattr(kept, name)) is not None}
        layout = {name: column.shape[1:] for name, column in found.items()}
        self._layout = self._layout or layout
        if layout != self._layout or {len(column) for column in found.values()} != {rows}:
            raise RigError(
                f"A block of stream {block.stream!r} with {rows} rows has {layout}, the first one had {self._layout}.",
                hint="Correct the driver: all blocks of a stream have the same columns, and one of each a row.",
            )
        with self._lock:
            if self._rows + rows > self._room:
                self._lose(rows)
                return
            if self._lossy and kept.quality is not None:
                kept = replace(kept, quality=kept.quality.copy())
                kept.quality[0] |= np.uint8(Quality.GAP)  # type: ignore[index]
                self._lossy = False
            self._blocks.append(kept)
            self._rows += rows

    def take(self) -> Iterator[Block]:
        """Remove what is in it and yield it as one block, if there is any."""
        with self._lock:
            found, self._blocks, self._rows = self._blocks, [], 0
        if found:
            joined = join_blocks(found)
            self.written += len(joined.data)
            yield joined if np.any(joined.quality) else replace(joined, quality=None)

    def discard(self) -> None:
        """Drop what is in it: nobody will take it."""
        with self._lock:
            self._lose(self._rows)
            self._blocks, self._rows = [], 0

    def _lose(self, rows: int) -> None:
        self.dropped += rows
        self._lossy |= rows > 0


class Reading:
    """Reads devices from the ``with`` that it stands in: starts them, yields their blocks, stops them. Used once.

    In real time a thread reads each driver and puts its rows into a bounded queue a stream; a caller who takes them too
    slowly loses the newest, which is counted and marked (:class:`StreamQueue`). In virtual time
    there are no threads, and the caller cannot be too slow. The same data of the devices make the same rows in both;
    where blocks begin differs. Rows are passed on as they come: none is trimmed to the duration.

    Drivers are neither opened nor closed here.

    Parameters
    ----------
    drivers
        By the device's name in messages. Their streams have different names.
    clock
        The host's, the same as the drivers'.
    advance
        For virtual time: carries `clock` forward to the given nanosecond, and emulated devices with it. None: real
        time.
    silent_s
        A stream with a rate of which nothing came for longer ends the reading.
    """

    def __init__(
        self,
        drivers: Mapping[str, Driver],
        *,
        clock: Clock,
        advance: Callable[[int], None] | None = None,
        silent_s: float = math.inf,
    ) -> None:
        self._drivers = dict(drivers)
        self._clock = clock
        self._advance = advance
        self._silent_ns = 1e9 * silent_s
        self._streams: dict[str, StreamQueue] = {}
        self._counts: dict[str, Mapping[str, int]] = {name: {} for name in self._drivers}
        self._to_stop: list[str] = []
        self._readers: dict[str, threading.Thread] = {}
        self._over = threading.Event()
        self._lock = threading.Lock()
        self.ended = ""
        """Which device ended the reading, and why, without a full stop; empty: none did."""

    def __enter__(self) -> Self:
        try:
            for name, driver in self._drivers.items():
                self._to_stop.append(name)
                driver.start()
                for spec in driver.streams:
                    if spec.name in self._streams:
                        raise UsageError(
                            f"The stream {spec.name!r} of {name} is there already, of another device.",
                            hint="Streams of one recording have different names.",
                        )
                    self._streams[spec.name] = StreamQueue(name, spec)
                if self._advance is None:
                    # It is read at once: the next device may take longer to start than the link's buffers last.
                    threading.Thread(
                        target=self._read, args=(name, driver), name=f"reading {name}", daemon=True
                    ).start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._finish()
        for stream in self._streams.values():
            stream.discard()

    @property
    def stream_counts(self) -> Mapping[str, StreamCounts]:
        """By stream: what became of its rows.

        After the ``with`` block received = written + dropped + duplicates + late. `written` are those that were
        yielded. `gaps` are rows missing where they were due, late ones among them; a stream without numbers has none.
        """
        return {
            name: StreamCounts(
                received=stream.check.received,
                written=stream.written,
                dropped=stream.dropped,
                duplicates=stream.check.duplicates,
                late=stream.check.late,
                gaps=stream.check.gaps,
            )
            for name, stream in self._streams.items()
        }

    @property
    def counts(self) -> Mapping[str, int]:
        """What the drivers counted, as ``device: name``, once the reading is over."""
        return {f"{name}: {what}": n for name, counts in self._counts.items() for what, n in counts.items()}

    def blocks(self, duration_s: float, is_over: Callable[[], bool] = lambda: False) -> Iterator[Block]:
        """Yield blocks of all streams until the time is over or a device has ended the reading; then stop the devices.

        Parameters
        ----------
        duration_s
            Seconds of the clock from the first block asked for; may be infinite.
        is_over
            Asked at every block's time, whether or not a device has sent anything: true ends the reading too.
        """
        now_ns = began_ns = self._clock()
        end_ns = now_ns + 1e9 * duration_s
        while not (self._over.is_set() or is_over()) and now_ns < end_ns:
            until_ns = int(min(now_ns + round(1e9 * BLOCK_S), end_ns))
            if self._advance is None:
                self._over.wait((until_ns - now_ns) / 1e9)
                now_ns = self._clock()
            else:
                now_ns = self._carry(self._advance, now_ns, until_ns)
            for name, stream in self._streams.items():
                yield from stream.take()
                silent_ns = now_ns - max(began_ns, stream.came_ns)
                if stream.rated and silent_ns > self._silent_ns:
                    self._fail(stream.device, RigError(f"Nothing came of {name} for {1e-9 * silent_ns:.3g} s."))
        self._finish()
        for stream in self._streams.values():
            yield from stream.take()

    def _take_over(self, name: str, driver: Driver, timeout_s: float) -> bool:
        blocks = driver.read(timeout_s)
        for block in blocks:
            if block.stream not in self._streams:
                raise RigError(
                    f"A block of stream {block.stream!r} came, which {name} did not announce.",
                    hint="Correct the driver: its streams are fixed once it is started.",
                )
            self._streams[block.stream].put(block, self._clock())
        return bool(blocks)

    def _carry(self, advance: Callable[[int], None], now_ns: int, until_ns: int) -> int:
        """Carry virtual time forward, and read what the devices send meanwhile; return the time then."""
        while not self._over.is_set() and now_ns < until_ns:
            now_ns = min(now_ns + round(1e9 * STEP_S), until_ns)
            advance(now_ns)
            for name, driver in self._drivers.items():
                try:
                    self._exhaust(name, driver, now_ns)
                except Exception as error:
                    self._fail(name, error)
            now_ns = max(now_ns, self._clock())
        return now_ns

    def _exhaust(self, name: str, driver: Driver, until_ns: int) -> None:
        """Read until nothing comes, or until the clock is past: a driver that asks its device takes time itself."""
        while self._take_over(name, driver, 0.0) and self._clock() <= until_ns:
            pass

    def _read(self, name: str, driver: Driver) -> None:
        """Read one driver until the reading is over, then stop it: one thread does both."""
        with self._lock:
            if self._over.is_set():
                return
            self._to_stop.remove(name)
            self._readers[name] = threading.current_thread()
        try:
            while not self._over.is_set():
                self._take_over(name, driver, READ_S)
            self._exhaust(name, driver, self._clock() + round(1e9 * READ_S))
        except Exception as error:
            self._fail(name, error)
        self._stop(name, driver)

    def _stop(self, name: str, driver: Driver) -> None:
        try:
            with suppress(LinkError):
                driver.stop()
            self._counts[name] = dict(driver.counts)
        except Exception as error:
            self._fail(name, error)

    def _fail(self, name: str, error: Exception) -> None:
        with self._lock:
            self.ended = self.ended or f"{name}: {fault_text(error)}"
        self._over.set()

    def _finish(self) -> None:
        """Let every device stop that was started, or was being started.

        A reader that does not come back is left alone, and its device too, since one thread uses a driver; it ends when
        the link is closed.
        """
        with self._lock:  # a thread that Ctrl-C has overtaken while it was started leaves the driver alone from now on
            self._over.set()
        while self._to_stop:
            self._stop(self._to_stop[-1], self._drivers[self._to_stop[-1]])
            self._to_stop.pop()
        for name, reader in self._readers.items():
            reader.join(STOP_S)
            if reader.is_alive():
                self._fail(name, RigError(f"It did not stop within {STOP_S:g} s."))
