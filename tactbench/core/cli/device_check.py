"""The devices of a rig file, one by one: does it open, who is it, what does it send while nothing touches it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from tactbench.core.errors import TactbenchError
from tactbench.core.samples import Quality

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.samples import Block, FloatArray, IntArray
    from tactbench.core.spec.rig_file import DeviceEntry, RigFile
    from tactbench.core.spec.sensor import StreamSpec
    from tactbench.devices.driver import Driver
    from tactbench.devices.emulator import Senses
    from tactbench.devices.sequence import SequenceCheck
    from tactbench.links.link import Clock, Link

READ_S = 0.25
"""Longest wait of one read, so that the end is not missed by more."""
RATE_TOLERANCE = 0.02
"""A rate further from its nominal one is a problem. Assumed: quartz is a hundred times better, a timer of whole
milliseconds at 50 Hz is not. A sample and :data:`HELD_S` at either end are allowed on top."""
HELD_S = 0.016
"""How long a usual USB serial adapter may hold back what has come (FTDI's latency timer as delivered) [s]."""


@dataclass(frozen=True)
class Noise:
    """The channels of one kind in one unit, while nothing touches the device."""

    kind: str
    unit: str
    channels: int
    sd_median: float | None
    """Standard deviation over the time read: the median over channels. None: no good samples."""
    sd_largest: float | None
    noisiest: str
    """The channel that has it."""
    constant: tuple[str, ...]
    """Channels that did not change."""
    means: dict[str, float]
    """By channel: the offset of a force sensor, the level of a taxel."""


@dataclass(frozen=True)
class DeviceClock:
    """A device's own clock against the host's, as a recording would be put on it."""

    offset_s: float
    """Host's clock minus device's in the middle of the reading."""
    drift_ppm: float
    """By how much the host's clock runs faster."""
    bound_us: float | None
    """The error of the line between them; None: too few samples to tell."""
    breaks: int
    """How often its times went back."""


@dataclass(frozen=True)
class StreamCheck:
    """What came of one stream."""

    stream: str
    rows: int
    rate_hz: float | None
    nominal_hz: float | None
    lost: int
    """Rows that did not come where they were due, by the device's numbers."""
    unordered: int
    """Rows left out because they came twice or late."""
    marks: dict[str, int]
    """Rows with each mark of quality."""
    noise: tuple[Noise, ...]
    clock: DeviceClock | None
    """None: the stream's times are the host's."""


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
    streams: list[StreamCheck] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    """What its driver counted."""
    remarks: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    """What is wrong, each with the next step."""


def check_devices(
    rig_file: RigFile,
    registry: Registry,
    *,
    seconds: float,
    clock: Clock,
    senses: Callable[[str], Senses] | None = None,
) -> list[DeviceCheck]:
    """Open, ask and read each device in turn; what is wrong with one is in its check and ends no other.

    Parameters
    ----------
    seconds
        How long each device is read.
    clock
        The host's.
    senses
        By a device's name: what an emulated one senses while nothing touches it. Each runs alone, on its own clock.
        None: they are not opened.

    Notes
    -----
    A motor is opened and asked who it is; it is never started.
    """
    from tactbench.core.plugins.rig_devices import descriptor_of, emulated_device
    from tactbench.devices.emulation.emulated_devices import EmulatedDevices
    from tactbench.links.address import open_link

    checks = []
    for name, entry in rig_file.entries().items():
        check = DeviceCheck(name, str(getattr(entry, "device", name)), entry.link, entry.emulated)
        checks.append(check)
        if entry.emulated:
            check.remarks.append("emulated")
        try:
            with ExitStack() as stack:
                if not entry.emulated:
                    _check(check, registry, entry, partial(open_link, entry.link, clock), seconds, clock)
                elif senses is not None:
                    descriptor = descriptor_of(registry, name, entry)
                    how = rig_file.emulation
                    device = emulated_device(descriptor, name, entry, senses(name), how.seed)
                    devices = stack.enter_context(EmulatedDevices({name: device}, time=how.time))
                    _check(check, registry, entry, partial(devices.open_link, name), seconds, devices.clock)
        except TactbenchError as error:
            check.problems.append(str(error))
        except Exception as error:  # a driver of others may raise anything
            check.problems.append(f"Its driver raised {type(error).__name__}: {error}. Tell whoever wrote the driver.")
    return checks


def _check(
    check: DeviceCheck,
    registry: Registry,
    entry: DeviceEntry,
    opener: Callable[[], Link],
    seconds: float,
    clock: Clock,
) -> None:
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_object
    from tactbench.core.plugins.rig_devices import descriptor_of, options_of
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.devices.driver import DriverSettings

    descriptor = descriptor_of(registry, check.name, entry)
    if descriptor.driver is None:
        raise UsageError(f"{check.device} has no driver.", hint="docs/plugins.md says how a sensor names one.")
    streams = descriptor.spec.streams if isinstance(descriptor, SensorDescriptor) else ()
    settings = DriverSettings(opener, streams, options_of(descriptor, entry), clock)
    with load_object(descriptor.driver)(settings) as driver:
        try:
            check.identity = dict(driver.identify())
            if not isinstance(descriptor, SensorDescriptor) and descriptor.kind == "motor":
                check.remarks.append("a motor: not started")
                return
            _read(check, driver, seconds, clock)
        finally:
            check.counts = {name: number for name, number in driver.counts.items() if number}


def _read(check: DeviceCheck, driver: Driver, seconds: float, clock: Clock) -> None:
    from tactbench.devices.sequence import SequenceCheck

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
            came = blocks[stream.name]
            if came:
                found = _stream_check(stream, came, ordered[stream.name])
                check.streams.append(found)
                check.problems += _problems(found)
            else:
                check.problems.append(
                    f"Nothing came of its stream {stream.name} within {seconds:g} s. "
                    "Is it on, connected to this port, and set to the same speed?"
                )


def _stream_check(spec: StreamSpec, came: Sequence[Block], ordered: SequenceCheck) -> StreamCheck:
    import numpy as np

    rows = sum(len(block.data) for block in came)
    quality = [np.zeros(block.data.shape, np.uint8) if block.quality is None else block.quality for block in came]
    every = np.concatenate(quality)
    values = np.concatenate([block.data for block in came]).astype(np.float64)
    values[(every & (Quality.MISSING | Quality.SUSPECT)) != 0] = np.nan
    marked = np.bitwise_or.reduce(every, axis=1)
    flags = (Quality.GAP, Quality.MISSING, Quality.SUSPECT, Quality.SATURATED)
    return StreamCheck(
        stream=spec.name,
        rows=rows,
        rate_hz=_rate(came),
        nominal_hz=spec.rate_hz,
        lost=ordered.gaps,
        unordered=ordered.duplicates + ordered.late,
        marks={str(flag.name): int(np.count_nonzero(marked & flag)) for flag in flags},
        noise=_noise(spec, values),
        clock=_clock(came),
    )


def _clock(came: Sequence[Block]) -> DeviceClock | None:
    from tactbench.core.recording.clock_fit import ClockFit

    fit = ClockFit()
    for block in came:
        if block.device_ns is None or block.t_ns is None:
            return None
        fit.add(block.device_ns, block.t_ns)
    line = fit.segments()[-1]
    bound_us = None if line.bound_ns is None else line.bound_ns * 1e-3
    return DeviceClock(line.offset_ns * 1e-9, line.drift * 1e6, bound_us, fit.breaks)


def _rate(came: Sequence[Block]) -> float | None:
    """Return rows a second by the host's clock; of a device whose rows come together, from block to block."""
    ends: list[IntArray] = [block.t_ns for block in came if block.t_ns is not None]
    if len(ends) < len(came):
        return None
    rows, began, ended = sum(map(len, ends)), int(ends[0][0]), int(ends[-1][-1])
    if len(ends) > 1:
        rows, began = rows - len(ends[0]), int(ends[0][-1])
    else:
        rows -= 1
    return rows / (ended - began) * 1e9 if ended > began else None


def _noise(spec: StreamSpec, values: FloatArray) -> tuple[Noise, ...]:
    import numpy as np

    groups: dict[tuple[str, str], list[int]] = {}
    for place, channel in enumerate(spec.channels):
        groups.setdefault((channel.kind, channel.unit), []).append(place)
    found = []
    for (kind, unit), places in groups.items():
        columns = {spec.channels[place].name: values[np.isfinite(values[:, place]), place] for place in places}
        good = {name: column for name, column in columns.items() if len(column) > 1}
        sds = {name: float(column.std(ddof=1)) for name, column in good.items()}
        noisiest = max(sds, key=sds.__getitem__, default="")
        found.append(
            Noise(
                kind=kind,
                unit=unit,
                channels=len(places),
                sd_median=float(np.median(list(sds.values()))) if sds else None,
                sd_largest=sds.get(noisiest),
                noisiest=noisiest,
                constant=tuple(name for name, sd in sds.items() if sd == 0),
                means={name: float(column.mean()) for name, column in good.items()},
            )
        )
    return tuple(found)


def _problems(found: StreamCheck) -> list[str]:
    name, sentences = found.stream, []
    if found.rate_hz is not None and found.nominal_hz is not None:
        allowed = RATE_TOLERANCE + 2 / found.rows + 2 * HELD_S * found.rate_hz / found.rows
        if abs(found.rate_hz / found.nominal_hz - 1) > allowed:
            sentences.append(
                f"Stream {name} came at {found.rate_hz:.4g} Hz, stated are {found.nominal_hz:.4g} Hz. "
                "Is the device set up for another rate, or the link too slow for it?"
            )
    wrong = {"lost (host or bus too busy?)": found.lost, "twice or late": found.unordered} | {
        f"{mark} ({_CAUSES[mark]})": 0 if mark == "GAP" and found.lost else number
        for mark, number in found.marks.items()
    }
    if any(wrong.values()):
        counts = ", ".join(f"{number} {what}" for what, number in wrong.items() if number)
        sentences.append(f"Stream {name}, of {found.rows} rows: {counts}.")
    return sentences


_CAUSES = {"GAP": "host or bus too busy?", "MISSING": "a part not connected?", "SUSPECT": "cable, shield, ground?",
           "SATURATED": "is something touching it?"}  # fmt: skip
