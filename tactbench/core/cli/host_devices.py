"""What this machine has for devices: ports, buses, networks, extras, and how well its clock keeps time."""

from __future__ import annotations

import os
import re
import socket
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path

ARPHRD_CAN = 280
"""Type of a CAN interface in /sys/class/net (linux/if_arp.h)."""
IFF_UP = 1
"""Flag of an interface that is up (linux/if.h)."""
MULTICAST_GROUP = "239.74.163.2"
"""python-can's group for udp_multicast over IPv4 (``UdpMulticastBus.DEFAULT_GROUP_IPv4``)."""
REQUESTED_BUFFER_BYTES = 4 << 20
"""What a datagram link asks of the system unless its address says otherwise."""
FOR_DEVELOPERS = ("docs", "test", "dev")
"""Extras that no device needs."""
SLEEP_S = 0.005
"""Length of a sleep whose lateness is measured: half a BioTac frame."""
MEASURED_S = 0.5
"""How long sleeps are measured."""


@dataclass(frozen=True)
class DeviceFile:
    """A serial port or SPI device, and whether this user may open it."""

    path: str
    title: str = ""
    """What it says of itself."""
    names: tuple[str, ...] = ()
    """Names that stay when it is plugged in elsewhere: /dev/serial/by-id/…"""
    usb: str = ""
    """Vendor and product, as lsusb writes them; empty: no USB device."""
    group: str = ""
    """Group that owns it, where the system has groups."""
    allowed: bool = True
    """Whether this user may read and write it; it was not opened, which resets some devices."""
    hint: str = ""
    """What to do where not."""

    @property
    def address(self) -> str:
        """The best name for a rig file."""
        return self.names[0] if self.names else self.path


@dataclass(frozen=True)
class CanInterface:
    """A CAN network interface."""

    name: str
    up: bool
    hint: str = ""


@dataclass(frozen=True)
class Network:
    """What the network can do for datagrams."""

    socketcan: bool
    """Whether the kernel has AF_CAN."""
    multicast_from: str = ""
    """Address from which multicast would go out; empty: there is no route."""
    largest_buffer_bytes: int | None = None
    """The largest receive buffer a socket may ask for; None: not known."""
    hints: tuple[str, ...] = ()


@dataclass(frozen=True)
class Extra:
    """An extra of tactbench."""

    name: str
    requires: tuple[str, ...]
    """Requirements, with their conditions."""
    missing: tuple[str, ...]
    """Distributions that are not installed."""
    command: str
    """Installs it."""


@dataclass(frozen=True)
class ClockCheck:
    """The host's clock, measured for half a second."""

    step_ns: int
    """Smallest step seen of `time.monotonic_ns`."""
    late_median_us: float
    """How much longer a sleep of 5 ms takes: the median."""
    late_largest_us: float
    """The same, the longest."""
    sleeps: int
    wall_us: float
    """By how much the wall clock went on more than the monotonic one in that time: a step shows, a drift hardly."""
    steered_ppm: float | None
    """How much faster the monotonic clock runs than the hardware's, as NTP steers it; None: the system does not say."""


@dataclass(frozen=True)
class Host:
    """Everything of this machine."""

    serial: tuple[DeviceFile, ...]
    spi: tuple[DeviceFile, ...]
    can: tuple[CanInterface, ...]
    network: Network
    extras: tuple[Extra, ...]
    clock: ClockCheck
    problems: tuple[str, ...] = field(default=())
    """What keeps this user from a device, each with the next step."""


def look_at_host() -> Host:
    """Return what this machine has; takes about half a second, opens no device."""
    serial, spi = serial_ports(), spi_devices()
    closed = [one for one in (*serial, *spi) if not one.allowed]
    return Host(
        serial=serial,
        spi=spi,
        can=can_interfaces(),
        network=network(),
        extras=extras(),
        clock=clock_check(),
        problems=tuple(f"This user may not open {one.path}. {one.hint}" for one in closed),
    )


def serial_ports() -> tuple[DeviceFile, ...]:
    """Return the serial ports that pyserial lists."""
    from serial.tools.list_ports import comports

    stable: dict[Path, list[str]] = {}
    for name in sorted(Path("/dev/serial/by-id").glob("*")):
        stable.setdefault(name.resolve(), []).append(str(name))
    found = []
    for port in sorted(comports()):
        usb = f"{port.vid:04x}:{port.pid:04x}" if port.vid is not None and port.pid is not None else ""
        title = " ".join(filter(None, (port.manufacturer, port.description if port.description != "n/a" else "")))
        found.append(_device_file(port.device, title, tuple(stable.get(Path(port.device).resolve(), ())), usb))
    return tuple(found)


def spi_devices() -> tuple[DeviceFile, ...]:
    """Return the SPI devices of a Linux machine."""
    return tuple(_device_file(str(path)) for path in sorted(Path("/dev").glob("spidev*")))


def _device_file(path: str, title: str = "", names: tuple[str, ...] = (), usb: str = "") -> DeviceFile:
    place = Path(path)
    try:
        mode, group = place.stat().st_mode, place.group()
    except (OSError, KeyError, NotImplementedError, ImportError):  # Windows has no groups, a group may have no name
        return DeviceFile(path, title, names, usb)
    if os.access(place, os.R_OK | os.W_OK):
        return DeviceFile(path, title, names, usb, group)
    hint = f"Join its group, then log in again: sudo usermod -aG {group} $USER"
    if mode & 0o060 != 0o060 or group == "root":
        hint = "Only root may: let a udev rule give it to a group, such as dialout."
    return DeviceFile(path, title, names, usb, group, allowed=False, hint=hint)


def can_interfaces() -> tuple[CanInterface, ...]:
    """Return the interfaces of socketcan, up or not."""
    found = []
    for folder in sorted(Path("/sys/class/net").glob("*")):
        try:
            if int((folder / "type").read_text()) != ARPHRD_CAN:
                continue
            up = bool(int((folder / "flags").read_text(), 16) & IFF_UP)
        except (OSError, ValueError):
            continue
        rate = "" if folder.name.startswith("vcan") else " type can bitrate 1000000"
        found.append(CanInterface(folder.name, up, "" if up else f"sudo ip link set {folder.name} up{rate}"))
    return tuple(found)


def network() -> Network:
    """Return what the network can do; nothing is sent."""
    hints = []
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
        socketcan = True
    except (OSError, AttributeError):
        socketcan = False
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((MULTICAST_GROUP, 9))
            multicast_from = str(probe.getsockname()[0])
    except OSError:
        multicast_from = ""
        hints.append("For can://udp_multicast on this machine alone: sudo ip route add 239.0.0.0/8 dev lo")
    try:
        largest = int(Path("/proc/sys/net/core/rmem_max").read_text())
    except (OSError, ValueError):
        largest = None
    if largest is not None and largest < REQUESTED_BUFFER_BYTES:
        hints.append(
            f"Datagrams have a buffer of {largest} bytes where {REQUESTED_BUFFER_BYTES} are asked for: "
            f"sudo sysctl -w net.core.rmem_max={REQUESTED_BUFFER_BYTES}"
        )
    return Network(socketcan, multicast_from, largest, tuple(hints))


def extras() -> tuple[Extra, ...]:
    """Return the extras that tactbench's own metadata states, but those of :data:`FOR_DEVELOPERS`."""
    requirements: dict[str, list[str]] = {
        name: [] for name in metadata.metadata("tactbench").get_all("Provides-Extra") or ()
    }
    for requirement in metadata.requires("tactbench") or ():
        for name in re.findall(r"extra\s*==\s*['\"]([^'\"]+)", requirement):
            requirements.setdefault(name, []).append(requirement)
    found = []
    for name, stated in requirements.items():
        if name in FOR_DEVELOPERS:
            continue
        distributions = [re.split(r"[^A-Za-z0-9._-]", one, maxsplit=1)[0] for one in stated]
        missing = tuple(one for one in distributions if not _installed(one))
        plain = tuple(re.sub(r"\s*(and\s+|;\s*)?extra\s*==\s*['\"][^'\"]+['\"]", "", one) for one in stated)
        found.append(Extra(name, plain, missing, f"pip install 'tactbench[{name}]'"))
    return tuple(found)


def _installed(distribution: str) -> bool:
    try:
        metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return False
    return True


def clock_check() -> ClockCheck:
    """Measure sleeps and clocks for :data:`MEASURED_S`."""
    raw = getattr(time, "CLOCK_MONOTONIC_RAW", None)
    clocks = [time.time_ns] if raw is None else [time.time_ns, lambda: time.clock_gettime_ns(raw)]
    began = [_pair(clock) for clock in clocks]
    late = []
    while time.monotonic_ns() - began[0][0] < MEASURED_S * 1e9:
        before = time.monotonic_ns()
        time.sleep(SLEEP_S)
        late.append((time.monotonic_ns() - before) * 1e-3 - SLEEP_S * 1e6)
    ended = [_pair(clock) for clock in clocks]
    spent = [(after[0] - before[0], after[1] - before[1]) for before, after in zip(began, ended, strict=True)]
    return ClockCheck(
        step_ns=min(_step_ns() for _ in range(100)),
        late_median_us=statistics.median(late),
        late_largest_us=max(late),
        sleeps=len(late),
        wall_us=(spent[0][1] - spent[0][0]) * 1e-3,
        steered_ppm=(spent[1][0] / spent[1][1] - 1) * 1e6 if raw is not None else None,
    )


def _pair(clock: Callable[[], int]) -> tuple[int, int]:
    """Return the monotonic clock and another at one moment: of 20 readings the one with the least time around it."""
    read = [(time.monotonic_ns(), clock(), time.monotonic_ns()) for _ in range(20)]
    before, other, after = min(read, key=lambda one: one[2] - one[0])
    return (before + after) // 2, other


def _step_ns() -> int:
    before = after = time.monotonic_ns()
    while after == before:
        after = time.monotonic_ns()
    return after - before
