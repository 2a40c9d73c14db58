"""A device of the tests: rows with a counter, as datagrams over UDP, and its driver."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np

from tactbench.plugin import Block, ChannelSpec, StreamSpec
from tactbench.plugin.devices import Clock, DatagramLink, Driver, LinkTimeout, Unwrap, open_link

HEAD = struct.Struct("<I")
BITS = 16
_SOCKET_S = 10.0


def stream_of(name: str, rate_hz: float, channels: int, dtype: str = "int16") -> StreamSpec:
    specs = tuple(ChannelSpec(name=f"{name}{k}", kind="taxel") for k in range(channels))
    return StreamSpec(name=name, rate_hz=rate_hz, dtype=dtype, channels=specs)


class Far:
    """The device's end."""

    def __init__(self, stream: StreamSpec) -> None:
        self.stream = stream
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(_SOCKET_S)
        self.port = self.socket.getsockname()[1]
        self.peer: tuple[str, int] | None = None

    def send(self, first: int, rows: int) -> None:
        """Send rows first, first + 1 …; each channel reads the number of its row."""
        numbers = np.arange(first, first + rows)
        data = np.repeat(numbers[:, None], len(self.stream.channels), axis=1).astype(self.stream.dtype)
        self.socket.sendto(HEAD.pack(first % (1 << BITS)) + data.tobytes(), self.peer)

    def taken(self) -> None:
        """Wait until the reader has passed on the datagram before, and asks for the next one."""
        self.socket.recv(16)


class NumberedDriver(Driver):
    """Reads one datagram a call, and says so to the device when it is called again."""

    def __init__(self, far: Far, clock: Clock) -> None:
        link = open_link(f"udp://127.0.0.1:{far.port}", clock)
        assert isinstance(link, DatagramLink)
        self.link = link
        self.link.send(b"here")
        far.peer = far.socket.recvfrom(16)[1]
        self.sampling = False
        self.stops = 0
        self._stream = far.stream
        self._unwrap = Unwrap(BITS)
        self._datagrams = 0
        self._owing = False

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        return (self._stream,)

    @property
    def counts(self) -> Mapping[str, int]:
        return {"datagrams": self._datagrams}

    def identify(self) -> Mapping[str, str]:
        return {}

    def start(self) -> None:
        self.sampling = True

    def read(self, timeout_s: float) -> list[Block]:
        if self._owing:
            self._owing = False
            self.link.send(b"taken")
        try:
            received = self.link.receive(timeout_s)
        except LinkTimeout:
            return []
        self._datagrams += 1
        self._owing = True
        data = np.frombuffer(received.data, self._stream.dtype, offset=HEAD.size)
        data = data.reshape(-1, len(self._stream.channels))
        counts = HEAD.unpack_from(received.data)[0] + np.arange(len(data))
        times = np.full(len(data), received.t_ns)
        return [Block(self._stream.name, times, data, sequence=self._unwrap(counts))]

    def stop(self) -> None:
        self.sampling = False
        self.stops += 1

    def close(self) -> None:
        self.link.close()


@contextmanager
def numbered(stream: StreamSpec, clock: Clock, driver: type[NumberedDriver] = NumberedDriver) -> Iterator:
    far = Far(stream)
    with far.socket, driver(far, clock) as near:
        yield far, near
