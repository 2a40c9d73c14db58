"""What this machine has for devices: ports, buses, networks, extras, and how well its clock keeps time."""

from __future__ import annotations

import os
import re
import socket
import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Literal

ARPHRD_CAN = 280
"""Type of a CAN interface in /sys/class/net (linux/if_arp.h)."""
IFF_UP = 1
"""Flag of an interface that is up (linux/if.h)."""
REQUESTED_BUFFER_BYTES = 4 << 20
"""What a datagram link asks of the system unless its address says otherwise."""
FOR_DEVELOPERS = ("docs", "test", "dev")
"""Extras that no device needs."""
SLEEP_S = 0.005
"""Length of a sleep whose lateness is measured: half a BioTac frame."""
SLEEPS = 100


@dataclass(frozen=True)
class HostItem:
    """One thing that devices may need."""

    kind: str
    """``serial port``, ``SPI``, ``CAN``, ``network``, ``extra`` or ``clock``."""
    name: str
    state: Literal["works", "missing", "denied"]
    """``denied``: it is there, and this user may not open it."""
    text: str = ""
    hint: str = ""
    """What to do where it does not work."""


def look_at_host() -> list[HostItem]:
    """Return what this machine has; takes about half a second, opens no device."""
    return [*serial_ports(), *spi_devices(), *can_interfaces(), *network(), *extras(), clock()]


def serial_ports() -> Iterator[HostItem]:
    """Yield the serial ports that pyserial lists, with the names that stay when they are plugged in elsewhere."""
    from serial.tools.list_ports import comports

    stable: dict[Path, list[str]] = {}
    for name in sorted(Path("/dev/serial/by-id").glob("*")):
        stable.setdefault(name.resolve(), []).append(str(name))
    for port in sorted(comports()):
        usb = f"USB {port.vid:04x}:{port.pid:04x}" if port.vid is not None and port.pid is not None else ""
        said = port.description if port.description != "n/a" else ""
        names = stable.get(Path(port.device).resolve(), ())
        yield _device("serial port", port.device, ", ".join(filter(None, (port.manufacturer, said, usb, *names))))


def spi_devices() -> Iterator[HostItem]:
    """Yield the SPI devices of a Linux machine."""
    paths = sorted(Path("/dev").glob("spidev*"))
    yield from (_device("SPI", str(path)) for path in paths)
    if not paths:
        yield HostItem(
            "SPI", "spidev", "missing", "no /dev/spidev*", "A bridge on a serial port needs none: docs/links.md."
        )


def _device(kind: str, path: str, text: str = "") -> HostItem:
    place = Path(path)
    try:
        group = place.group()
    except (OSError, KeyError, NotImplementedError, ImportError):  # Windows has no groups, a group may have no name
        return HostItem(kind, path, "works", text)
    if os.access(place, os.R_OK | os.W_OK):  # opening it would reset some devices
        return HostItem(kind, path, "works", text)
    hint = f"Join its group, {group}, then log in again: sudo usermod -aG {group} $USER"
    return HostItem(kind, path, "denied", text, "A udev rule may give it to a group." if group == "root" else hint)


def can_interfaces() -> Iterator[HostItem]:
    """Yield whether the kernel has CAN sockets, and their interfaces, up or not."""
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
        yield HostItem("CAN", "socketcan", "works")
    except (OSError, AttributeError):
        yield HostItem("CAN", "socketcan", "missing", "the kernel has no AF_CAN", "can://slcan/PORT needs none.")
    for folder in sorted(Path("/sys/class/net").glob("*")):
        try:
            if int((folder / "type").read_text()) != ARPHRD_CAN:
                continue
            up = bool(int((folder / "flags").read_text(), 16) & IFF_UP)
        except (OSError, ValueError):
            continue
        rate = "" if folder.name.startswith("vcan") else " type can bitrate 1000000"
        hint = "" if up else f"sudo ip link set {folder.name} up{rate}"
        yield HostItem("CAN", folder.name, "works" if up else "missing", "up" if up else "down", hint)


def network() -> Iterator[HostItem]:
    """Yield how many datagrams the system holds for a process that is late."""
    try:
        largest = int(Path("/proc/sys/net/core/rmem_max").read_text())
    except (OSError, ValueError):
        return
    enough = largest >= REQUESTED_BUFFER_BYTES
    hint = "" if enough else f"sudo sysctl -w net.core.rmem_max={REQUESTED_BUFFER_BYTES}"
    text = f"{largest} bytes" if enough else f"{largest} bytes, {REQUESTED_BUFFER_BYTES} are asked for"
    yield HostItem("network", "receive buffer", "works" if enough else "missing", text, hint)


def extras() -> Iterator[HostItem]:
    """Yield the extras that tactbench's own metadata states, but those of :data:`FOR_DEVELOPERS`."""
    requirements: dict[str, list[str]] = {}
    for requirement in metadata.requires("tactbench") or ():
        found = re.match(r"([\w.-]+).*extra\s*==\s*['\"]([^'\"]+)", requirement)
        if found and found[2] not in FOR_DEVELOPERS:
            requirements.setdefault(found[2], []).append(found[1])
    for name, distributions in requirements.items():
        lacking = ", ".join(one for one in distributions if not any(metadata.distributions(name=one)))
        text, hint = (f"not installed: {lacking}", f"pip install 'tactbench[{name}]'") if lacking else ("", "")
        yield HostItem("extra", name, "missing" if lacking else "works", text, hint)


def clock() -> HostItem:
    """Measure how late sleeps end."""
    late_ms = []
    for _ in range(SLEEPS):
        before = time.monotonic_ns()
        time.sleep(SLEEP_S)
        late_ms.append((time.monotonic_ns() - before) * 1e-6 - SLEEP_S * 1e3)
    median, most = statistics.median(late_ms), max(late_ms)
    text = f"sleeps of {SLEEP_S * 1e3:g} ms end {median:.2f} ms late (median), {most:.2f} ms at most"
    return HostItem("clock", "clock", "works", text)
