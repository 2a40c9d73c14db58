"""Checks of a sensor's driver: on its emulator in virtual time, so that no line is opened; or on a real line."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import CheckFailed, check, code_of, fail, skip
from tactbench.core.conformance.subject import Subject
from tactbench.core.errors import LinkError, RigError, TactbenchError, UsageError
from tactbench.core.samples import Quality
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec

if TYPE_CHECKING:
    from tactbench.devices.driver import Driver
    from tactbench.devices.emulator import Senses
    from tactbench.links.link import Link

READ_S = 1.0
"""How long a driver is read: hundreds of samples of a fast sensor, some of a slow one."""
WAIT_S = 0.1
UNPLUGGED_S = 5.0
"""How long a driver may go on reading once its line is gone: no device is waited for longer."""
GONE_AT_S = 2.0
RATE_SHARE = 0.05
MOST_STILL = 1000
"""Reads that may come back at one moment: of a device that sends a thousand samples at once."""


class _Lines:
    """Opens a driver's line and counts: what was opened must be closed."""

    def __init__(self, opener: Any) -> None:
        self._opener = opener
        self.opened: list[Link] = []

    def __call__(self) -> Link:
        link: Link = self._opener()
        self.opened.append(link)
        return link

    @property
    def still_open(self) -> int:
        return sum(not link._closed for link in self.opened)


@contextmanager
def _emulated(
    subject: Subject, *faults: str, senses: Senses | None = None, **options: Any
) -> Iterator[tuple[Driver, _Lines, Any]]:
    """Open the driver on its emulator at rest, in virtual time; yield it, its lines and the clock."""
    from tactbench.core.plugins.rig_devices import emulated_device, options_of
    from tactbench.core.spec.rig_file import EMULATED, DeviceEntry
    from tactbench.devices.driver import DriverSettings
    from tactbench.devices.emulation.emulated_devices import EmulatedDevices

    descriptor = subject.descriptor
    entry = DeviceEntry(link=EMULATED, faults=faults)
    with code_of("emulator", subject.package):
        device = emulated_device(descriptor, subject.name, entry, senses or _at_rest(descriptor.spec), 1)
    devices = EmulatedDevices({subject.name: device})
    lines = _Lines(devices.opener(subject.name))
    given = {**options_of(descriptor, entry), **options}
    driver: Driver | None = None
    try:
        with code_of("driver", subject.package):
            driver = subject.code("driver")(DriverSettings(lines, descriptor.spec.streams, given, devices.clock))
        yield driver, lines, devices.clock
    finally:
        if driver is not None:
            with suppress(Exception):
                driver.close()
        devices.close()


def _at_rest(spec: SensorSpec) -> Senses:
    return _constant({one.name: one.rest.to(one.unit) if one.rest is not None else 0.0 for one in spec.channels()})


def _each_its_own(spec: SensorSpec) -> dict[str, float]:
    """Return a reading for each channel, all different within a stream, in the middle of its range."""
    found = {}
    for stream in spec.streams:
        for number, one in enumerate(stream.channels):
            share = 0.3 + 0.4 * (number + 1) / (len(stream.channels) + 1)
            if one.lower is not None and one.upper is not None:
                found[one.name] = float(round(one.lower + share * (one.upper - one.lower)))
            else:
                found[one.name] = (one.rest.to(one.unit) if one.rest is not None else 0.0) + number + 1
    return found


def _constant(values: Mapping[str, float]) -> Senses:

    def senses(_t_s: float) -> Mapping[str, float]:
        return values

    return senses


def _passing(
    clock: Any, seconds: float, stands: str = "time stands still: its emulator answers at once"
) -> Iterator[None]:
    """Yield until so much time of a clock has passed; CheckFailed with `stands` where it does not."""
    until_ns, before_ns, still = clock() + round(seconds * 1e9), -1, 0
    while (now_ns := clock()) < until_ns:
        still = still + 1 if now_ns == before_ns else 0
        if still > MOST_STILL:
            fail("driver.read", stands)
        before_ns = now_ns
        yield


@check("sensor", needs=("code-names-resolve",), level="silver")
def driver_opens(subject: Subject) -> None:
    """A driver is open once it is made: through the link that it is given, and no other.

    Call settings.open_link() once in the driver's making; give the descriptor an emulator, to try it without a device.
    """
    descriptor = subject.descriptor
    if descriptor.driver is None:
        skip("it names no driver: it can be simulated or replayed, not read")
    if descriptor.emulator is None:
        skip("it names no emulator: only `--invasive --rig-file FILE` tries its driver, on a real line")
    if descriptor.emulated_link is None:
        fail("emulated_link", "it names an emulator, and does not say on which kind of link")
    with _emulated(subject) as (driver, lines, _):
        for name in ("streams", "counts", "identify", "start", "read", "stop", "close"):
            if not hasattr(driver, name):
                fail("driver", f"it has no {name}; derive it from tactbench.plugin.devices.Driver")
        if len(lines.opened) != 1:
            fail("driver", f"it opened {len(lines.opened)} links, and 1 is given to it")


@check("sensor", needs=("driver-opens",), level="silver")
def driver_says_who_it_is(subject: Subject) -> None:
    """A recording names the device that made it: a model, a serial number, whatever the device says.

    Return a mapping of texts from identify(), an empty one if the device says nothing.
    """
    with _emulated(subject) as (driver, _, _), code_of("driver.identify", subject.package):
        said = driver.identify()
        if not all(isinstance(one, str) for pair in dict(said).items() for one in pair):
            fail("driver.identify", f"{dict(said)!r}, and texts by name are needed")


@check("sensor", needs=("driver-opens",), level="silver")
def driver_streams_are_the_specs(subject: Subject) -> None:
    """Recordings of the device and of its twin must have the same columns.

    Return the streams of settings.streams, or those of the spec, from `streams`; only rates may differ.
    """
    own = {stream.name: stream for stream in subject.descriptor.spec.streams}
    with _emulated(subject) as (driver, _, _):
        for stream in driver.streams:
            if stream.name not in own:
                fail(f"driver.streams[{stream.name}]", f"the spec has no such stream; it has {', '.join(own)}")
            if stream.channels != own[stream.name].channels:
                fail(f"driver.streams[{stream.name}].channels", "they are not those of the spec")


@check("sensor", needs=("driver-streams-are-the-specs",), level="silver")
def driver_reads(subject: Subject) -> None:
    """Reading gives blocks of the driver's streams, on the host's clock, with numbers that count on.

    Return Blocks of shape (n, channels) with int64 nanoseconds that never go back.
    """
    with _emulated(subject) as (driver, _, clock):
        _look_at(subject, driver, clock)


def _look_at(subject: Subject, driver: Driver, clock: Any) -> None:
    import numpy as np

    with code_of("driver.start", subject.package):
        driver.start()
    width = {stream.name: len(stream.channels) for stream in driver.streams}
    rows = dict.fromkeys(width, 0)
    last: dict[tuple[str, str], int] = {}
    for _ in _passing(clock, READ_S):
        with code_of("driver.read", subject.package):
            blocks = driver.read(WAIT_S)
        for block in blocks:
            if block.stream not in width:
                fail("driver.read", f"a block of {block.stream!r}, which is none of its streams")
            if np.shape(block.data) != (len(block.data), width[block.stream]):
                fail("driver.read", f"a block of {block.stream} has shape {np.shape(block.data)}")
            rows[block.stream] += len(block.data)
            marks = np.zeros(block.data.shape, np.uint8) if block.quality is None else block.quality
            values = np.asarray(block.data, dtype=np.float64)
            if not np.isfinite(values[(marks & (Quality.MISSING | Quality.SUSPECT)) == 0]).all():
                fail("driver.read", f"a block of {block.stream} holds values that are not finite and not marked")
            for field in ("t_ns", "sequence"):
                counted = getattr(block, field)
                if counted is None:
                    continue
                if np.asarray(counted).dtype != np.int64 or np.shape(counted) != (len(block.data),):
                    fail(f"driver.read: {field}", f"{np.asarray(counted).dtype} of shape {np.shape(counted)}")
                before = last.get((block.stream, field))
                if (np.diff(counted) < 0).any() or (before is not None and len(counted) and counted[0] < before):
                    fail(f"driver.read: {field}", f"of {block.stream} goes back")
                if len(counted):
                    last[block.stream, field] = int(counted[-1])
    driver.stop()
    silent = [name for name, number in rows.items() if not number]
    if silent:
        fail("driver.read", f"nothing came of its stream {silent[0]} within {READ_S:g} s")


@check("sensor", needs=("driver-reads",), level="silver")
def driver_reads_what_is_sensed(subject: Subject) -> None:
    """Swapped channels, bytes in the wrong order or a lost sign give plausible readings of something else.

    Decode into the order of the stream's channels and into their units; the emulator must encode what its senses say.
    """
    import numpy as np

    spec = subject.descriptor.spec
    sensed = _each_its_own(spec)
    channels = {one.name: one for one in spec.channels()}
    with _emulated(subject, senses=_constant(sensed)) as (driver, _, clock):
        driver.start()
        rows: dict[str, list[Any]] = {stream.name: [] for stream in driver.streams}
        for _ in _passing(clock, READ_S):
            for block in driver.read(WAIT_S):
                marks = np.zeros(block.data.shape, np.uint8) if block.quality is None else block.quality
                bad = (marks & (Quality.MISSING | Quality.SUSPECT)) != 0
                rows[block.stream].append(np.where(bad, np.nan, np.asarray(block.data, dtype=np.float64)))
        for stream in driver.streams:
            # The first samples may be from before.
            read = np.nanmedian(np.concatenate(rows[stream.name]), axis=0)
            for name, found in zip([one.name for one in stream.channels], read.tolist(), strict=True):
                if abs(found - sensed[name]) > _near(channels[name]):
                    others = [one for one, value in sensed.items() if abs(found - value) <= _near(channels[name])]
                    meant = f", which is what {others[0]} senses" if others else ""
                    fail(f"driver.read: {stream.name}.{name}", f"{found:g} where {sensed[name]:g} is sensed{meant}")


def _near(channel: ChannelSpec) -> float:
    """Return how far a reading may be from what is sensed: a hundredth of the range, or a quarter of a step apart."""
    if channel.lower is None or channel.upper is None:
        return 0.25
    return max(1.0, 0.01 * (channel.upper - channel.lower))


@check("sensor", needs=("driver-reads",), level="silver")
def driver_keeps_its_rate(subject: Subject) -> None:
    """A driver that drops or doubles samples shows as another rate than the device has.

    Take everything that has come at each read, and state the rate that the device was set up for in `streams`.
    """
    import numpy as np

    with _emulated(subject) as (driver, _, clock):
        driver.start()
        times: dict[str, list[Any]] = {stream.name: [] for stream in driver.streams}
        for _ in _passing(clock, READ_S):
            for block in driver.read(WAIT_S):
                if block.t_ns is not None:
                    times[block.stream].append(block.t_ns)
        for stream in driver.streams:
            t_ns = np.concatenate(times[stream.name]) if times[stream.name] else np.zeros(0)
            if stream.rate_hz is None or len(t_ns) < 20:
                continue
            rate = len(t_ns) / READ_S
            # A start, and samples that come together, take a few rows.
            if abs(rate / stream.rate_hz - 1) > RATE_SHARE + 5 / len(t_ns):
                fail(f"driver.streams[{stream.name}].rate_hz", f"{stream.rate_hz:g} Hz is stated, {rate:.4g} Hz came")


@check("sensor", needs=("driver-reads",), level="silver")
def driver_does_not_wait_when_told_so(subject: Subject) -> None:
    """`read(0)` asks without waiting: a rig with several devices reads them in turn.

    Pass the time-out on to the link, and return an empty list when it raises LinkTimeout.
    """
    with _emulated(subject) as (driver, _, clock):
        driver.start()
        driver.read(WAIT_S)
        before = clock()
        with code_of("driver.read", subject.package):
            found = [driver.read(0.0) for _ in range(3)]
        if not all(isinstance(one, list) for one in found):
            fail("driver.read", "it returned something else than a list")
        if (clock() - before) * 1e-9 > WAIT_S:
            fail("driver.read", f"read(0) took {(clock() - before) * 1e-9:.2g} s")


@check("sensor", needs=("driver-opens",), level="silver")
def driver_closes_its_line(subject: Subject) -> None:
    """A line that stays open keeps the next run from its device.

    Close the link in close(), also when it was sampling; a second close() does nothing.
    """
    with _emulated(subject) as (driver, lines, _):
        driver.start()
        with code_of("driver.close", subject.package):
            driver.close()
        if lines.still_open:
            fail("driver.close", "its link is still open afterwards")
        with code_of("driver.close", subject.package):
            driver.close()


@check("sensor", needs=("driver-reads",), level="silver")
def driver_reports_unplug(subject: Subject) -> None:
    """Nothing that comes and nothing that is there look alike, unless the driver lets the link's error pass.

    Let LinkUnplugged of the link pass through read(); catch LinkTimeout alone.
    """
    with _emulated(subject, f"unplug:start_s={GONE_AT_S:g}") as (driver, _, clock):
        with code_of("driver.start", subject.package):
            driver.start()
        try:
            for _ in _passing(clock, GONE_AT_S + UNPLUGGED_S, stands="once its line is gone, it does not even wait"):
                driver.read(WAIT_S)
        except CheckFailed:
            raise
        except (LinkError, RigError):
            return
        except Exception as error:
            fail("driver.read", f"{type(error).__name__} instead of LinkUnplugged once the line is gone: {error}")
        fail("driver.read", "it goes on as if nothing had come once its line is gone")


@check("sensor", needs=("driver-opens",), level="silver")
def driver_refuses_unknown_options(subject: Subject) -> None:
    """A misspelt option of a rig file that nobody refuses is a setting that nobody makes.

    Raise UsageError for options that the driver does not know.
    """
    try:
        with _emulated(subject, no_such_option=1):
            pass
    except CheckFailed as failure:
        if isinstance(failure.__cause__, UsageError):
            return
        raise
    fail("driver", "it took the option 'no_such_option' without a word")


@check("sensor", mode="invasive", level="silver", needs=("code-names-resolve",), may_skip=True)
def real_device_answers(subject: Subject) -> None:
    """The emulator is what the author believes the device to be; only the device knows.

    Look at `tactbench doctor --rig-file FILE` for ports, permissions and what the device says.
    """
    from functools import partial

    from tactbench.core.plugins.rig_devices import options_of
    from tactbench.core.plugins.rig_files import load_rig_file
    from tactbench.devices.driver import DriverSettings
    from tactbench.links.address import open_link

    descriptor = subject.descriptor
    if subject.rig_file is None:
        skip("no rig file is given: `--rig-file FILE` says on which line the device is")
    if descriptor.driver is None:
        skip("it names no driver")
    file = load_rig_file(subject.rig_file, subject.registry)
    if subject.name not in file.sensors:
        fail(f"{subject.rig_file}: sensors", f"it has no entry for {subject.name}")
    entry = file.sensors[subject.name]
    if entry.emulated:
        skip("the rig file says that the device is emulated")
    import time

    lines = _Lines(partial(open_link, entry.link))
    with code_of("driver", subject.package):
        options = options_of(descriptor, entry)
        driver = subject.code("driver")(DriverSettings(lines, descriptor.spec.streams, options))
    try:
        with code_of("driver.identify", subject.package):
            driver.identify()
        _look_at(subject, driver, time.monotonic_ns)
    finally:
        with suppress(TactbenchError):
            driver.close()
    if lines.still_open:
        fail("driver.close", "its link is still open afterwards")


@check("rig", mode="invasive", level="silver", needs=("code-names-resolve",), may_skip=True)
def real_rig_presses(subject: Subject) -> None:
    """A rig of real devices shows only by a press whether it gives what tasks need.

    Look at `tactbench rig check FILE` for limits, and at the message for what is missing.
    """
    from tactbench.core.conformance.press import carried_out, effects_for, tiny_scene
    from tactbench.core.plugins.interfaces import RigContext
    from tactbench.core.plugins.rig_files import load_rig_file

    if subject.rig_file is None:
        skip("no rig file is given: `--rig-file FILE` says which devices it has")
    file = load_rig_file(subject.rig_file, subject.registry)
    sensor = subject.registry.sensors[next(iter(file.sensors))]
    indenters = tuple(subject.registry.indenters)
    context = RigContext(effects=effects_for(subject), indenters=indenters, rig_file=file, operator=_Present())
    with code_of("where", subject.package):
        made = carried_out(subject.code("where")(context), subject.descriptor, sensor, tiny_scene(), 1)
    for stream in made.every_stream:
        if not sum(len(one.data) for one in made.blocks if one.stream == stream.name):
            fail(f"streams[{stream.name}]", "the press gave no sample of it")
        values = made.values(stream.name)
        if not math.isfinite(float(abs(values).max())):
            fail(f"streams[{stream.name}]", "it holds values that are not finite")


class _Present:
    """Somebody who was asked before the check began."""

    def asked(self, text: str) -> None:
        """Print what is to be done."""
        print(text)


CHECKS = (
    driver_opens, driver_says_who_it_is, driver_streams_are_the_specs, driver_reads,
    driver_reads_what_is_sensed, driver_keeps_its_rate,
    driver_does_not_wait_when_told_so, driver_closes_its_line, driver_reports_unplug, driver_refuses_unknown_options,
    real_device_answers, real_rig_presses,
)  # fmt: skip
