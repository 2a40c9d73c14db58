"""Check of this machine's ports, and of the identity and the data at rest of each device in a rig file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tactbench.core.conformance.streams import RATE_SHARE, good, joined, marks_of
from tactbench.core.errors import TactbenchError
from tactbench.core.plugins.registry import Registry
from tactbench.core.recording.clock_fit import fit, wrong_rate
from tactbench.core.samples import Block, Quality, StreamData
from tactbench.core.spec.rig_file import DeviceEntry, RigFile
from tactbench.devices.driver import SequenceCheck
from tactbench.devices.rig_devices import descriptor_of, open_driver
from tactbench.links.link import ByteLink, Clock

READ_S = 0.25
"""Longest wait of one read of a driver [s]."""
_CAUSES = {"lost": " (host or bus too busy?)", "MISSING": " (a part not connected?)",
           "SUSPECT": " (cable, shield, ground?)", "SATURATED": " (is something touching it?)"}  # fmt: skip


@dataclass(frozen=True)
class HostItem:
    """One port or bus of this machine."""

    kind: str
    """``serial port`` or ``CAN``."""
    name: str
    text: str = ""
    denied: str = ""
    """Advice on getting the permission to open the port; empty if this user may open it."""


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


@dataclass
class DeviceCheck:
    """Result of checking one device of a rig file."""

    name: str
    """Name of the device in messages."""
    device: str
    """Registry name of the sensor or device."""
    link: str
    emulated: bool
    identity: dict[str, str] = field(default_factory=dict)
    streams: list[dict[str, Any]] = field(default_factory=list)
    """Statistics of the device's streams: one record for each kind of channel; keys end in the unit of the value."""
    counts: dict[str, int] = field(default_factory=dict)
    """Event counts by name, as reported by the device's driver."""
    remarks: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    """Problems found, each with advice on the next step."""


def check_devices(rig_file: RigFile, registry: Registry, *, seconds: float, clock: Clock) -> list[DeviceCheck]:
    """Open, identify and read each device for some seconds; a problem is reported and does not end the other checks.

    A motor is opened and identified, and never started. Emulated devices are not opened.
    """
    checks = []
    for name, entry in rig_file.entries().items():
        check = DeviceCheck(name, str(getattr(entry, "device", name)), entry.link, entry.emulated)
        checks.append(check)
        if entry.emulated:
            check.remarks.append("not opened")
            continue
        try:
            _check(check, registry, entry, seconds, clock)
        except TactbenchError as error:
            check.problems.append(str(error))
        except Exception as error:  # a driver of others may raise anything
            check.problems.append(f"The device's driver raised {type(error).__name__}: {error}. Tell its author.")
    return checks


def _check(check: DeviceCheck, registry: Registry, entry: DeviceEntry, seconds: float, clock: Clock) -> None:
    descriptor, blocks = descriptor_of(registry, check.name, entry), list[Block]()
    with open_driver(descriptor, entry, clock) as driver:
        try:
            check.identity = dict(driver.identify())
            if getattr(descriptor, "kind", "") == "motor":
                check.remarks.append("a motor: not started")
                return
            driver.start()
            order = {stream.name: SequenceCheck() for stream in driver.streams}
            until_ns = clock() + round(seconds * 1e9)
            while (left_s := (until_ns - clock()) * 1e-9) > 0:
                blocks += filter(None, (order[block.stream](block) for block in driver.read(min(READ_S, left_s))))
            driver.stop()
        finally:
            check.counts = {name: number for name, number in driver.counts.items() if number}
        for name, stream in joined("driver.read", driver.streams, blocks).items():
            if len(stream.data):
                _judge(check, stream, order[name])
            else:
                check.problems.append(f"No data of stream {name} came within {seconds:g} s. {ByteLink.silence_hint}")


def _judge(check: DeviceCheck, stream: StreamData, order: SequenceCheck) -> None:
    """Add the problems of a stream, and a record for each kind of its channels, with the noise of the channels."""
    name, rows, times, stated_hz = stream.spec.name, len(stream.data), stream.t_ns, stream.spec.rate_hz
    hz = drift_ppm = None
    if times is not None and times[-1] > times[0]:
        hz = float(np.count_nonzero(times > times[0]) / (times[-1] - times[0]) * 1e9)
        # Rows that come together have one time: as many may be missing at either end.
        if stated_hz is not None and abs(hz / stated_hz - 1) > RATE_SHARE + 2 / len(np.unique(times)):
            check.problems.append(f"Stream {name} came at {hz:.4g} Hz; its driver states {stated_hz:.4g} Hz.")
        if stream.device_ns is not None:
            drift = fit(stream.device_ns, times)[-1].drift
            drift_ppm = 1e6 * drift
            if refused := wrong_rate(name, drift, round(1e9 * rows / hz)):
                check.problems.append(f"{refused}. Correct device_ns in the device's driver.")
    marks = np.bitwise_or.reduce(marks_of(stream), axis=1)
    lacking = {"lost": order.gaps, "received twice or late": order.duplicates + order.late,
               **{str(flag.name): int(np.count_nonzero(marks & flag)) for flag in Quality}}  # fmt: skip
    texts = [f"{number} {what}{_CAUSES.get(what, '')}" for what, number in lacking.items() if number]
    if texts:
        check.problems.append(f"Stream {name}, of {rows} rows: {', '.join(texts)}.")
    values, channels = good(stream), stream.spec.channels
    for kind, unit in dict.fromkeys((channel.kind, channel.unit) for channel in channels):
        own = [place for place, one in enumerate(channels) if (one.kind, one.unit) == (kind, unit)]
        columns = {channels[place].name: values[np.isfinite(values[:, place]), place] for place in own}
        sds = {one: float(column.std(ddof=1)) for one, column in columns.items() if len(column) > 1}
        noisiest = max(sds, key=sds.__getitem__, default="")
        check.streams.append({
            "device": check.name, "stream": name, "rows": rows, "hz": hz, "stated_hz": stated_hz,
            "lost": order.gaps, "drift_ppm": drift_ppm, "kind": kind, "unit": unit, "sd_largest": sds.get(noisiest),
            "noisiest": noisiest, "mean": float(np.nanmean(values[:, own])) if sds else None,
            "constant": [one for one, sd in sds.items() if sd == 0],
        })  # fmt: skip
