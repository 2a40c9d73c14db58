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
"""Length of the data that a queue holds [s]."""
UNRATED_HZ = 10_000.0
"""Rate of a stream that states none (assumed: above that of any tactile sensor)."""
BLOCK_S = 0.05
"""Time between two blocks of a stream [s]; of a slower caller a block holds all rows since the last."""
READ_S = 0.05
"""Longest wait of one read, after which a reader checks whether it is to stop."""
STEP_S = 0.02
"""Virtual time between two reads of a device, so that the buffers of its link do not overflow (derived: the usual 256
datagrams of a UDP socket are 37 ms at 7 kHz, the fastest stream of a Net F/T)."""
STOP_S = 5.0
"""Timeout for the end of a reader (assumed: a read and a stop, each within its link's timeouts)."""


class StreamQueue:
    """Bounded queue of one stream's blocks between driver and caller, first in, first out.

    :meth:`put` never waits for room: a block that does not fit is dropped whole, its rows are counted, and the next row
    that gets in is marked with :attr:`~tactbench.core.samples.Quality.GAP`. So the newest are lost, and every hole in
    the rows is marked. One thread puts, another takes.

    Attributes
    ----------
    check
        Order and losses of the rows by their numbers.
    received_ns
        Time at which the last block was put.
    written, dropped
        Number of rows that were taken, and that did not fit.
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
        """Add the new rows of a block; raises RigError if it has other columns than the first one."""
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
                f"A block of stream {block.stream!r} does not fit the first one.",
                hint="Correct the driver: all blocks of a stream have the same columns, and one of each a row.",
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
        """Remove all blocks and yield them as one, if there are any."""
        with self._lock:
            found, self._blocks, self._rows = self._blocks, [], 0
        if found:
            joined = join_blocks(found)
            self.written += len(joined.data)
            yield joined if np.any(joined.quality) else replace(joined, quality=None)

    def discard(self) -> None:
        """Drop all rows, which are not taken any more."""
        with self._lock:
            self._drop(self._rows)
            self._blocks, self._rows = [], 0

    def _drop(self, rows: int) -> None:
        self.dropped += rows
        self._lossy |= rows > 0


class Reading:
    """Context in which devices are read: it starts them, yields their blocks and stops them; for one use.

    In real time a thread reads each driver and puts its rows into a bounded queue a stream; a caller who takes them too
    slowly loses the newest, which is counted and marked (:class:`StreamQueue`). In virtual time there are no threads,
    and the caller cannot be too slow. The same data of the devices make the same rows in both; where blocks begin
    differs. No row is trimmed to the duration. Drivers are neither opened nor closed here.

    Parameters
    ----------
    drivers
        By the device's name in messages. Their streams have different names.
    clock
        The host's, the same as the drivers'.
    advance
        For virtual time: advances `clock` to a nanosecond, and emulated devices with it. None: real time.
    silent_s
        Longest time without a block of a stream that states a rate; a longer one ends the reading.
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
        """Name of the device that ended the reading, and the reason; empty: none did."""

    def __enter__(self) -> Self:
        try:
            for name, driver in self._drivers.items():
                self._to_stop.append(name)
                driver.start()
                for spec in driver.streams:
                    if spec.name in self._streams:
                        hint = "Streams of one recording have different names."
                        raise UsageError(
                            f"The stream {spec.name!r} of {name} is also one of another device.", hint=hint
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
        """Counts of the rows of each stream.

        After the ``with`` block received = written + dropped + duplicates + late. `written` rows were yielded. `gaps`
        are rows that were missing where they were due, including late ones; 0 for a stream without numbers.
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
        """Counts of the drivers by ``device: name``, once the reading is over."""
        return {f"{name}: {what}": n for name, counts in self._counts.items() for what, n in counts.items()}

    def blocks(self, duration_s: float, is_over: Callable[[], bool] = lambda: False) -> Iterator[Block]:
        """Yield blocks of all streams until the time is over or a device has ended the reading; then stop the devices.

        Parameters
        ----------
        duration_s
            Seconds of the clock from the call for the first block; may be infinite.
        is_over
            Called at every block's time, whether or not a device has sent anything; true ends the reading too.
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
                    self._fail(stream.device, RigError(f"Nothing came of {name} for {1e-9 * silent_ns:.3g} s."))
        self._finish()
        for stream in self._streams.values():
            yield from stream.take()

    def _read_once(self, name: str, driver: Driver, timeout_s: float) -> bool:
        blocks = driver.read(timeout_s)
        for block in blocks:
            if block.stream not in self._streams:
                hint = "Correct the driver: its streams are fixed once it is started."
                raise RigError(f"A block of stream {block.stream!r} came, which {name} did not announce.", hint=hint)
            self._streams[block.stream].put(block, self._clock())
        return bool(blocks)

    def _advance_and_read(self, advance: Callable[[int], None], now_ns: int, until_ns: int) -> int:
        """Advance virtual time, and read the devices meanwhile; return the time at the end."""
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
        """Read until nothing comes, or until a time is over: a driver that polls its device takes time itself."""
        while self._read_once(name, driver, 0.0) and self._clock() <= until_ns:
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
        """Stop every device that was started, or was being started.

        A reader that does not end within `STOP_S` keeps its driver, since one thread uses a driver; it ends when the
        link is closed.
        """
        with self._lock:  # a thread that was being started when Ctrl-C came does not touch the driver from now on
            self._over.set()
        while self._to_stop:
            self._stop(self._to_stop[-1], self._drivers[self._to_stop[-1]])
            self._to_stop.pop()
        for name, reader in self._readers.items():
            reader.join(STOP_S)
            if reader.is_alive():
                self._fail(name, RigError(f"It did not stop within {STOP_S:g} s."))
