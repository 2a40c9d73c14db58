"""Checks of the driver of a sensor or another device: on its emulator in virtual time, so that no line is opened."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import CheckFailed, Subject, check, code_of, fail, skip
from tactbench.core.conformance.press import RATE_SHARE, UNITS_OF_TIME, marks_of, named_unit
from tactbench.core.errors import LinkError, RigError, UsageError
from tactbench.core.samples import Quality
from tactbench.core.spec.rig import DeviceDescriptor
from tactbench.core.spec.rig_file import EMULATED, DeviceEntry
from tactbench.core.spec.sensor import ChannelSpec
from tactbench.devices.driver import Driver, DriverSettings
from tactbench.links.byte_link import ByteLink
from tactbench.links.link import Link, Received

if TYPE_CHECKING:
    import numpy.typing as npt

    from tactbench.core.samples import FloatArray, IntArray
    from tactbench.devices.emulator import Senses

READ_S, WAIT_S, AHEAD_S, SHORT_S = 1.0, 0.1, 0.1, 0.005
"""How long a driver is read, how long one read waits, by how much time goes on between two reads that find several
frames at once, and how long a read takes that does not wait."""
BEFORE_S = 2.0
"""What the host's clock says when a driver is made, so that units of time can be told apart."""
WRAP_ROWS, MOST_WRAP_ROWS = 600, 140_000
"""Rows in which a counter of 8 bits wraps twice; and of 16 bits."""
UNPLUGGED_S, GONE_AT_S = 5.0, 2 * BEFORE_S
MOST_STILL = 1000
"""Reads that may come back at one moment: of a device that sends a thousand samples at once."""
BAD = Quality.MISSING | Quality.SUSPECT
LEVELS = 8
"""Readings by which channels are told apart, evenly over 0.1 to 0.9 of their range: more channels take several
rounds, so that the tolerance follows the spacing however many there are."""
SIZES = (1, 2, 5, 20, 40, 65536)
"""Bytes of the pieces in which a stream comes: parts of frames, and several frames at once."""
DAMAGE_EVERY, DAMAGE = 16, 5
"""Reads after which bytes are damaged, and how many of them are lost, with one of 0xFF in their place."""
LOAD_N, READ_N, OVERLOAD_N, STILL_M = 0.5, 0.02, 1e6, 1e-5
"""Load of a force channel, a step of its converter and its noise, more than any sensor bears, and by how much the
position of a motor at rest may change (assumed: an increment of its drive, twice)."""


class _Pieces(ByteLink):
    """A byte stream that comes in other pieces, after `change` on its way to the driver."""

    def __init__(self, inner: ByteLink, change: Callable[[bytes], bytes]) -> None:
        super().__init__(inner.address, inner._clock)
        self._inner, self._change, self._left = inner, change, Received(b"", 0)
        self._sizes = itertools.cycle(SIZES)

    def timer(self) -> float:
        return self._inner.timer()

    def read(self, timeout_s: float, *, size: int = 65536) -> Received:
        if not self._left.data:
            first = self._inner.read(timeout_s)
            data = self._change(first.data)
            with suppress(LinkError):
                while True:
                    data += self._change(self._inner.read(0.0).data)
            self._left = Received(data, first.t_ns)
        count = min(size, next(self._sizes))
        given, rest = self._left.data[:count], self._left.data[count:]
        self._left = Received(rest, self._left.t_ns)
        return Received(given, self._left.t_ns)

    def write(self, data: bytes) -> None:
        self._inner.write(data)

    def discard(self) -> None:
        self._left = Received(b"", 0)
        self._inner.discard()

    def _release(self) -> None:
        self._inner.close()


class Line:
    """Opens a driver's link and counts: what was opened must be closed."""

    def __init__(self, opener: Any, change: Callable[[bytes], bytes] | None = None) -> None:
        self._opener, self._change = opener, change
        self.opened: list[Link] = []

    def __call__(self) -> Link:  # noqa: D102  (a driver's `open_link`)
        link: Link = self._opener()
        if self._change is not None and isinstance(link, ByteLink):
            link = _Pieces(link, self._change)
        self.opened.append(link)
        return link

    @property
    def still_open(self) -> int:
        """How many of them are still open."""
        return sum(not link._closed for link in self.opened)


@dataclass
class Rows:
    """What was read of one stream."""

    data: list[FloatArray] = field(default_factory=list)
    """NaN where it is marked as missing or suspect."""
    t_ns: list[IntArray] = field(default_factory=list)
    sequence: list[IntArray] = field(default_factory=list)
    marks: list[npt.NDArray[Any]] = field(default_factory=list)

    def __len__(self) -> int:
        return sum(map(len, self.data))


class Opened:
    """A driver that is open, and how time goes on: on its emulator in virtual time, or by itself."""

    def __init__(
        self, subject: Subject, clock: Callable[[], int], advance: Callable[[int], None], line: Line, driver: Driver
    ) -> None:
        self.subject, self.now_ns, self.line, self.driver = subject, clock, line, driver
        self._advance = advance

    def go_on(self, seconds: float) -> None:
        """Let time go on without a read."""
        self._advance(self.now_ns() + round(seconds * 1e9))

    def start(self) -> None:
        """Start the driver."""
        with code_of("driver.start", self.subject):
            self.driver.start()

    def read(self, seconds: float = READ_S, ahead_s: float = 0.0, rows: int = 0) -> dict[str, Rows]:
        """Read for some time, or until each stream has so many `rows`; look at every block."""
        read = {stream.name: Rows() for stream in self.driver.streams}
        for _ in passing(self.now_ns, seconds):
            self.go_on(ahead_s)
            with code_of("driver.read", self.subject):
                blocks = self.driver.read(WAIT_S)
            take(self.driver, blocks, read)
            if rows and min(map(len, read.values())) >= rows:
                break
        return read


def passing(clock: Callable[[], int], seconds: float) -> Iterator[None]:
    """Yield until so much time of a clock has passed; CheckFailed where it stands still."""
    until_ns, before_ns, still = clock() + round(seconds * 1e9), -1, 0
    while (now_ns := clock()) < until_ns:
        still = still + 1 if now_ns == before_ns else 0
        if still > MOST_STILL:
            fail("driver.read", "time stands still: it returns at once, and nothing is waited for")
        before_ns = now_ns
        yield


def take(driver: Driver, blocks: Any, read: dict[str, Rows]) -> None:
    """Append blocks to what was read; fail where they are not as blocks must be."""
    import numpy as np

    if not isinstance(blocks, list):
        fail("driver.read", f"it returned a {type(blocks).__name__}, and a list of Blocks is needed")
    width = {stream.name: len(stream.channels) for stream in driver.streams}
    for block in blocks:
        if block.stream not in width:
            fail("driver.read", f"a block of {block.stream!r}, which is none of its streams")
        if np.shape(block.data) != (len(block.data), width[block.stream]):
            fail("driver.read", f"a block of {block.stream} has shape {np.shape(block.data)}")
        values, own = np.asarray(block.data, dtype=np.float64), read[block.stream]
        marks = marks_of(block)
        if not np.isfinite(values[(marks & BAD) == 0]).all():
            fail("driver.read", f"a block of {block.stream} holds values that are not finite and not marked")
        own.data.append(np.where((marks & BAD) != 0, np.nan, values))
        own.marks.append(marks)
        for name, found in (("t_ns", own.t_ns), ("sequence", own.sequence)):
            counted = getattr(block, name)
            if counted is not None:
                if np.shape(counted) != (len(block.data),):
                    fail(f"driver.read: {name}", f"shape {np.shape(counted)} for {len(block.data)} rows")
                found.append(np.asarray(counted))


@contextmanager
def emulated(
    subject: Subject, *faults: str, senses: Senses | None = None, change: Any = None, **options: Any
) -> Iterator[Opened]:
    """Open the driver on its emulator.

    Parameters
    ----------
    faults
        Of the emulator, as a rig file names them.
    senses
        What the device senses; None: it is at rest.
    change
        What becomes of pieces on their way to the driver; byte streams then come in pieces of other sizes.
    options
        Beside those of the emulated device.
    """
    from tactbench.core.plugins.rig_devices import emulated_device, options_of
    from tactbench.devices.emulation.emulated_devices import EmulatedDevices

    descriptor = subject.descriptor
    entry = DeviceEntry(link=EMULATED, faults=faults)
    with code_of("emulator", subject):
        device = emulated_device(descriptor, subject.name, entry, senses or (lambda t_s: {}), 1)
    devices = EmulatedDevices({subject.name: device})
    devices.advance(round(BEFORE_S * 1e9))
    line = Line(devices.opener(subject.name), change)
    streams = () if isinstance(descriptor, DeviceDescriptor) else descriptor.spec.streams
    driver: Driver | None = None
    try:
        with code_of("driver", subject):
            given = {**options_of(descriptor, entry), **options}
            driver = subject.code("driver")(DriverSettings(line, streams, given, devices.clock))
        assert driver is not None
        yield Opened(subject, devices.clock, devices.advance, line, driver)
    finally:
        if driver is not None:
            with suppress(Exception):
                driver.close()
        devices.close()


@check("sensor", "device", needs=("code-names-resolve",))
def driver_opens(subject: Subject) -> None:
    """A driver is open once it is made, says who it is, has the spec's streams, and leaves nothing open.

    Call settings.open_link() once in its making and close the link in close(), also when it was sampling; return the
    streams of settings.streams, and texts from identify().
    """
    descriptor = subject.descriptor
    if descriptor.driver is None:
        skip("it names no driver: it can be simulated or replayed, not read")
    if descriptor.emulator is None:
        skip("it names no emulator: only `--rig-file FILE` tries its driver, on a real line")
    if descriptor.emulated_link is None:
        fail("emulated_link", "it names an emulator, and does not say on which kind of link")
    with emulated(subject) as opened:
        driver = opened.driver
        if not isinstance(driver, Driver):
            fail("driver", f"it is a {type(driver).__name__}; derive it from tactbench.plugin.devices.Driver")
        if len(opened.line.opened) != 1:
            fail("driver", f"it opened {len(opened.line.opened)} links, and 1 is given to it")
        with code_of("driver.identify", subject):
            told = dict(driver.identify())
        if not all(isinstance(one, str) for pair in told.items() for one in pair):
            fail("driver.identify", f"{told!r}, and texts by name are needed")
        own = {one.name: one for one in driver.streams if isinstance(descriptor, DeviceDescriptor)}
        own = own or {one.name: one for one in descriptor.spec.streams}
        for stream in driver.streams:
            if stream.name not in own or stream.channels != own[stream.name].channels:
                fail(f"driver.streams[{stream.name}]", f"the spec has no such stream; it has {', '.join(own)}")
        opened.start()
        with code_of("driver.close", subject):
            driver.close()
            driver.close()
        if opened.line.still_open:
            fail("driver.close", "its link is still open afterwards")


@check("sensor", "device", needs=("driver-opens",), carries_out=True)
def driver_reads(subject: Subject) -> None:
    """Rows have the host's time in nanoseconds, and come at the rate that the driver states.

    Stamp with Received.t_ns or settings.clock(), both int64 nanoseconds; take everything that has come at each read,
    and give each row once.
    """
    with emulated(subject) as opened:
        look_at(opened)


def look_at(opened: Opened) -> None:
    """Start a driver, read it for a while, and fail where its times are not as they must be."""
    import numpy as np

    driver, clock = opened.driver, opened.now_ns
    opened.start()
    began_ns = clock()
    found = opened.read()
    seconds = (clock() - began_ns) * 1e-9
    driver.stop()
    for stream in driver.streams:
        rows, where = found[stream.name], f"driver.read: {stream.name}.t_ns"
        if not len(rows):
            fail("driver.read", f"nothing came of its stream {stream.name} within {seconds:g} s")
        if stream.rate_hz is not None and len(rows) > 20:
            rate = len(rows) / seconds
            # A start, and samples that come together, take a few rows.
            if abs(rate / stream.rate_hz - 1) > RATE_SHARE + 5 / len(rows):
                fail(f"driver.streams[{stream.name}].rate_hz", f"{stream.rate_hz:g} Hz is stated, {rate:.4g} Hz came")
        if not rows.t_ns:
            continue
        t_ns = np.concatenate(rows.t_ns)
        for factor, unit in UNITS_OF_TIME.items():
            if 0.9 < t_ns[-1] / factor / clock() < 1.1:
                fail(where, f"it is in {unit}, and nanoseconds are needed")
        if len(t_ns) > 2:
            named_unit(where, float(t_ns[-1] - t_ns[0]) * 1e-9 / seconds)
        if t_ns.dtype != np.int64:
            fail(where, f"it is {t_ns.dtype}, and int64 is needed")
        if (np.diff(t_ns) < 0).any():
            fail(where, "it goes back")
        if abs(int(t_ns[-1]) - clock()) > 1e9 * READ_S:
            off_s = (int(t_ns[-1]) - clock()) * 1e-9
            fail(where, f"it is {off_s:+.3g} s off the host's clock; the device's own belongs into device_ns")


def _reading(one: ChannelSpec, digit: int) -> tuple[float, float]:
    """Return one of the readings by which channels are told apart, with its tolerance; forces have both signs."""
    if one.lower is not None and one.upper is not None:
        step = 0.8 * (one.upper - one.lower) / (LEVELS - 1)
        return float(round(one.lower + step * (digit + 0.875))), step / 4 + 0.5
    if one.kind in ("force", "torque"):
        load = LOAD_N if one.kind == "force" else READ_N
        return load * (digit + 1) * (-1.0) ** digit, 0.04 * load * (digit + 2)
    return (0.0 if one.rest is None else one.rest.to(one.unit)) + digit + 1, 0.25


@check("sensor", "device", needs=("driver-reads",))
def driver_reads_what_is_sensed(subject: Subject) -> None:
    """Swapped channels, bytes in the wrong order, a lost sign or gram-force give plausible readings of something else.

    Decode into the order of the stream's channels and into their units; the emulator must encode what its senses say.
    """
    import numpy as np

    if getattr(subject.descriptor, "kind", "") == "motor":
        skip("what a motor's position is, its rig decides")
    with emulated(subject) as opened:
        streams = {stream.name: list(stream.channels) for stream in opened.driver.streams}
    every = [one for channels in streams.values() for one in channels]
    rounds = 1
    while LEVELS**rounds < len(every):
        rounds += 1
    for place in range(rounds):
        meant = {one.name: _reading(one, number // LEVELS**place % LEVELS) for number, one in enumerate(every)}
        sensed: dict[str, float] = {}
        with emulated(subject, senses=_senses(sensed)) as opened:
            opened.start()
            sensed |= {name: value for name, (value, _) in meant.items()}
            opened.driver.read(WAIT_S)
            found = opened.read()
        for stream, channels in streams.items():
            table = np.concatenate(found[stream].data)
            for channel, value in zip(channels, np.nanmedian(table[len(table) // 2 :], axis=0).tolist(), strict=True):
                expected, near = meant[channel.name]
                if not abs(value - expected) <= near:
                    others = [name for name, (one, within) in meant.items() if abs(value - one) <= within]
                    likely = (
                        f", which is what {others[0]} senses" if others
                        else ": is its sign turned?" if abs(value + expected) <= near
                        else ": are these gram-force?" if channel.unit == "N" and 80 < value / expected < 125
                        else ": are these millinewtons?" if channel.unit == "N" and 800 < value / expected < 1250
                        else ""
                    )  # fmt: skip
                    text = f"{value:.4g} where {expected:g} {channel.unit} are sensed{likely}"
                    fail(f"driver.read: {stream}.{channel.name}", text)


def _senses(sensed: Mapping[str, float]) -> Senses:
    return lambda t_s: sensed


@check("sensor", "device", needs=("driver-reads-what-is-sensed",))
def driver_takes_any_pieces(subject: Subject) -> None:
    """A serial port hands over half a frame or several at once, as the host happens to look.

    Keep what is left of a frame for the next read, and take all frames that are whole.
    """
    if subject.descriptor.emulated_link != "bytes":
        skip("its link hands over whole frames")
    numbers = []
    for change in (None, lambda piece: piece):
        with emulated(subject, change=change) as opened:
            opened.start()
            numbers.append({name: len(rows) for name, rows in opened.read(ahead_s=AHEAD_S).items()})
    for stream, number in numbers[0].items():
        if numbers[1][stream] < 0.9 * number - 2:
            text = f"{numbers[1][stream]} rows of {stream} in {READ_S:g} s where frames come in pieces or several at"
            fail("driver.read", f"{text} once, {number} where each comes whole")


@check("sensor", "device", needs=("driver-takes-any-pieces",))
def driver_drops_damaged_frames(subject: Subject) -> None:
    """Cables lose bytes: a frame that is not whole must not become a reading, nor end the recording.

    Look for the frame's length, end or checksum, leave out what is damaged, find the next beginning, and count it in
    `counts` or mark it as SUSPECT or MISSING.
    """
    import numpy as np

    seen = itertools.count()

    def damaged(data: bytes) -> bytes:
        if len(data) < 2 or next(seen) % DAMAGE_EVERY != DAMAGE_EVERY - 1:
            return data
        middle = len(data) // 2
        return data[:middle] + b"\xff" + data[middle + DAMAGE :]

    with emulated(subject) as opened:
        opened.start()
        sound = {name: np.concatenate(rows.data) for name, rows in opened.read().items()}
    with emulated(subject, change=damaged) as opened:
        opened.start()
        before = dict(opened.driver.counts)
        found = opened.read(2 * READ_S)
        after = dict(opened.driver.counts)
    if next(seen) < DAMAGE_EVERY:
        skip("it sends too little to damage any of it")
    marked = any((marks & BAD).any() for rows in found.values() for marks in rows.marks)
    for stream, rows in found.items():
        if not len(rows):
            fail("driver.read", f"no row of {stream} comes where frames are damaged now and then")
        low, high = sound[stream].min(axis=0), sound[stream].max(axis=0)
        near = 3 * (high - low) + 0.05 * (1 + np.abs(high)) + 3
        table = np.concatenate(rows.data)
        wrong = np.argwhere((table < low - near) | (table > high + near))
        if len(wrong):
            value = table[tuple(wrong[0])]
            fail(f"driver.read: {stream}", f"a frame that lost {DAMAGE} bytes is taken for a whole one: {value:g}")
    if after == before and not marked:
        fail("driver.counts", "frames were damaged, and neither counted nor marked")


@check("sensor", "device", needs=("driver-reads",))
def driver_counts_on(subject: Subject) -> None:
    """A device's counter wraps; numbers that begin again with it look like rows that come late, and are left out.

    Count on over the wraps: tactbench.plugin.devices.Unwrap(bits).
    """
    with emulated(subject) as opened:
        opened.start()
        rates = [stream.rate_hz or 100.0 for stream in opened.driver.streams]
        found = opened.read(WRAP_ROWS / min(rates) + READ_S, rows=WRAP_ROWS)
        if not any(rows.sequence for rows in found.values()):
            skip("its device numbers no samples")
        _count_on(found)
        if max(rates) <= 1000 and len(rates) == 1:
            _count_on(opened.read(MOST_WRAP_ROWS / min(rates) + READ_S, ahead_s=1.0, rows=MOST_WRAP_ROWS))


def _count_on(found: dict[str, Rows]) -> None:
    import numpy as np

    for stream, rows in found.items():
        if rows.sequence:
            numbers = np.concatenate(rows.sequence)
            wrong = np.flatnonzero(np.diff(numbers) != 1)
            if len(wrong):
                a, b = numbers[wrong[0]], numbers[wrong[0] + 1]
                fail(f"driver.read: {stream}.sequence", f"{a} is followed by {b}, and no row was lost")


@check("sensor", "device", needs=("driver-reads",))
def driver_starts_afresh(subject: Subject) -> None:
    """What a device sent before the start would be recorded as if it had come then.

    Discard in start() what waits in the link (Link.discard), and forget the beginning of a frame.
    """
    with emulated(subject) as opened:
        for _ in range(2):
            opened.go_on(BEFORE_S)
            began_ns = opened.now_ns()
            opened.start()
            for stream, rows in opened.read().items():
                first_ns = min((int(t_ns[0]) for t_ns in rows.t_ns if len(t_ns)), default=began_ns)
                if first_ns < began_ns:
                    early_s = (began_ns - first_ns) * 1e-9
                    fail("driver.start", f"a row of {stream} is from {early_s:.2g} s before it was started")
            opened.driver.stop()


@check("sensor", "device", needs=("driver-reads",))
def driver_does_not_wait_when_told_so(subject: Subject) -> None:
    """`read(0)` asks without waiting: a rig with several devices reads them in turn.

    Pass the time-out on to the link, and return an empty list when it raises LinkTimeout.
    """
    with emulated(subject) as opened:
        opened.start()
        opened.driver.read(WAIT_S)
        before = opened.now_ns()
        with code_of("driver.read", subject):
            for _ in range(3):
                opened.driver.read(0.0)
        if (opened.now_ns() - before) * 1e-9 > SHORT_S:
            fail("driver.read", f"read(0) took {(opened.now_ns() - before) * 1e-9:.2g} s")


@check("sensor", "device", needs=("driver-reads",))
def driver_reports_unplug(subject: Subject) -> None:
    """Nothing that comes and nothing that is there look alike, unless the driver lets the link's error pass.

    Let LinkUnplugged of the link pass through read(); catch LinkTimeout alone.
    """
    with emulated(subject, f"unplug:start_s={GONE_AT_S:g}") as opened:
        opened.start()
        try:
            for _ in passing(opened.now_ns, GONE_AT_S - BEFORE_S + UNPLUGGED_S):
                opened.driver.read(WAIT_S)
        except CheckFailed:
            pass
        except (LinkError, RigError):
            return
        except Exception as error:
            fail("driver.read", f"{type(error).__name__} instead of LinkUnplugged once the line is gone: {error}")
        fail("driver.read", "it goes on as if nothing had come once its line is gone")


@check("sensor", "device", needs=("driver-opens",))
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


def _channels(subject: Subject, device: str, kind: str) -> dict[str, tuple[str, int, ChannelSpec]]:
    """Return stream, column and channel of a device's channels of a kind, by name."""
    if subject.descriptor.kind != device:
        skip(f"it is a {subject.descriptor.kind} device")
    with emulated(subject) as opened:
        found = {
            channel.name: (stream.name, column, channel)
            for stream in opened.driver.streams
            for column, channel in enumerate(stream.channels)
            if channel.kind == kind
        }
    if not found:
        fail("driver.streams", f"none of its channels is of kind {kind}")
    return found


@check("device", needs=("driver-opens",))
def units_are_the_rigs(subject: Subject) -> None:
    """A rig's force loop, its ceilings and every score take forces for newtons, and positions for metres.

    Give force channels unit "N", torques "N*m", a motor's channel `position` "m", and convert.
    """
    kind, unit = ("force", "N") if subject.descriptor.kind == "force" else ("position", "m")
    for name, (stream, _, channel) in _channels(subject, subject.descriptor.kind, kind).items():
        if channel.unit != unit:
            fail(f"driver.streams[{stream}].channels[{name}].unit", f"{channel.unit!r}, and {unit!r} is needed")


@check("device", needs=("driver-reads-what-is-sensed",))
def tare_and_overload_are_true(subject: Subject) -> None:
    """A driver that says it has taken a zero, and has not, presses harder; a sensor at its end reads like any other.

    Return True from tare() only where the device takes its reading as zero; mark its range's end as SATURATED.
    """
    import numpy as np

    forces = _channels(subject, "force", "force")
    sensed: dict[str, float] = {}
    with emulated(subject, senses=_senses(sensed)) as opened:
        opened.start()
        sensed |= dict.fromkeys(forces, LOAD_N)
        opened.read()
        with code_of("driver.tare", subject):
            taken = opened.driver.tare()
        opened.read()
        for name, (stream, column, _) in forces.items() if taken else ():
            found = float(np.nanmedian(np.concatenate(opened.read()[stream].data)[:, column]))
            if abs(found) > 2 * READ_N:
                fail("driver.tare", f"it says that a zero is taken, and {name} reads {found:.4g} N")
        sensed |= dict.fromkeys(forces, OVERLOAD_N)
        opened.read()
        rows = opened.read()
        for name, (stream, column, _) in forces.items():
            marks = np.concatenate(rows[stream].marks)[:, column]
            if not (marks & (Quality.SATURATED | BAD)).all():
                fail(f"driver.read: {stream}.{name}", f"it is not marked SATURATED under {OVERLOAD_N:g} N")


@check("device", needs=("driver-reads", "units-are-the-rigs"))
def opening_and_reading_move_nothing(subject: Subject) -> None:
    """A motor that runs off when its line is opened does so with a finger under it, and no guard is there yet.

    Leave the motor where it is, and without power, in the driver's making, identify(), start() and read().
    """
    import numpy as np

    places = _channels(subject, "motor", "position")
    with emulated(subject) as opened:
        opened.driver.identify()
        opened.start()
        rows = opened.read()
        for name, (stream, column, _) in places.items():
            table = np.concatenate(rows[stream].data)[:, column]
            moved = float(np.ptp(table[np.isfinite(table)])) if np.isfinite(table).any() else 0.0
            if moved > STILL_M:
                fail(f"driver.read: {name}", f"it changes by {1e3 * moved:.3g} mm, and nobody has moved it")
