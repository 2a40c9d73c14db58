"""Reading of several devices: in real time by one thread for each driver, in virtual time one after the other."""

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
from tactbench.devices.driver import Driver, SequenceCheck, fault_text
from tactbench.links.link import Clock

QUEUE_S = 5.0
"""Capacity of a queue, as duration of its data [s]."""
UNRATED_HZ = 10_000.0
"""Assumed rate of a stream without a stated rate [Hz]: above that of any tactile sensor."""
BLOCK_S = 0.05
"""Time between two blocks of a stream [s]; if the caller is slower, a block has all rows since the last block."""
READ_S = 0.05
"""Longest wait of one read [s], after which a reader checks for a request to stop."""
STEP_S = 0.02
"""Virtual time between reads of a device [s], so that the buffers of its link do not overflow (derived: the usual 256
datagrams of a UDP socket are 37 ms at 7 kHz, the fastest stream of a Net F/T)."""
STOP_S = 5.0
"""Timeout for the end of a reader [s] (assumed: a read and a stop, each within its link's timeouts)."""


class StreamQueue:
    """Bounded queue of one stream's blocks between driver and caller, first in, first out.

    :meth:`put` never waits for room: a block that does not fit is dropped whole, its rows are counted, and the next row
    that gets in is marked with :attr:`~tactbench.core.samples.Quality.GAP`. So the newest rows are lost, and every
    gap in the rows is marked. One thread puts, another takes.

    Attributes
    ----------
    check
        Check of the rows' numbers for lost, late and duplicated rows.
    received_ns
        Time at which the last block was put [ns].
    written, dropped
        Number of rows taken, and of rows dropped for lack of room.
    """

    def __init__(self, device: str, spec: StreamSpec) -> None:
        self.device, self.rated = device, spec.rate_hz is not None
        self.check = SequenceCheck()
        self.received_ns = self.written = self.dropped = 0
        self._rows, self._room = 0, math.ceil(QUEUE_S * (spec.rate_hz or UNRATED_HZ))
        self._blocks: list[Block] = []
        self._layout: list[tuple[int, ...] | None] = []
        self._lossy = False
        self._lock = threading.Lock()

    def put(self, block: Block, now_ns: int) -> None:
        """Add the new rows of a block; raises RigError if its columns differ from those of the first block."""
        kept = self.check(block)
        if kept is None:
            return
        rows = len(kept.data)
        quality = np.zeros(kept.data.shape, np.uint8) if kept.quality is None else kept.quality
        columns = [getattr(kept, name) for name in COLUMNS if name != "quality"]
        layout = [None if one is None else one.shape[1:] for one in columns]
        self._layout = self._layout or layout
        if layout != self._layout or any(one is not None and len(one) != rows for one in columns):
            raise RigError(
                f"A block of stream {block.stream!r} differs from the first block.",
                hint="Correct the driver: all blocks of a stream need the same columns, with one value per row.",
            )
        with self._lock:
            self.received_ns = now_ns
            if self._rows + rows > self._room:
                self._drop(rows)
                return
            if self._lossy:
                quality = quality.copy()
                quality[0] |= np.uint8(Quality.GAP)
                self._lossy = False
            self._blocks.append(replace(kept, quality=quality))
            self._rows += rows

    def take(self) -> Iterator[Block]:
        """Remove all blocks and yield them joined to one block, if there are any."""
        with self._lock:
            found, self._blocks, self._rows = self._blocks, [], 0
        if found:
            joined = join_blocks(found)
            self.written += len(joined.data)
            yield joined if np.any(joined.quality) else replace(joined, quality=None)

    def discard(self) -> None:
        """Drop all rows, as the reading has ended."""
        with self._lock:
            self._drop(self._rows)
            self._blocks, self._rows = [], 0

    def _drop(self, rows: int) -> None:
        self.dropped += rows
        self._lossy |= rows > 0


class Reading:
    """Context that starts several devices, yields their blocks and stops them; for one use.

    In real time one thread for each driver puts its rows into a bounded queue for each stream; a caller that takes rows
    too slowly loses the newest, as counted and marked (:class:`StreamQueue`). In virtual time there are no threads,
    and the caller cannot be too slow. The same data of the devices make the same rows in both; where blocks begin
    differs. No row is trimmed to the duration. Drivers are neither opened nor closed here.

    Parameters
    ----------
    drivers
        Drivers by the device's name in messages. All streams need different names.
    clock
        Clock of the host [ns], the same as the drivers'.
    advance
        Function that advances virtual time, and emulated devices, to a time of `clock` [ns]. None: real time.
    silent_s
        Longest time without a block of a stream with a stated rate [s]; after a longer time the reading ends.
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
        """Name of the device that ended the reading, and the reason; empty: no device did."""

    def __enter__(self) -> Self:
        try:
            for name, driver in self._drivers.items():
                self._to_stop.append(name)
                driver.start()
                for spec in driver.streams:
                    if spec.name in self._streams:
                        hint = "Rename one of these streams."
                        raise UsageError(
                            f"The stream {spec.name!r} of {name} of another device has the same name.", hint=hint
                        )
                    self._streams[spec.name] = StreamQueue(name, spec)
                if self._advance is None:
                    # It is read at once: the next device may take longer to start than the link's buffers last.
                    title = f"reading {name}"
                    threading.Thread(target=self._read, args=(name, driver), name=title, daemon=True).start()
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
        """Numbers of rows of each stream: received, written, dropped and others.

        After the ``with`` block received = written + dropped + duplicates + late. `written` rows were yielded. `gaps`
        counts rows missing at their place, including late rows; 0 for a stream without row numbers.
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
        """Event counts of the drivers, with keys ``device: name``, after the end of the reading."""
        return {f"{name}: {what}": n for name, counts in self._counts.items() for what, n in counts.items()}

    def blocks(self, duration_s: float, is_over: Callable[[], bool] = lambda: False) -> Iterator[Block]:
        """Yield blocks of all streams until time is over or a device ends the reading; then stop all devices.

        Parameters
        ----------
        duration_s
            Duration from the request of the first block [s]; may be infinite.
        is_over
            Function called every `BLOCK_S`, even if no device has sent data; if it returns true, the reading ends.
        """
        now_ns = began_ns = self._clock()
        end_ns = now_ns + 1e9 * duration_s
        while not (self._over.is_set() or is_over()) and now_ns < end_ns:
            until_ns = int(min(now_ns + round(1e9 * BLOCK_S), end_ns))
            if self._advance is None:
                self._over.wait((until_ns - now_ns) / 1e9)
                now_ns = self._clock()
            else:
                now_ns = self._advance_and_read(self._advance, now_ns, until_ns)
            for name, stream in self._streams.items():
                yield from stream.take()
                silent_ns = now_ns - max(began_ns, stream.received_ns)
                if stream.rated and silent_ns > self._silent_ns:
                    self._fail(stream.device, RigError(f"No data of {name} came for {1e-9 * silent_ns:.3g} s."))
        self._finish()
        for stream in self._streams.values():
            yield from stream.take()

    def _read_once(self, name: str, driver: Driver, timeout_s: float) -> bool:
        blocks = driver.read(timeout_s)
        for block in blocks:
            if block.stream not in self._streams:
                hint = "Correct the driver: its streams must not change after start()."
                raise RigError(f"{name} sent a block of {block.stream!r}, which is no stream of {name}.", hint=hint)
            self._streams[block.stream].put(block, self._clock())
        return bool(blocks)

    def _advance_and_read(self, advance: Callable[[int], None], now_ns: int, until_ns: int) -> int:
        """Advance virtual time to `until_ns`, reading the devices meanwhile; return the time reached [ns]."""
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
        """Read until no rows come, or until a time [ns]: a driver that polls its device itself lets time pass."""
        while self._read_once(name, driver, 0.0) and self._clock() <= until_ns:
            pass

    def _read(self, name: str, driver: Driver) -> None:
        """Read one driver until the reading is over, then stop it in the same thread."""
        with self._lock:
            if self._over.is_set():
                return
            self._to_stop.remove(name)
            self._readers[name] = threading.current_thread()
        try:
            while not self._over.is_set():
                self._read_once(name, driver, READ_S)
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
        """Stop every device that was started, even incompletely.

        A reader that does not end within `STOP_S` keeps its driver, as only one thread may use a driver; the reader
        ends when the link is closed.
        """
        with self._lock:  # a thread that was being started when Ctrl-C came does not touch the driver from now on
            self._over.set()
        while self._to_stop:
            self._stop(self._to_stop[-1], self._drivers[self._to_stop[-1]])
            self._to_stop.pop()
        for name, reader in self._readers.items():
            reader.join(STOP_S)
            if reader.is_alive():
                self._fail(name, RigError(f"The reader did not stop within {STOP_S:g} s."))
