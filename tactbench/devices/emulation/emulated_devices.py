"""Emulated devices on one common clock: in virtual time, or in real time on links of the operating system."""

from __future__ import annotations

import time as wall
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, Self

from tactbench.core.spec.rig import EmulatedLink
from tactbench.devices.emulation.line import Line, LinkFault
from tactbench.devices.emulation.real_time import End, PseudoTerminal, RealTimeServer, SlcanAdapter, UdpEnd
from tactbench.devices.emulation.virtual_time import (
    VirtualByteLink,
    VirtualCanLink,
    VirtualDatagramLink,
    VirtualTime,
)
from tactbench.devices.emulator import DeviceEmulator, SpiDeviceEmulator
from tactbench.links.address import open_link
from tactbench.links.bridge_emulator import BridgeEmulator
from tactbench.links.link import Clock, Link
from tactbench.links.spi_bridge import SpiBridge

SPI_HZ = 4_400_000
"""Clock of an emulated SPI bus [Hz]: that of the BioTac maker's own tools [sourced: docs/links.md]; the bus takes up
to 10 MHz."""
HELD = 8
"""Number of batches that an emulated SPI bridge stores, equal to that of the firmware in docs/links.md."""
BAUD = 3_000_000
"""Rate in the address of a serial line [bit/s]: above that of any device; pseudo-terminals have no rate."""


@dataclass(frozen=True)
class EmulatedDevice:
    """Model of a device, with the kind and the faults of its link."""

    link: EmulatedLink
    emulator: DeviceEmulator | SpiDeviceEmulator
    """SpiDeviceEmulator for the link kind `spi`, DeviceEmulator for other kinds."""
    faults: tuple[LinkFault, ...] = ()
    """Faults of the link; faults of the device itself are in its emulator."""
    baud: int | None = None
    """Bit rate in the address of a serial line [bit/s]; None: `BAUD`."""


class EmulatedDevices:
    """Running emulated devices, until :meth:`close` or the end of the ``with`` block.

    Parameters
    ----------
    devices
        Devices by name.
    time
        `virtual`: time advances by the wait of a link or :meth:`advance`; one thread, no link of the system, and the
        same bytes each time. `real`: by the wall clock, in a thread of its own, on links of the system that other
        processes may open, too.

    Attributes
    ----------
    clock
        Nanoseconds since the devices began, for drivers and links; emulators, faults and senses use the same time
        in seconds.
    addresses
        Link address by device name, for a rig file, also for use by another process; empty in virtual time.

    Raises
    ------
    UsageError
        If this operating system lacks the needed kind of link.
    """

    def __init__(
        self,
        devices: Mapping[str, EmulatedDevice],
        *,
        time: Literal["virtual", "real"] = "virtual",
    ) -> None:
        self._devices = dict(devices)
        self._virtual = VirtualTime() if time == "virtual" else None
        began_ns = wall.monotonic_ns()
        self.clock: Clock = self._virtual or (lambda: wall.monotonic_ns() - began_ns)
        real = self._virtual is None
        self._lines = {name: Line(_far_end(one, real=real), one.faults) for name, one in self._devices.items()}
        self.addresses: dict[str, str] = {}
        self._server: RealTimeServer | None = None
        if self._virtual is not None:
            self._virtual.lines += self._lines.values()
            return
        with ExitStack() as opened:
            ends: dict[str, tuple[Line, End]] = {}
            for name, device in self._devices.items():
                end = _end_of(device)
                opened.callback(end.close)
                ends[name] = self._lines[name], end
                self.addresses[name] = end.address
            self._server = RealTimeServer(ends, self.clock)
            opened.pop_all()
        self._server.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        self.close()
        if error is None:
            self._whole()

    def close(self) -> None:
        """End the devices and release the operating system's links; a second call does nothing."""
        if self._server is not None:
            self._server.close()

    def advance(self, until_ns: int) -> None:
        """Advance until `clock` has reached `until_ns`: by simulation in virtual time, by waiting in real time.

        Raises
        ------
        Exception
            The error of an emulator; in real time also an earlier error, raised since the last call.
        """
        if self._virtual is not None:
            self._virtual.advance(until_ns)
            return
        self._whole()
        wall.sleep(max(0.0, (until_ns - self.clock()) * 1e-9))
        self._whole()

    def open_link(self, name: str) -> Link:
        """Open the host's end of a device's link, for its driver.

        Raises
        ------
        LinkError
            If the link cannot be opened, or is open already.
        """
        if self._virtual is None:
            return open_link(self.addresses[name], self.clock)
        kinds = {"can": VirtualCanLink, "datagram": VirtualDatagramLink}
        kind = self._devices[name].link
        link = kinds.get(kind, VirtualByteLink)(name, self._virtual, self._lines[name])
        return SpiBridge(link, speed_hz=SPI_HZ) if isinstance(link, VirtualByteLink) and kind == "spi" else link

    def opener(self, name: str) -> Callable[[], Link]:
        """Return the function that opens the host's end of a device's link, for DriverSettings."""
        return partial(self.open_link, name)

    def _whole(self) -> None:
        if self._server is not None and self._server.error is not None:
            raise self._server.error


def _far_end(device: EmulatedDevice, *, real: bool) -> DeviceEmulator:
    """Return the device's end of a link: an SPI device gets a bridge, in real time a CAN device gets an adapter."""
    emulator: Any = device.emulator
    if device.link == "spi":
        emulator = BridgeEmulator(emulator.exchange, holds=HELD)
    elif device.link == "can" and real:
        emulator = SlcanAdapter(emulator)
    return emulator  # type: ignore[no-any-return]


def _end_of(device: EmulatedDevice) -> End:
    match device.link:
        case "datagram":
            return UdpEnd()
        case "bytes":
            return PseudoTerminal(f"serial://{{}}?baud={device.baud or BAUD}")
        case "spi":
            return PseudoTerminal(f"spi://bridge/{{}}?speed_hz={SPI_HZ}")
    # The bit rate has no effect, and nothing here restarts when its port is opened.
    return PseudoTerminal("can://slcan/{}?bitrate=1000000&sleep_after_open=0")
