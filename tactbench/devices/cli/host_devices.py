"""Resources of this machine for devices: ports, buses, networks, optional packages, and the lateness of its sleeps."""

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

REQUESTED_BUFFER_BYTES = 4 << 20
"""Size of the receive buffer [bytes] that a datagram link requests unless its address states another size."""
FOR_DEVELOPERS = ("docs", "test", "dev")
"""Optional dependencies (extras) that no device needs."""
SLEEP_S = 0.005
"""Length of the sleeps whose lateness is measured [s]: half a BioTac frame."""
SLEEPS = 100


@dataclass(frozen=True)
class HostItem:
    """One resource of this machine that devices may need, and its state."""

    kind: str
    """Kind of resource: ``serial port``, ``SPI``, ``CAN``, ``network``, ``extra`` or ``clock``."""
    name: str
    state: Literal["works", "missing", "denied"]
    """``denied``: the resource exists, but this user may not open it."""
    text: str = ""
    hint: str = ""
    """Advice on the next step if the state is not ``works``."""


def look_at_host() -> list[HostItem]:
    """Return the resources of this machine; takes about half a second, opens no device."""
    return [*serial_ports(), *can_interfaces(), *network(), *extras(), clock()]


def serial_ports() -> Iterator[HostItem]:
    """Yield the serial ports that pyserial lists, with the path that stays the same in another USB socket."""
    from serial.tools.list_ports import comports

    names = sorted(Path("/dev/serial/by-id").glob("*"))
    for port in sorted(comports()):
        stable = [str(name) for name in names if name.resolve() == Path(port.device).resolve()]
        texts = (
            "" if port.description == "n/a" else port.description,
            "" if port.hwid == "n/a" else port.hwid,
            *stable,
        )
        yield _device("serial port", port.device, ", ".join(filter(None, texts)))


def _device(kind: str, path: str, text: str = "") -> HostItem:
    place = Path(path)
    try:
        group = place.group()
    except (OSError, KeyError, NotImplementedError, ImportError):  # Windows has no groups, a group may have no name
        return HostItem(kind, path, "works", text)
    if os.access(place, os.R_OK | os.W_OK):  # opening it would reset some devices
        return HostItem(kind, path, "works", text)
    hint = f"Join the port's group, {group}, then log in again: sudo usermod -aG {group} $USER"
    return HostItem(kind, path, "denied", text, "Let a udev rule set its group." if group == "root" else hint)


def can_interfaces() -> Iterator[HostItem]:
    """Yield the state of the kernel's CAN sockets, and of each CAN interface (up or down)."""
    import psutil

    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
        yield HostItem("CAN", "socketcan", "works")
    except (OSError, AttributeError):
        yield HostItem("CAN", "socketcan", "missing", "the kernel has no AF_CAN", "can://slcan/PORT works without.")
    for name, stats in sorted(psutil.net_if_stats().items()):
        if "can" not in name:
            continue
        if stats.isup:
            yield HostItem("CAN", name, "works", "up")
        else:
            rate = "" if name.startswith("vcan") else " type can bitrate 1000000"
            yield HostItem("CAN", name, "missing", "down", f"sudo ip link set {name} up{rate}")


def network() -> Iterator[HostItem]:
    """Yield the largest permitted receive buffer [bytes], which holds datagrams until a late process reads them."""
    try:
        largest = int(Path("/proc/sys/net/core/rmem_max").read_text())
    except (OSError, ValueError):
        return
    if largest >= REQUESTED_BUFFER_BYTES:
        yield HostItem("network", "receive buffer", "works", f"{largest} bytes")
    else:
        text = f"{largest} bytes, {REQUESTED_BUFFER_BYTES} are requested"
        hint = f"sudo sysctl -w net.core.rmem_max={REQUESTED_BUFFER_BYTES}"
        yield HostItem("network", "receive buffer", "missing", text, hint)


def extras() -> Iterator[HostItem]:
    """Yield tactbench's optional dependencies (extras), except those in :data:`FOR_DEVELOPERS`."""
    lacking: dict[str, list[str]] = {}
    for requirement in metadata.requires("tactbench") or ():
        found = re.match(r"([\w.-]+).*extra\s*==\s*['\"]([^'\"]+)", requirement)
        if found and found[2] not in FOR_DEVELOPERS:
            lacking.setdefault(found[2], []).extend([] if any(metadata.distributions(name=found[1])) else [found[1]])
    for name, missing in lacking.items():
        if missing:
            text, hint = f"not installed: {', '.join(missing)}", f"pip install 'tactbench[{name}]'"
            yield HostItem("extra", name, "missing", text, hint)
        else:
            yield HostItem("extra", name, "works")


def clock() -> HostItem:
    """Measure by how many milliseconds sleeps end late."""
    late_ms = []
    for _ in range(SLEEPS):
        before_s = time.monotonic()
        time.sleep(SLEEP_S)
        late_ms.append(1e3 * (time.monotonic() - before_s - SLEEP_S))
    text = f"{statistics.median(late_ms):.2f} ms late (median), {max(late_ms):.2f} ms at most"
    return HostItem("clock", "clock", "works", f"sleeps of {SLEEP_S * 1e3:g} ms end {text}")
