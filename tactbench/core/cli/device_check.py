"""The devices of a rig file, one by one: does it open, who is it, what does it send while nothing touches it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import TactbenchError
from tactbench.core.samples import Quality

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.samples import Block, FloatArray, IntArray
    from tactbench.core.spec.rig_file import DeviceEntry, RigFile
    from tactbench.core.spec.sensor import StreamSpec
    from tactbench.devices.driver import Driver
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
class StreamCheck:
    """What came of one stream."""

    stream: str
    rows: int
    rate_hz: float | None
    nominal_hz: float | None
    lost: int
    """Rows that never came, by the device's numbers."""
    marks: dict[str, int]
    """Rows with each mark of quality."""
    noise: tuple[Noise, ...]


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
    sensors: Sequence[str],
    *,
    seconds: float,
    clock: Clock,
    open_links: Mapping[str, Callable[[], Link]] | None = None,
) -> list[DeviceCheck]:
    """Open, ask and read each device in turn; what is wrong with one is in its check and ends no other.

    Parameters
    ----------
    sensors
        Those of the file that are looked at.
    seconds
        How long each device is read.
    clock
        The links'.
    open_links
        By an emulated device's name: opens a link to its emulator. Emulated devices that are not here are not opened.

    Notes
    -----
    A motor is opened and asked who it is; it is never started.
    """
    from tactbench.links.address import open_link

    checks = []
    for name, entry in rig_file.entries().items():
        if name in rig_file.sensors and name not in sensors:
            continue
        device = str(getattr(entry, "device", name))
        check = DeviceCheck(name, device, entry.link, entry.emulated)
        checks.append(check)
        opener = (open_links or {}).get(name) if entry.emulated else partial(open_link, entry.link, clock)
        if opener is None:
            check.remarks.append("emulated: there is no device to look at")
            continue
        try:
            _check(check, registry, name in rig_file.sensors, entry, opener, seconds, clock)
        except TactbenchError as error:
            check.problems.append(str(error))
        except Exception as error:  # a driver of others may raise anything
            check.problems.append(f"Its driver raised {type(error).__name__}: {error}. Tell whoever wrote the driver.")
    return checks


def _check(
    check: DeviceCheck,
    registry: Registry,
    is_sensor: bool,
    entry: DeviceEntry,
    opener: Callable[[], Link],
    seconds: float,
    clock: Clock,
) -> None:
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_object
    from tactbench.devices.driver import DriverSettings

    where: str | None
    streams: tuple[StreamSpec, ...] = ()
    moves = False
    if is_sensor:
        sensor = registry.sensors[check.device]
        where, streams = sensor.driver, sensor.spec.streams
    else:
        device = registry.devices[check.device]
        where, moves = device.driver, device.kind == "motor"
    if where is None:
        raise UsageError(f"{check.device} has no driver.", hint="docs/plugins.md says how a sensor names one.")
    settings = DriverSettings(opener, streams, entry.options, clock)
    with load_object(where)(settings) as driver:
        try:
            check.identity = dict(driver.identify())
            if moves:
                check.remarks.append("a motor: not started")
                return
            _read(check, driver, seconds, clock)
        finally:
            check.counts = {name: number for name, number in driver.counts.items() if number}


def _read(check: DeviceCheck, driver: Driver, seconds: float, clock: Clock) -> None:
    driver.start()
    blocks: dict[str, list[Block]] = {stream.name: [] for stream in driver.streams}
    until_ns = clock() + round(seconds * 1e9)
    try:
        while (left_s := (until_ns - clock()) * 1e-9) > 0:
            for block in driver.read(min(READ_S, left_s)):
                if len(block.data):
                    blocks.setdefault(block.stream, []).append(block)
    finally:
        driver.stop()
        specs = {stream.name: stream for stream in driver.streams}
        for name, came in blocks.items():
            if came:
                check.streams.append(_stream_check(specs[name], came))
                check.problems += _problems(check.streams[-1])
            else:
                check.problems.append(
                    f"Nothing came of its stream {name} within {seconds:g} s. "
                    "Is it on, connected to this port, and set to the same speed?"
                )


def _stream_check(spec: StreamSpec, came: Sequence[Block]) -> StreamCheck:
    import numpy as np

    rows = sum(len(block.data) for block in came)
    numbers = [block.sequence for block in came if block.sequence is not None]
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
        lost=max(0, int(numbers[-1][-1] - numbers[0][0]) + 1 - rows) if len(numbers) == len(came) else 0,
        marks={str(flag.name): int(np.count_nonzero(marked & flag)) for flag in flags},
        noise=_noise(spec, values),
    )


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
        sds: dict[str, float] = {}
        means: dict[str, float] = {}
        for place in places:
            good = values[:, place][np.isfinite(values[:, place])]
            if len(good) > 1:
                sds[spec.channels[place].name] = float(good.std(ddof=1))
                means[spec.channels[place].name] = float(good.mean())
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
                means=means,
            )
        )
    return tuple(found)


_MEANING = {
    "GAP": "came after rows that were lost: is the host or the bus too busy?",
    "MISSING": "have a channel without a sample: is every part of the device connected?",
    "SUSPECT": "have a sample that failed its check: look at the cable, its shield and its ground.",
    "SATURATED": "have a channel at its converter's end, with nothing touching it: is something touching it?",
}


def _problems(found: StreamCheck) -> list[str]:
    said = []
    if found.rate_hz is not None and found.nominal_hz is not None:
        allowed = RATE_TOLERANCE + 2 / found.rows + 2 * HELD_S * found.rate_hz / found.rows
        if abs(found.rate_hz / found.nominal_hz - 1) > allowed:
            said.append(
                f"Stream {found.stream} came at {found.rate_hz:.4g} Hz, stated are {found.nominal_hz:.4g} Hz. "
                "Is the device set up for another rate, or the link too slow for it?"
            )
    if found.lost:
        said.append(f"Of stream {found.stream}, {found.lost} rows are lost by its numbers: is the host too busy?")
    said += [
        f"Of stream {found.stream}, {number} of {found.rows} rows {_MEANING[mark]}"
        for mark, number in found.marks.items()
        if number
    ]
    return said


def as_plain(checks: Sequence[DeviceCheck]) -> list[dict[str, Any]]:
    """Return the checks for JSON."""
    from dataclasses import asdict

    return [asdict(check) for check in checks]
