"""Ports and buses of this machine that devices may be connected to."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class HostItem:
    """One port or bus of this machine."""

    kind: str
    """``serial port`` or ``CAN``."""
    name: str
    text: str = ""
    denied: str = ""
    """Advice on the permission, if this user may not open the port; empty: it may be opened."""


def look_at_host() -> Iterator[HostItem]:
    """Yield the serial ports that pyserial lists, and the CAN interfaces; opens no device.

    The text of a serial port includes the path that stays the same in another USB socket.
    """
    import psutil
    from serial.tools.list_ports import comports

    names = sorted(Path("/dev/serial/by-id").glob("*"))
    for port in sorted(comports()):
        stable = (str(name) for name in names if name.resolve() == Path(port.device).resolve())
        texts = (text for text in (port.description, port.hwid, *stable) if text not in ("", "n/a"))
        yield HostItem("serial port", port.device, ", ".join(texts), _denied(Path(port.device)))
    for name, stats in sorted(psutil.net_if_stats().items()):
        if "can" in name:
            rate = "" if name.startswith("vcan") else " type can bitrate 1000000"
            yield HostItem("CAN", name, "up" if stats.isup else f"down: sudo ip link set {name} up{rate}")


def _denied(path: Path) -> str:
    try:
        group = path.group()
    except (OSError, KeyError, NotImplementedError, ImportError):  # Windows has no groups, a group may have no name
        return ""
    if os.access(path, os.R_OK | os.W_OK):  # opening it would reset some devices
        return ""
    if group == "root":
        return "Let a udev rule set its group."
    return f"Join the port's group, {group}, then log in again: sudo usermod -aG {group} $USER"
