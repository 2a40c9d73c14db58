"""The far ends of links, made of what the machine has: pseudo-terminals, sockets, buses of one process."""

from __future__ import annotations

import os
import select
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

from tactbench.devices.emulation.real_time import RealTimeDevices
from tactbench.devices.emulation.virtual_time import EmulatedDevice
from tactbench.links.bridge_emulator import BridgeEmulator
from tactbench.plugin.devices import CanFrame, Link, SpiStep, open_link


@dataclass
class End:
    """A link, and what its tests do at the far end."""

    link: Link
    say: Callable[[], None]
    """Makes the far end send something."""
    tell: Callable[[], object]
    """Sends at the near end."""
    unplug: Callable[[], None] | None = None


class Pty:
    """The master of a pseudo-terminal."""

    def __init__(self) -> None:
        self.master, slave = os.openpty()
        self.name = os.ttyname(slave)
        self._slave: int | None = slave

    def opened(self) -> None:
        """Let go of the slave, which the link has open by now."""
        if self._slave is not None:
            os.close(self._slave)
            self._slave = None

    def read(self, timeout_s: float = 2.0) -> bytes:
        ready, _, _ = select.select([self.master], [], [], timeout_s)
        return os.read(self.master, 65536) if ready else b""

    def read_until(self, end: bytes) -> bytes:
        data = b""
        while not data.endswith(end):
            part = self.read()
            assert part, f"only {data!r} came"
            data += part
        return data

    def write(self, data: bytes) -> None:
        os.write(self.master, data)

    def unplug(self) -> None:
        self.opened()
        if self.master >= 0:
            os.close(self.master)
            self.master = -1


@contextmanager
def pty() -> Iterator[Pty]:
    end = Pty()
    try:
        yield end
    finally:
        end.unplug()


@contextmanager
def serving(emulator: BridgeEmulator) -> Iterator[Served]:
    """A bridge emulator on a pseudo-terminal, in real time."""
    with RealTimeDevices({"bridge": EmulatedDevice("bytes", emulator)}) as devices:
        yield Served(devices.addresses["bridge"].removeprefix("serial://").partition("?")[0], devices.close)


class Served(NamedTuple):
    """Where a link finds what is served, and how that ends."""

    name: str
    unplug: Callable[[], None]


def loopback(select: int, data: bytes, now_s: float) -> bytes:
    """MOSI wired to MISO."""
    return data


@contextmanager
def byte_stream(clock: Callable[[], int]) -> Iterator[End]:
    with pty() as far, open_link(f"serial://{far.name}?baud=115200", clock) as link:
        yield End(link, lambda: far.write(b"a"), lambda: link.write(b"b"), far.unplug)


@contextmanager
def tcp(clock: Callable[[], int]) -> Iterator[End]:
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        open_link(f"socket://127.0.0.1:{server.getsockname()[1]}", clock) as link,
        server.accept()[0] as far,
    ):
        yield End(link, lambda: far.sendall(b"a"), lambda: link.write(b"b"), far.close)


@contextmanager
def datagrams(clock: Callable[[], int]) -> Iterator[End]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as far:
        far.bind(("127.0.0.1", 0))
        with open_link(f"udp://127.0.0.1:{far.getsockname()[1]}", clock) as link:

            def unplug() -> None:
                far.close()
                link.send(b"is anybody there?")

            def say() -> None:
                far.sendto(b"a", ("127.0.0.1", link._socket.getsockname()[1]))

            yield End(link, say, lambda: link.send(b"b"), unplug)


@contextmanager
def virtual_can(clock: Callable[[], int]) -> Iterator[End]:
    with open_link("can://virtual/alike", clock) as link, open_link("can://virtual/alike") as far:
        frame = CanFrame(0x4E0, b"\x40")
        yield End(link, lambda: far.send(frame), lambda: link.send(frame))


@contextmanager
def slcan(clock: Callable[[], int]) -> Iterator[End]:
    with (
        pty() as far,
        open_link(f"can://slcan/{far.name}?bitrate=1000000&sleep_after_open=0", clock) as link,
    ):
        frame = CanFrame(0x20E, b"\x4d")
        yield End(link, lambda: far.write(b"t4E0140\r"), lambda: link.send(frame), far.unplug)


@contextmanager
def spi_bridge(clock: Callable[[], int]) -> Iterator[End]:
    with (
        serving(BridgeEmulator(loopback)) as far,
        open_link(f"spi://bridge/{far.name}?speed_hz=1000000", clock) as link,
    ):

        def send() -> object:
            return link.send([SpiStep(b"ab")])

        yield End(link, send, send, far.unplug)


ENDS = {
    "pty": byte_stream,
    "socket": tcp,
    "udp": datagrams,
    "can-virtual": virtual_can,
    "can-slcan": slcan,
    "spi-bridge": spi_bridge,
}
