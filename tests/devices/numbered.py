"""A device of the tests: rows with a counter, handed over by a queue, and its driver."""

from __future__ import annotations

import queue
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np

from tactbench.plugin import Block, ChannelSpec, StreamSpec
from tactbench.plugin.devices import Clock, Driver, LinkUnplugged, Unwrap

BITS = 16


def stream_of(name: str, rate_hz: float, channels: int, dtype: str = "int16") -> StreamSpec:
    specs = tuple(ChannelSpec(name=f"{name}{k}", kind="taxel") for k in range(channels))
    return StreamSpec(name=name, rate_hz=rate_hz, dtype=dtype, channels=specs)


class Far:
    """The device's end."""

    def __init__(self, stream: StreamSpec) -> None:
        self.stream = stream
        self.pieces: queue.Queue[np.ndarray | None] = queue.Queue()

    def send(self, first: int, rows: int) -> None:
        """Send rows first, first + 1 …; each channel reads the number of its row."""
        self.pieces.put(np.arange(first, first + rows))

    def unplug(self) -> None:
        self.pieces.put(None)

    def taken(self) -> None:
        """Wait until the reader has passed on all pieces, and asks for the next one."""
        self.pieces.join()


class NumberedDriver(Driver):
    """Reads one piece a call, and says that it is done when it is called again."""

    def __init__(self, far: Far, clock: Clock) -> None:
        self.far, self.clock = far, clock
        self.sampling = False
        self.stops = 0
        self._unwrap = Unwrap(BITS)
        self._pieces = 0
        self._owing = False

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        return (self.far.stream,)

    @property
    def counts(self) -> Mapping[str, int]:
        return {"pieces": self._pieces}

    def start(self) -> None:
        self.sampling = True

    def read(self, timeout_s: float) -> list[Block]:
        if self._owing:
            self._owing = False
            self.far.pieces.task_done()
        try:
            numbers = self.far.pieces.get(timeout_s > 0, timeout_s)
        except queue.Empty:
            return []
        if numbers is None:
            raise LinkUnplugged("The other end is gone.")
        self._pieces += 1
        self._owing = True
        data = np.repeat(numbers[:, None], len(self.far.stream.channels), axis=1).astype(self.far.stream.dtype)
        counts = self._unwrap(numbers % (1 << BITS))
        return [Block(self.far.stream.name, np.full(len(numbers), self.clock()), data, sequence=counts)]

    def stop(self) -> None:
        self.sampling = False
        self.stops += 1

    def close(self) -> None: ...


@contextmanager
def numbered(stream: StreamSpec, clock: Clock, driver: type[NumberedDriver] = NumberedDriver) -> Iterator:
    far = Far(stream)
    yield far, driver(far, clock)
