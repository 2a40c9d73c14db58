"""Emulated devices in virtual time: a clock that advances only when a link waits, within one thread."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Self, TypeAlias

from tactbench.core.errors import LinkError
from tactbench.core.spec.rig import EmulatedLink
from tactbench.devices.emulator import DeviceEmulator, LinkFault, Sent, SpiDeviceEmulator
from tactbench.links.bridge_emulator import BridgeEmulator
from tactbench.links.can_link import CanFrame, CanLink
from tactbench.links.link import ByteLink, DatagramLink, Link, Received
from tactbench.links.spi_link import SpiBridge

SPI_HZ = 4_400_000
"""Clock of an emulated SPI bus [Hz]: that of the BioTac maker's own tools [sourced: docs/links.md]; the bus takes up
to 10 MHz."""
HELD = 8
"""Number of batches that an emulated SPI bridge stores, equal to that of the firmware in docs/links.md."""
Piece: TypeAlias = bytes | CanFrame
"""One transmitted piece of data: bytes of a stream, a CAN frame, or a datagram."""
_AGAIN_S = 1e-6
"""Time within which two events of a device count as one [s] (assumed). An emulator whose next event is due at the
time of its last poll, by rounding or by mistake, is polled again this much later, so that time always advances."""


@dataclass(frozen=True)
class EmulatedDevice:
    """Model of a device, with the kind and the faults of its link."""

    link: EmulatedLink
    emulator: DeviceEmulator | SpiDeviceEmulator
    """SpiDeviceEmulator for the link kind `spi`, DeviceEmulator for other kinds."""
    faults: tuple[LinkFault, ...] = ()
    """Faults of the link; faults of the device itself are in its emulator."""

    def far_end(self) -> DeviceEmulator:
        """Return the device's end of its link: the emulator, or for an SPI device an emulated SPI bridge to it."""
        emulator: Any = self.emulator
        if self.link == "spi":
            emulator = BridgeEmulator(emulator.exchange, holds=HELD)
        return emulator  # type: ignore[no-any-return]


def split_faults(faults: Iterable[str]) -> tuple[tuple[LinkFault, ...], tuple[str, ...]]:
    """Return the faults of the link, parsed, and the faults of the device itself as text.

    Raises
    ------
    UsageError
        If a fault of the link has an unknown key or a wrong value.
    """
    given = tuple(faults)
    of_link = tuple(fault for fault in given if fault.partition(":")[0] in LinkFault.known)
    return tuple(map(LinkFault.parse, of_link)), tuple(fault for fault in given if fault not in of_link)


class Line:
    """Emulated device with the device's end of its link.

    Parameters
    ----------
    emulator
        The device.
    faults
        Faults of the link.

    Attributes
    ----------
    deliver
        Function of the host's end, called with time [s] and piece in order of time; None: the host's end is not open,
        and pieces are dropped.
    gone
        True if a fault has unplugged the link.
    """

    def __init__(self, emulator: DeviceEmulator, faults: Sequence[LinkFault] = ()) -> None:
        self.deliver: Callable[[float, Piece], None] | None = None
        self.gone = False
        self._emulator = emulator
        self._faults = tuple(faults)
        self._unplugged_s = min((fault.start_s for fault in faults if fault.name == "unplug"), default=math.inf)
        self._polled_s = -math.inf
        self._out: deque[tuple[float, Piece]] = deque()

    def feed(self, piece: Piece, now_s: float) -> None:
        """Pass a piece from the host to the device at `now_s`, and deliver all pieces that are due."""
        self.poll(now_s)
        if not self.gone:
            self._send(self._emulator.feed(piece, now_s))
            self.poll(now_s)

    def poll(self, now_s: float) -> None:
        """Advance the device to `now_s`, and deliver all pieces that are due."""
        if self.gone:
            return
        self._polled_s = until_s = min(now_s, self._unplugged_s)
        if self._emulator.next_s() <= until_s:
            self._send(self._emulator.poll(until_s))
        while self._out and self._out[0][0] <= now_s and self._out[0][0] < self._unplugged_s:
            t_s, piece = self._out.popleft()
            if self.deliver is not None:
                self.deliver(t_s, piece)
        self.gone = now_s >= self._unplugged_s

    def next_s(self) -> float:
        """Return the time of the next event [s]; infinite if there is no event until the host sends a piece."""
        if self.gone:
            return math.inf
        due_s = min(self._emulator.next_s(), self._out[0][0] if self._out else math.inf, self._unplugged_s)
        return due_s if due_s > self._polled_s else self._polled_s + _AGAIN_S

    def _send(self, sent: Sequence[Sent]) -> None:
        for left_s, piece in sent:
            due_s = left_s + sum(one.delay_s for one in self._faults if one.name == "late" and one.active(left_s))
            self._out.append((max(due_s, self._out[-1][0]) if self._out else due_s, piece))


class VirtualTime:
    """Clock of emulated devices, a :data:`~tactbench.links.link.Clock` from 0 on: single-threaded and deterministic.

    Attributes
    ----------
    now_s
        Present virtual time [s].
    lines
        Lines of the devices; simultaneous events happen in the order of this list.
    """

    def __init__(self, lines: list[Line]) -> None:
        self.now_s = 0.0
        self.lines = lines

    def __call__(self) -> int:
        """Return the virtual time [ns]."""
        return round(self.now_s * 1e9)

    def advance(self, until_ns: int) -> None:
        """Advance all devices up to and including `until_ns`; a past time changes nothing."""
        while self.step(until_ns * 1e-9):
            pass

    def step(self, until_s: float) -> bool:
        """Advance to the next event of a device and carry it out, or to `until_s` if that is earlier.

        Returns
        -------
        bool
            True if there was an event.
        """
        line = min(self.lines, key=Line.next_s, default=None)
        due_s = math.inf if line is None else line.next_s()
        if line is None or due_s > until_s:
            self.now_s = max(self.now_s, until_s)
            return False
        self.now_s = max(self.now_s, due_s)
        line.poll(self.now_s)
        return True


class EmulatedDevices:
    """Emulated devices in virtual time, which advances by the wait of a link or :meth:`advance`.

    Parameters
    ----------
    devices
        Devices by name.

    Attributes
    ----------
    clock
        Nanoseconds since the devices began, for drivers and links; emulators, faults and senses use the same time
        in seconds.
    """

    def __init__(self, devices: Mapping[str, EmulatedDevice]) -> None:
        self._devices = dict(devices)
        self._lines = {name: Line(one.far_end(), one.faults) for name, one in devices.items()}
        self.clock = VirtualTime([*self._lines.values()])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing: devices in virtual time hold no port and no other resource of the operating system."""

    def advance(self, until_ns: int) -> None:
        """Advance all devices as :meth:`VirtualTime.advance` does."""
        self.clock.advance(until_ns)

    def open_link(self, name: str) -> Link:
        """Open the host's end of a device's link; raises LinkError if it is open already."""
        kinds = {"can": VirtualCanLink, "datagram": VirtualDatagramLink}
        kind = self._devices[name].link
        link = kinds.get(kind, VirtualByteLink)(name, self.clock, self._lines[name])
        return SpiBridge(link, speed_hz=SPI_HZ) if isinstance(link, VirtualByteLink) and kind == "spi" else link

    def opener(self, name: str) -> Callable[[], Link]:
        """Return the function that opens the host's end of a device's link, for DriverSettings."""
        return partial(self.open_link, name)


class _VirtualLink(Link):
    """The host's end of an emulated link: data reach the device at once, and waits advance virtual time."""

    def __init__(self, name: str, time: VirtualTime, line: Line) -> None:
        super().__init__(f"emulated {name}", time)
        if line.deliver is not None:
            raise LinkError(f"The link {self.address} is open already.", hint="Close the driver that opened it first.")
        self._time = time
        self._line = line
        self._arrived: deque[tuple[int, Piece]] = deque()
        line.deliver = self._arrive

    def timer(self) -> float:
        """Return the virtual time [s]."""
        return self._time.now_s

    def _arrive(self, t_s: float, piece: Piece) -> None:
        self._arrived.append((round(t_s * 1e9), piece))

    def receive(self, timeout_s: float) -> Any:
        until_s = self._usable(timeout_s)
        while not self._arrived:
            self._plugged()
            if not self._time.step(until_s):
                raise self._nothing_came(timeout_s)
        t_ns, piece = self._arrived.popleft()
        return replace(piece, t_ns=t_ns) if isinstance(piece, CanFrame) else Received(piece, t_ns)

    def send(self, piece: Any) -> None:
        """Send data to the device; raises LinkUnplugged if a fault has unplugged the link."""
        self._sendable(piece)
        self._plugged()
        self._line.feed(piece, self._time.now_s)

    def _plugged(self) -> None:
        if self._line.gone:
            raise self._unplugged(ConnectionError("unplugged by a fault of the emulated link"))

    def _release(self) -> None:
        self._line.deliver = None


class VirtualByteLink(_VirtualLink, ByteLink):
    """A byte stream in virtual time; a read returns the bytes of one piece, with its time of receipt."""

    def read(self, timeout_s: float) -> Received:  # noqa: D102  (inherited)
        received: Received = self.receive(timeout_s)
        return received

    def write(self, data: bytes) -> None:  # noqa: D102  (inherited)
        self.send(bytes(data))


class VirtualCanLink(_VirtualLink, CanLink):
    """A CAN bus in virtual time."""


class VirtualDatagramLink(_VirtualLink, DatagramLink):
    """A datagram link in virtual time."""
