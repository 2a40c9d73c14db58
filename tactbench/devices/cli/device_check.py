"""The devices of a rig file, one by one: does it open, who is it, what does it send while nothing touches it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tactbench.core.conformance.streams import good, marks_of
from tactbench.core.errors import TactbenchError
from tactbench.core.plugins.registry import Registry
from tactbench.core.recording.clock_fit import ClockFit, wrong_rate
from tactbench.core.samples import Block, Quality, join_blocks
from tactbench.core.spec.rig_file import DeviceEntry, RigFile
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.driver import Driver
from tactbench.devices.rig_devices import descriptor_of, open_driver
from tactbench.devices.sequence import SequenceCheck
from tactbench.links.byte_link import ByteLink
from tactbench.links.link import Clock

Record = dict[str, Any]

READ_S = 0.25
"""Longest wait of one read, so that the end is not missed by more."""
MOST_NAMED = 6
"""Channels whose means are stated one by one."""
RATE_TOLERANCE = 0.02
"""A rate further from its nominal one is a problem. Assumed: quartz is a hundred times better, a timer of whole
milliseconds at 50 Hz is not. A sample and :data:`HELD_S` at either end are allowed on top."""
HELD_S = 0.016
"""How long a usual USB serial adapter may hold back what has come (FTDI's latency timer as delivered) [s]."""


@dataclass
class DeviceCheck:
    """What became of one device."""

    name: str
    """Its name in messages."""
    device: str
    """Sensor or device of that name in the registry."""
    link: str
    emulated: bool
    identity: dict[str, str] = field(default_factory=dict)
    streams: list[Record] = field(default_factory=list)
    """What came of its streams, a record for each kind of channel; units in the names of its keys."""
    counts: dict[str, int] = field(default_factory=dict)
    """What its driver counted."""
    remarks: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    """What is wrong, each with the next step."""


def check_devices(rig_file: RigFile, registry: Registry, *, seconds: float, clock: Clock) -> list[DeviceCheck]:
    """Open, ask and read each device on a line in turn; what is wrong with one is in its check and ends no other.

    Parameters
    ----------
    seconds
        How long each device is read.
    clock
        The host's.

    Notes
    -----
    A motor is opened and asked who it is; it is never started. Emulated devices are not opened.
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
            check.problems.append(f"Its driver raised {type(error).__name__}: {error}. Tell whoever wrote the driver.")
    return checks


def _check(check: DeviceCheck, registry: Registry, entry: DeviceEntry, seconds: float, clock: Clock) -> None:
    descriptor = descriptor_of(registry, check.name, entry)
    with open_driver(descriptor, entry, clock) as driver:
        try:
            check.identity = dict(driver.identify())
            if getattr(descriptor, "kind", "") == "motor":
                check.remarks.append("a motor: not started")
                return
            _read(check, driver, seconds, clock)
        finally:
            check.counts = {name: number for name, number in driver.counts.items() if number}


def _read(check: DeviceCheck, driver: Driver, seconds: float, clock: Clock) -> None:
    driver.start()
    blocks: dict[str, list[Block]] = {stream.name: [] for stream in driver.streams}
    ordered = {name: SequenceCheck() for name in blocks}
    until_ns = clock() + round(seconds * 1e9)
    try:
        while (left_s := (until_ns - clock()) * 1e-9) > 0:
            for block in driver.read(min(READ_S, left_s)):
                kept = ordered[block.stream](block)
                if kept is not None:
                    blocks[block.stream].append(kept)
    finally:
        driver.stop()
        for stream in driver.streams:
            if blocks[stream.name]:
                found = list(_records(check.name, stream, blocks[stream.name], ordered[stream.name]))
                check.streams += found
                check.problems += _problems(found[0])
            else:
                check.problems.append(
                    f"Nothing came of its stream {stream.name} within {seconds:g} s. {ByteLink.silence_hint}"
                )


def _records(device: str, spec: StreamSpec, came: Sequence[Block], ordered: SequenceCheck) -> Iterator[Record]:
    """Yield what came of a stream, a record for each kind of channel in one unit."""
    whole, hz, line = join_blocks([replace(block, quality=marks_of(block)) for block in came]), None, None
    values, marks, times = good(whole), np.bitwise_or.reduce(marks_of(whole), axis=1), whole.t_ns
    if times is not None and times[-1] > times[0]:
        first = times[: len(came[0].data)]
        hz = (len(times) - (1 if first[-1] > first[0] else len(first))) / (times[-1] - times[0]) * 1e9
    if times is not None and whole.device_ns is not None:
        fit = ClockFit()
        fit.add(whole.device_ns, times)
        line = fit.segments()[-1]
    about: Record = {
        "device": device, "stream": spec.name, "rows": len(values), "hz": hz, "stated_hz": spec.rate_hz,
        "lost": ordered.gaps, "twice_or_late": ordered.duplicates + ordered.late,
        "marked": {str(flag.name): number for flag in Quality if (number := int(np.count_nonzero(marks & flag)))},
        "drift_ppm": None if line is None else line.drift * 1e6,
        "clock_error_us": None if line is None or line.bound_ns is None else line.bound_ns * 1e-3,
    }  # fmt: skip
    groups: dict[tuple[str, str], list[int]] = {}
    for place, channel in enumerate(spec.channels):
        groups.setdefault((channel.kind, channel.unit), []).append(place)
    for (kind, unit), places in groups.items():
        columns = {spec.channels[place].name: values[np.isfinite(values[:, place]), place] for place in places}
        columns = {name: column for name, column in columns.items() if len(column) > 1}
        sds = {name: float(column.std(ddof=1)) for name, column in columns.items()}
        noisiest = max(sds, key=sds.__getitem__, default=None)
        means = {name: float(column.mean()) for name, column in columns.items()}
        if len(means) > MOST_NAMED:
            means = {"lowest": min(means.values()), "highest": max(means.values())}
        yield {
            **about, "kind": kind, "unit": unit, "mean": means,
            "sd_median": float(np.median(list(sds.values()))) if sds else None,
            "sd_largest": None if noisiest is None else sds[noisiest], "noisiest": noisiest,
            "constant": [name for name, sd in sds.items() if sd == 0],
        }  # fmt: skip


def _problems(found: Record) -> list[str]:
    problems, name, rows, rate_hz, stated_hz = [], found["stream"], found["rows"], found["hz"], found["stated_hz"]
    if rate_hz is not None and stated_hz is not None:
        allowed = RATE_TOLERANCE + 2 / rows + 2 * HELD_S * rate_hz / rows
        if abs(rate_hz / stated_hz - 1) > allowed:
            problems.append(f"Stream {name} came at {rate_hz:.4g} Hz, stated are {stated_hz:.4g} Hz.")
    if found["drift_ppm"] is not None and rate_hz:
        refused = wrong_rate(name, 1e-6 * found["drift_ppm"], round(1e9 * rows / rate_hz))
        problems += [f"{refused}. Correct device_ns in its driver."] if refused else []
    wrong = {"lost": found["lost"], "twice or late": found["twice_or_late"], **found["marked"]}
    told = [f"{number} {what}{_CAUSES.get(what, '')}" for what, number in wrong.items() if number]
    return [*problems, f"Stream {name}, of {rows} rows: {', '.join(told)}."] if told else problems


_CAUSES = {"lost": " (host or bus too busy?)", "MISSING": " (a part not connected?)",
           "SUSPECT": " (cable, shield, ground?)", "SATURATED": " (is something touching it?)"}  # fmt: skip
