"""Checks of the driver of a sensor or another device: on its emulator in virtual time, so that no line is opened."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import CheckFailed, check, code_of, fail, skip
from tactbench.core.conformance.subject import Subject
from tactbench.core.errors import LinkError, RigError, UsageError
from tactbench.core.samples import Quality
from tactbench.core.spec.rig import DeviceDescriptor, SensorDescriptor
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from tactbench.core.samples import Block, FloatArray
    from tactbench.devices.driver import Driver
    from tactbench.devices.emulator import Senses
    from tactbench.links.link import Link

READ_S = 1.0
"""How long a driver is read: hundreds of samples of a fast sensor, some of a slow one."""
WAIT_S = 0.1
WAITED_S = 0.5
"""How long a device that samples by itself is left alone before it is started."""
UNPLUGGED_S = 5.0
"""How long a driver may go on reading once its line is gone: no device is waited for longer."""
GONE_AT_S = 2.0
RATE_SHARE = 0.05
BAD = Quality.MISSING | Quality.SUSPECT
"""Marks of samples whose values say nothing."""
MOST_STILL = 1000
"""Reads that may come back at one moment: of a device that sends a thousand samples at once."""


class Lines:
    """Opens a driver's line and counts: what was opened must be closed."""

    def __init__(self, opener: Any) -> None:
        self._opener = opener
        self.opened: list[Link] = []

    def __call__(self) -> Link:  # noqa: D102  (a driver's `open_link`)
        link: Link = self._opener()
        self.opened.append(link)
        return link

    @property
    def still_open(self) -> int:
        """How many of them are still open."""
        return sum(not link._closed for link in self.opened)


@contextmanager
def emulated(
    subject: Subject, *faults: str, senses: Senses | None = None, **options: Any
) -> Iterator[tuple[Driver, Lines, Any]]:
    """Open the driver on its emulator, in virtual time; yield it, its lines and the clock.

    Parameters
    ----------
    faults
        Of the emulator, as a rig file names them.
    senses
        What the device senses; None: it is at rest.
    options
        Beside those of the emulated device.
    """
    from tactbench.core.plugins.rig_devices import emulated_device, options_of
    from tactbench.core.spec.rig_file import EMULATED, DeviceEntry
    from tactbench.devices.driver import DriverSettings
    from tactbench.devices.emulation.emulated_devices import EmulatedDevices

    descriptor = subject.descriptor
    entry = DeviceEntry(link=EMULATED, faults=faults)
    with code_of("emulator", subject.package):
        device = emulated_device(descriptor, subject.name, entry, senses or _at_rest(descriptor), 1)
    devices = EmulatedDevices({subject.name: device})
    lines = Lines(devices.opener(subject.name))
    given = {**options_of(descriptor, entry), **options}
    streams = () if isinstance(descriptor, DeviceDescriptor) else descriptor.spec.streams
    driver: Driver | None = None
    try:
        with code_of("driver", subject.package):
            driver = subject.code("driver")(DriverSettings(lines, streams, given, devices.clock))
        yield driver, lines, devices.clock
    finally:
        if driver is not None:
            with suppress(Exception):
                driver.close()
        devices.close()


def _at_rest(descriptor: SensorDescriptor | DeviceDescriptor) -> Senses:
    if isinstance(descriptor, DeviceDescriptor):
        return constant({})
    channels = descriptor.spec.channels()
    return constant({one.name: one.rest.to(one.unit) if one.rest is not None else 0.0 for one in channels})


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


def constant(values: Mapping[str, float]) -> Senses:
    """Return what senses the same all the time."""

    def senses(_t_s: float) -> Mapping[str, float]:
        return values

    return senses


def passing(
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


def blocks_of(driver: Driver, clock: Any) -> Iterator[Block]:
    """Yield what a started driver reads within `READ_S`."""
    for _ in passing(clock, READ_S):
        yield from driver.read(WAIT_S)


def marks_of(block: Block) -> npt.NDArray[np.uint8]:
    """Return the (n, channels) marks of a block; one without any is good."""
    import numpy as np

    return np.zeros(block.data.shape, np.uint8) if block.quality is None else block.quality


def rows_of(driver: Driver, clock: Any) -> dict[str, FloatArray]:
    """Return by stream what a started driver reads within `READ_S`: (n, channels), NaN where it is marked as bad."""
    import numpy as np

    rows: dict[str, list[FloatArray]] = {stream.name: [] for stream in driver.streams}
    for block in blocks_of(driver, clock):
        values = np.asarray(block.data, dtype=np.float64)
        rows[block.stream].append(np.where((marks_of(block) & BAD) != 0, np.nan, values))
    return {name: np.concatenate(blocks) for name, blocks in rows.items()}


@check("sensor", "device", needs=("code-names-resolve",), level="silver")
def driver_opens(subject: Subject) -> None:
    """A driver is open once it is made: through the link that it is given, and no other.

    Call settings.open_link() once in the driver's making; give the descriptor an emulator, to try it without a device.
    """
    descriptor = subject.descriptor
    if descriptor.driver is None:
        skip("it names no driver: it can be simulated or replayed, not read")
    if descriptor.emulator is None:
        skip("it names no emulator: only `--rig-file FILE` tries its driver, on a real line")
    if descriptor.emulated_link is None:
        fail("emulated_link", "it names an emulator, and does not say on which kind of link")
    with emulated(subject) as (driver, lines, _):
        for name in ("streams", "counts", "identify", "start", "read", "stop", "close"):
            if not hasattr(driver, name):
                fail("driver", f"it has no {name}; derive it from tactbench.plugin.devices.Driver")
        if len(lines.opened) != 1:
            fail("driver", f"it opened {len(lines.opened)} links, and 1 is given to it")


@check("sensor", "device", needs=("driver-opens",), level="silver")
def driver_says_who_it_is(subject: Subject) -> None:
    """A recording names the device that made it: a model, a serial number, whatever the device says.

    Return a mapping of texts from identify(), an empty one if the device says nothing.
    """
    with emulated(subject) as (driver, _, _), code_of("driver.identify", subject.package):
        said = driver.identify()
        if not all(isinstance(one, str) for pair in dict(said).items() for one in pair):
            fail("driver.identify", f"{dict(said)!r}, and texts by name are needed")


@check("sensor", needs=("driver-opens",), level="silver")
def driver_streams_are_the_specs(subject: Subject) -> None:
    """Recordings of the device and of its twin must have the same columns.

    Return the streams of settings.streams, or those of the spec, from `streams`; only rates may differ.
    """
    own = {stream.name: stream for stream in subject.descriptor.spec.streams}
    with emulated(subject) as (driver, _, _):
        for stream in driver.streams:
            if stream.name not in own:
                fail(f"driver.streams[{stream.name}]", f"the spec has no such stream; it has {', '.join(own)}")
            if stream.channels != own[stream.name].channels:
                fail(f"driver.streams[{stream.name}].channels", "they are not those of the spec")


@check("sensor", "device", needs=("driver-opens", "driver-streams-are-the-specs"), level="silver")
def driver_reads(subject: Subject) -> None:
    """Reading gives blocks of the driver's streams, on the host's clock, with numbers that count on.

    Return Blocks of shape (n, channels) with int64 nanoseconds that never go back.
    """
    with emulated(subject) as (driver, _, clock):
        look_at(subject, driver, clock)


def look_at(subject: Subject, driver: Driver, clock: Any) -> None:
    """Read a driver for a while, and fail where its blocks are not as they must be."""
    import numpy as np

    with code_of("driver.start", subject.package):
        driver.start()
    width = {stream.name: len(stream.channels) for stream in driver.streams}
    rows = dict.fromkeys(width, 0)
    last: dict[tuple[str, str], int] = {}
    for _ in passing(clock, READ_S):
        with code_of("driver.read", subject.package):
            blocks = driver.read(WAIT_S)
        for block in blocks:
            if block.stream not in width:
                fail("driver.read", f"a block of {block.stream!r}, which is none of its streams")
            if np.shape(block.data) != (len(block.data), width[block.stream]):
                fail("driver.read", f"a block of {block.stream} has shape {np.shape(block.data)}")
            rows[block.stream] += len(block.data)
            values = np.asarray(block.data, dtype=np.float64)
            if not np.isfinite(values[(marks_of(block) & BAD) == 0]).all():
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
    with emulated(subject, senses=constant(sensed)) as (driver, _, clock):
        driver.start()
        rows = rows_of(driver, clock)
        for stream in driver.streams:
            # The first samples may be from before.
            read = np.nanmedian(rows[stream.name], axis=0)
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


@check("sensor", "device", needs=("driver-reads",), level="silver")
def driver_keeps_its_rate(subject: Subject) -> None:
    """A driver that drops or doubles samples shows as another rate than the device has.

    Take everything that has come at each read, and state the rate that the device was set up for in `streams`.
    """
    import numpy as np

    with emulated(subject) as (driver, _, clock):
        driver.start()
        times: dict[str, list[Any]] = {stream.name: [] for stream in driver.streams}
        for block in blocks_of(driver, clock):
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


@check("sensor", "device", needs=("driver-reads",), level="silver")
def driver_starts_afresh(subject: Subject) -> None:
    """What a device sent before the start would be recorded as if it had come then.

    Discard in start() what waits in the link (`Link.discard()`), and forget the beginning of a frame.
    """
    with emulated(subject) as (driver, _, clock):
        for _ in range(2):
            clock.advance(clock() + round(WAITED_S * 1e9))
            began_ns = clock()
            with code_of("driver.start", subject.package):
                driver.start()
            for block in blocks_of(driver, clock):
                if block.t_ns is not None and len(block.t_ns) and block.t_ns[0] < began_ns:
                    early = (began_ns - int(block.t_ns[0])) * 1e-9
                    fail("driver.start", f"a row of {block.stream} is from {early:.2g} s before it was started")
            driver.stop()


@check("sensor", "device", needs=("driver-reads",), level="silver")
def driver_does_not_wait_when_told_so(subject: Subject) -> None:
    """`read(0)` asks without waiting: a rig with several devices reads them in turn.

    Pass the time-out on to the link, and return an empty list when it raises LinkTimeout.
    """
    with emulated(subject) as (driver, _, clock):
        driver.start()
        driver.read(WAIT_S)
        before = clock()
        with code_of("driver.read", subject.package):
            found = [driver.read(0.0) for _ in range(3)]
        if not all(isinstance(one, list) for one in found):
            fail("driver.read", "it returned something else than a list")
        if (clock() - before) * 1e-9 > WAIT_S:
            fail("driver.read", f"read(0) took {(clock() - before) * 1e-9:.2g} s")


@check("sensor", "device", needs=("driver-opens",), level="silver")
def driver_closes_its_line(subject: Subject) -> None:
    """A line that stays open keeps the next run from its device.

    Close the link in close(), also when it was sampling; a second close() does nothing.
    """
    with emulated(subject) as (driver, lines, _):
        driver.start()
        with code_of("driver.close", subject.package):
            driver.close()
        if lines.still_open:
            fail("driver.close", "its link is still open afterwards")
        with code_of("driver.close", subject.package):
            driver.close()


@check("sensor", "device", needs=("driver-reads",), level="silver")
def driver_reports_unplug(subject: Subject) -> None:
    """Nothing that comes and nothing that is there look alike, unless the driver lets the link's error pass.

    Let LinkUnplugged of the link pass through read(); catch LinkTimeout alone.
    """
    with emulated(subject, f"unplug:start_s={GONE_AT_S:g}") as (driver, _, clock):
        with code_of("driver.start", subject.package):
            driver.start()
        try:
            for _ in passing(clock, GONE_AT_S + UNPLUGGED_S, stands="once its line is gone, it does not even wait"):
                driver.read(WAIT_S)
        except CheckFailed:
            raise
        except (LinkError, RigError):
            return
        except Exception as error:
            fail("driver.read", f"{type(error).__name__} instead of LinkUnplugged once the line is gone: {error}")
        fail("driver.read", "it goes on as if nothing had come once its line is gone")


@check("sensor", "device", needs=("driver-opens",), level="silver")
def driver_refuses_unknown_options(subject: Subject) -> None:
    """A misspelt option of a rig file that nobody refuses is a setting that nobody makes.

    Raise UsageError for options that the driver does not know.
    """
    try:
        with emulated(subject, no_such_option=1):
            pass
    except CheckFailed as failure:
        if isinstance(failure.__cause__, UsageError):
            return
        raise
    fail("driver", "it took the option 'no_such_option' without a word")


CHECKS = (
    driver_opens, driver_says_who_it_is, driver_streams_are_the_specs, driver_reads,
    driver_reads_what_is_sensed, driver_keeps_its_rate, driver_starts_afresh,
    driver_does_not_wait_when_told_so, driver_closes_its_line, driver_reports_unplug, driver_refuses_unknown_options,
)  # fmt: skip
