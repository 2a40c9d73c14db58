"""Checks of the driver of a sensor or another device: on its emulator in virtual time, so that no line is opened."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import CheckFailed, Subject, check, code_of, fail, skip
from tactbench.core.conformance.streams import BAD, good, joined, likely, marks_of, times_are_right
from tactbench.core.errors import LinkError, RigError, UsageError
from tactbench.core.samples import Quality, StreamData
from tactbench.core.spec.rig import DeviceDescriptor
from tactbench.core.spec.rig_file import EMULATED, DeviceEntry
from tactbench.core.spec.sensor import ChannelSpec
from tactbench.devices.driver import Driver, DriverSettings
from tactbench.links.link import Clock, Link

if TYPE_CHECKING:
    from tactbench.core.samples import Block
    from tactbench.devices.emulation.emulated_devices import EmulatedDevices
    from tactbench.devices.emulator import Senses

READ_S, WAIT_S, SHORT_S = 1.0, 0.1, 0.005
"""How long a driver is read, how long one read waits, and how long a read takes that does not wait."""
RATED_S, LATE = 3.0, 0.05
"""How long it is read where rate and noise are looked at; and by which share its times may span more or less."""
BEFORE_S = 2.0
"""What the host's clock says when a driver is made: frames wait before the start."""
WRAPS = ((600, 0.0), (140_000, 1.0))
"""Rows in which a counter of 8 bits wraps twice, and of 16 bits; and seconds between two reads."""
UNPLUGGED_S, GONE_AT_S = 5.0, 2 * BEFORE_S
MOST_STILL = 1000
"""Reads that may come back at one moment: of a device that sends a thousand samples at once."""
LEVELS = 8
"""Readings by which channels are told apart, evenly over the middle of their range: more channels take several rounds,
so that the tolerance follows the spacing however many there are."""
MOVING_HZ, STALE = 997.3, 0.1
"""How fast readings run through their range where no two rows are alike, and the share that may be by chance."""
SIZES, HELD_S, APART_S = (1, 2, 5, 20, 40, 65536), 0.1, 1e-6
"""Bytes of the pieces in which a stream comes: parts of frames, and several frames at once; for how long an adapter
holds them back; and how far apart it hands them over."""
DAMAGE_EVERY, DAMAGE = 16, 5
"""Pieces after which bytes are damaged, and how many of them are lost, with one of 0xFF in their place."""
LOAD_N, READ_N, OVERLOAD_N, STILL_M = 0.5, 0.02, 1e6, 1e-5
"""Load of a force channel, a step of its converter and its noise, more than any sensor bears, and by how much the
position of a motor at rest may change (assumed: an increment of its drive, twice)."""


class _Adapter:
    """An emulated device behind a serial adapter that holds bytes back, and hands them over cut anywhere.

    `change` is what becomes of each of the device's own pieces on the way.
    """

    def __init__(self, inner: Any, change: Callable[[bytes], bytes]) -> None:
        self._inner, self._change, self._sizes = inner, change, itertools.cycle(SIZES)

    def feed(self, piece: Any, now_s: float) -> list[tuple[float, bytes]]:
        return self._cut(self._inner.feed(piece, now_s), now_s)

    def poll(self, now_s: float) -> list[tuple[float, bytes]]:
        return self._cut(self._inner.poll(now_s), now_s)

    def next_s(self) -> float:
        import numpy as np

        return HELD_S * float(np.ceil(self._inner.next_s() / HELD_S))

    def _cut(self, sent: Iterable[tuple[float, bytes]], now_s: float) -> list[tuple[float, bytes]]:
        data = b"".join(self._change(piece) for _, piece in sent)
        pieces = list[tuple[float, bytes]]()
        while data:
            size = next(self._sizes)
            pieces.append((now_s + APART_S * len(pieces), data[:size]))
            data = data[size:]
        return pieces


class Opened:
    """A driver that is open, on its emulator in virtual time or on a real line.

    Attributes
    ----------
    links
        Those that it has opened.
    """

    def __init__(self, subject: Subject, open_link: Callable[[], Link], options: dict[str, Any], clock: Clock) -> None:
        self.subject, self.now_ns, self.links = subject, clock, list[Link]()

        def opened() -> Link:
            self.links.append(open_link())
            return self.links[-1]

        streams = () if isinstance(subject.descriptor, DeviceDescriptor) else subject.descriptor.spec.streams
        with code_of("driver", subject):
            self.driver: Driver = subject.code("driver")(DriverSettings(opened, streams, options, clock))

    def start(self) -> None:
        """Start the driver."""
        with code_of("driver.start", self.subject):
            self.driver.start()

    def read(
        self, seconds: float = READ_S, rows: int = 0, before: Callable[[], object] = lambda: None
    ) -> dict[str, StreamData]:
        """Read for some time, or until each stream has so many `rows`, each time after `before`; return what came."""
        blocks: list[Block] = []
        left = {stream.name: rows for stream in self.driver.streams}
        until_ns, before_ns, still = self.now_ns() + round(seconds * 1e9), -1, 0
        while (now_ns := self.now_ns()) < until_ns and (not rows or max(left.values()) > 0):
            still = still + 1 if now_ns == before_ns else 0
            if still > MOST_STILL:
                fail("driver.read", "time stands still: it returns at once, and nothing is waited for")
            before_ns = now_ns
            before()
            with code_of("driver.read", self.subject):
                came = list(self.driver.read(WAIT_S))
            blocks += came
            for block in came if rows else ():
                left[block.stream] -= len(block.data)
        return joined("driver.read", self.driver.streams, blocks)

    def closed(self) -> None:
        """Close the driver, twice; fail where a link is left open."""
        with code_of("driver.close", self.subject):
            self.driver.close()
            self.driver.close()
        if not all(link._closed for link in self.links):
            fail("driver.close", "its link is still open afterwards")


@contextmanager
def emulated(
    subject: Subject, *faults: str, senses: Senses = lambda t_s: {}, change: Callable[[bytes], bytes] | None = None,
    started: bool = True, **options: Any,
) -> Iterator[tuple[Opened, EmulatedDevices]]:  # fmt: skip
    """Open the driver on its emulator, which has been running for some time, and start it.

    Parameters
    ----------
    faults
        Of the emulator, as a rig file names them.
    senses
        What the device senses; by default it is at rest.
    change
        What becomes of pieces on their way to the driver; byte streams then come in pieces of other sizes.
    options
        Beside those of the emulated device.
    """
    from tactbench.core.plugins.rig_devices import emulated_device, options_of
    from tactbench.devices.emulation.emulated_devices import EmulatedDevices

    name, entry = subject.name, DeviceEntry(link=EMULATED, faults=faults)
    with code_of("emulator", subject):
        device = emulated_device(subject.descriptor, name, entry, senses, 1)
    if change is not None:
        device = replace(device, emulator=_Adapter(device.emulator, change))
    devices = EmulatedDevices({name: device})
    devices.advance(round(BEFORE_S * 1e9))
    given = {**options_of(subject.descriptor, entry), **options}
    opened = Opened(subject, devices.opener(name), given, devices.clock)
    try:
        if started:
            opened.start()
        yield opened, devices
    finally:
        with suppress(Exception):
            opened.driver.close()


@check("sensor", "device", needs=("code-names-resolve",))
def driver_opens(subject: Subject) -> None:
    """A driver is open once it is made, says who it is, has the spec's streams, and leaves nothing open.

    Open settings.open_link() once in its making and close the link in close(), also when it was sampling; return the
    streams of settings.streams, and texts from identify(); raise UsageError for options that it does not know.
    """
    descriptor = subject.descriptor
    if descriptor.driver is None:
        skip("it names no driver: it can be simulated or replayed, not read")
    if descriptor.emulator is None:
        skip("it names no emulator: only `--rig-file FILE` tries its driver, on a real line")
    if descriptor.emulated_link is None:
        fail("emulated_link", "it names an emulator, and does not say on which kind of link")
    with emulated(subject, started=False) as (opened, _):
        with code_of("driver.identify", subject):
            told = dict(opened.driver.identify())
        if not all(isinstance(one, str) for pair in told.items() for one in pair):
            fail("driver.identify", f"{told!r}, and texts by name are needed")
        own = {} if isinstance(descriptor, DeviceDescriptor) else {one.name: one for one in descriptor.spec.streams}
        for stream in opened.driver.streams if own else ():
            if stream.name not in own or stream.channels != own[stream.name].channels:
                fail(f"driver.streams[{stream.name}]", f"the spec has no such stream; it has {', '.join(own)}")
        opened.start()
        opened.closed()
    try:
        with emulated(subject, started=False, no_such_option=1):
            pass
    except CheckFailed as failure:
        if isinstance(failure.__cause__, UsageError):
            return
        raise
    fail("driver", "it took the option 'no_such_option' without a word")


@check("sensor", "device", needs=("driver-opens",), carries_out=True)
def driver_reads(subject: Subject) -> None:
    """Rows have the host's time in nanoseconds, come at the rate that the driver states, and each of them once.

    Stamp with Received.t_ns or settings.clock(), both int64 nanoseconds; take everything that has come at each read,
    and return an empty list where nothing new has: a device that is asked for its last row may give it twice.
    """
    import numpy as np

    every: list[ChannelSpec] = []

    def moving(t_s: float) -> dict[str, float]:
        return {one.name: _reading(one, MOVING_HZ * t_s % 1.0)[0] for one in every}

    with emulated(subject, senses=moving, started=False) as (opened, _):
        every += _channels(opened)
        for name, stream in look_at(opened).items():
            again = float((np.diff(stream.data, axis=0) == 0).all(axis=1).mean())
            if again > STALE and getattr(subject.descriptor, "kind", "") != "motor":
                fail(f"driver.read: {name}", f"{again:.0%} of its rows are the one before once more, with a new time")


def look_at(opened: Opened) -> dict[str, StreamData]:
    """Start a driver, read it for a while, and return what came; fail where its times are not as they must be."""
    opened.start()
    opened.read(WAIT_S)
    began_ns = opened.now_ns()
    found = opened.read(RATED_S)
    ended_ns = opened.now_ns()
    opened.driver.stop()
    for name, stream in found.items():
        if not len(stream.data):
            fail("driver.read", f"nothing came of its stream {name} within {RATED_S:g} s")
        times_are_right(f"driver.read: {name}", stream, (ended_ns - began_ns) * 1e-9, LATE, ended_ns)
    return found


def _channels(opened: Opened, *kinds: str) -> list[ChannelSpec]:
    every = (channel for stream in opened.driver.streams for channel in stream.channels)
    return [one for one in every if not kinds or one.kind in kinds]


def _reading(one: ChannelSpec, share: float) -> tuple[float, float]:
    """Return a reading at some share of the middle of a channel's range, and a tolerance; forces have both signs."""
    low, span, rounding = 1.0, LEVELS - 1.0, 0.0
    if one.lower is not None and one.upper is not None:
        low, span, rounding = 0.9 * one.lower + 0.1 * one.upper, 0.8 * (one.upper - one.lower), 1.0
    elif one.kind in ("force", "torque"):
        load = LOAD_N if one.kind == "force" else READ_N
        low, span = -3.7 * load, 8 * load
    elif one.rest is not None:
        low += one.rest.to(one.unit)
    return low + share * span, span / (LEVELS - 1) / 4 + rounding


@check("sensor", "device", needs=("driver-reads",))
def driver_reads_what_is_sensed(subject: Subject) -> None:
    """Swapped channels, bytes in the wrong order, a lost sign or gram-force give plausible readings of something else.

    Decode into the order of the stream's channels and into their units; the emulator must encode what its senses say.
    """
    import numpy as np

    if getattr(subject.descriptor, "kind", "") == "motor":
        skip("what a motor's position is, its rig decides")
    with emulated(subject, started=False) as (opened, _):
        every = _channels(opened)
    place, sensed = 1, dict[str, float]()
    while place == 1 or place < len(every):
        meant = {one.name: _reading(one, number // place % LEVELS / (LEVELS - 1)) for number, one in enumerate(every)}
        sensed.clear()
        with emulated(subject, senses=lambda t_s, now=sensed: now) as (opened, _):  # type: ignore[misc]
            sensed |= {name: value for name, (value, _) in meant.items()}
            opened.driver.read(WAIT_S)
            found = opened.read()
        for name, stream in found.items():
            for column, channel in enumerate(stream.spec.channels):
                value = float(np.nanmedian(good(stream)[len(stream.data) // 2 :, column]))
                expected, near = meant[channel.name]
                if abs(value - expected) <= near:
                    continue
                others = [other for other, (one, within) in meant.items() if abs(value - one) <= within]
                if others:
                    guess = f", which is what {others[0]} senses"
                elif abs(value + expected) <= near:
                    guess = ": is its sign turned?"
                else:
                    guess = likely(value / expected) if channel.unit == "N" else ""
                text = f"{value:.4g} where {expected:.4g} {channel.unit} are sensed{guess}"
                fail(f"driver.read: {name}.{channel.name}", text)
        place *= LEVELS


@check("sensor", "device", needs=("driver-reads-what-is-sensed",))
def driver_takes_any_pieces(subject: Subject) -> None:
    """A serial port hands over half a frame or several at once, as the host happens to look.

    Keep what is left of a frame for the next read, and take all frames that are whole.
    """
    if subject.descriptor.emulated_link != "bytes":
        skip("its link hands over whole frames")
    numbers = []
    for change in (None, bytes):
        with emulated(subject, change=change) as (opened, _):
            numbers.append({name: len(stream.data) for name, stream in opened.read().items()})
    for name, number in numbers[0].items():
        if numbers[1][name] < 0.9 * number - HELD_S * number / READ_S - 2:
            text = f"{numbers[1][name]} rows of {name} in {READ_S:g} s where frames come in pieces or several at"
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
        return data[: len(data) // 2] + b"\xff" + data[len(data) // 2 + DAMAGE :]

    with emulated(subject) as (opened, _):
        sound = opened.read()
    with emulated(subject, change=damaged) as (opened, _):
        before = dict(opened.driver.counts)
        found = opened.read(2 * READ_S)
        marked = opened.driver.counts != before
    if next(seen) < DAMAGE_EVERY:
        skip("it sends too little to damage any of it")
    for name, stream in found.items():
        if not len(stream.data):
            fail("driver.read", f"no row of {name} comes where frames are damaged now and then")
        low, high = sound[name].data.min(axis=0), sound[name].data.max(axis=0)
        near = 3 * (high - low) + 0.05 * (1 + np.abs(high)) + 3
        values = good(stream)
        wrong = values[(values < low - near) | (values > high + near)]
        if len(wrong):
            fail(f"driver.read: {name}", f"a frame that lost {DAMAGE} bytes is taken for a whole one: {wrong[0]:g}")
        marked |= bool(np.isnan(values).any())
    if not marked:
        fail("driver.counts", "frames were damaged, and neither counted nor marked")


@check("sensor", "device", needs=("driver-reads",))
def driver_counts_on(subject: Subject) -> None:
    """A device's counter wraps; numbers that begin again with it look like rows that come late, and are left out.

    Count on over the wraps: tactbench.plugin.devices.Unwrap(bits).
    """
    import numpy as np

    with emulated(subject) as (opened, devices):
        rates = [stream.rate_hz or 100.0 for stream in opened.driver.streams]
        for rows, ahead_s in WRAPS if max(rates) <= 1000 and len(rates) == 1 else WRAPS[:1]:

            def ahead(seconds: float = ahead_s) -> None:
                devices.advance(devices.clock() + round(seconds * 1e9))

            found = opened.read(rows / min(rates) + READ_S, rows, ahead)
            if all(stream.sequence is None for stream in found.values()):
                skip("its device numbers no samples")
            for name, stream in found.items():
                numbers = np.zeros(0) if stream.sequence is None else stream.sequence
                wrong = np.flatnonzero(np.diff(numbers) != 1)
                if len(wrong):
                    a, b = numbers[wrong[0] : wrong[0] + 2]
                    fail(f"driver.read: {name}.sequence", f"{a} is followed by {b}, and no row was lost")


@check("sensor", "device", needs=("driver-reads",))
def driver_starts_afresh(subject: Subject) -> None:
    """What a device sent before the start would be recorded as if it had come then.

    Discard in start() what waits in the link (Link.discard), and forget the beginning of a frame.
    """
    with emulated(subject, started=False) as (opened, devices):
        for _ in range(2):
            began_ns = devices.clock() + round(BEFORE_S * 1e9)
            devices.advance(began_ns)
            opened.start()
            for name, stream in opened.read().items():
                early_s = 0.0 if stream.t_ns is None else (began_ns - float(stream.t_ns[0])) * 1e-9
                if early_s > 0:
                    fail("driver.start", f"a row of {name} is from {early_s:.2g} s before it was started")
            opened.driver.stop()


@check("sensor", "device", needs=("driver-reads",))
def driver_does_not_wait_when_told_so(subject: Subject) -> None:
    """`read(0)` asks without waiting: a rig with several devices reads them in turn.

    Pass the time-out on to the link, and return an empty list when it raises LinkTimeout.
    """
    with emulated(subject) as (opened, _):
        opened.driver.read(WAIT_S)
        before_ns = opened.now_ns()
        with code_of("driver.read", subject):
            for _ in range(3):
                opened.driver.read(0.0)
        took_s = (opened.now_ns() - before_ns) * 1e-9
        if took_s > SHORT_S:
            fail("driver.read", f"read(0) took {took_s:.2g} s")


@check("sensor", "device", needs=("driver-reads",))
def driver_reports_unplug(subject: Subject) -> None:
    """Nothing that comes and nothing that is there look alike, unless the driver lets the link's error pass.

    Let LinkUnplugged of the link pass through read(); catch LinkTimeout alone.
    """
    error = None
    with emulated(subject, f"unplug:start_s={GONE_AT_S:g}") as (opened, _):
        try:
            opened.read(GONE_AT_S - BEFORE_S + UNPLUGGED_S)
        except CheckFailed as failure:
            error = failure.__cause__
    if error is None:
        fail("driver.read", "it goes on as if nothing had come once its line is gone")
    if not isinstance(error, LinkError | RigError):
        fail("driver.read", f"{type(error).__name__} instead of LinkUnplugged once the line is gone: {error}")


@check("device", needs=("driver-opens",))
def units_are_the_rigs(subject: Subject) -> None:
    """A rig's force loop, its ceilings and every score take forces for newtons, and positions for metres.

    Give force channels unit "N", torques "N*m", a motor's channel `position` "m", and convert.
    """
    kind, unit = {"force": ("force", "N"), "motor": ("position", "m")}.get(subject.descriptor.kind, ("", ""))
    if not kind:
        skip(f"it is a {subject.descriptor.kind} device")
    with emulated(subject, started=False) as (opened, _):
        found = _channels(opened, kind)
    if not found:
        fail("driver.streams", f"none of its channels is of kind {kind}")
    for channel in found:
        if channel.unit != unit:
            fail(f"driver.streams: {channel.name}.unit", f"{channel.unit!r}, and {unit!r} is needed")


@check("device", needs=("driver-reads-what-is-sensed", "units-are-the-rigs"))
def tare_and_overload_are_true(subject: Subject) -> None:
    """A driver that says it has taken a zero, and has not, presses harder; a sensor at its end reads like any other.

    Return True from tare() only where the device takes its reading as zero; mark its range's end as SATURATED.
    """
    import numpy as np

    if subject.descriptor.kind != "force":
        skip("it is no force sensor")
    sensed: dict[str, float] = {}
    with emulated(subject, senses=lambda t_s: sensed) as (opened, _):
        taken = False
        for force_n in (LOAD_N, LOAD_N, OVERLOAD_N):
            sensed |= {one.name: force_n for one in _channels(opened, "force")}
            opened.read()
            for name, stream in opened.read().items():
                forces = np.array([one.kind == "force" for one in stream.spec.channels])
                found = np.abs(np.nanmedian(good(stream)[:, forces], axis=0))
                if taken and force_n == LOAD_N and (found > 2 * READ_N).any():
                    fail("driver.tare", f"it says that a zero is taken, and {found.max():.4g} N are read")
                marked = marks_of(stream)[:, forces] & (Quality.SATURATED | BAD)
                if force_n == OVERLOAD_N and not marked.all():
                    fail(f"driver.read: {name}", f"forces are not marked SATURATED under {OVERLOAD_N:g} N")
            with code_of("driver.tare", subject):
                taken = taken or opened.driver.tare()


@check("device", needs=("driver-reads", "units-are-the-rigs"))
def opening_and_reading_move_nothing(subject: Subject) -> None:
    """A motor that runs off when its line is opened does so with a finger under it, and no guard is there yet.

    Leave the motor where it is, and without power, in the driver's making, identify(), start() and read().
    """
    import numpy as np

    if subject.descriptor.kind != "motor":
        skip("it is no motor")
    with emulated(subject) as (opened, _):
        for name, stream in opened.read().items():
            places = good(stream)[:, [one.kind == "position" for one in stream.spec.channels]]
            moved = float(np.ptp(places[np.isfinite(places).all(axis=1)], axis=0).max(initial=0.0)) if len(places) else 0.0
            if moved > STILL_M:
                fail(f"driver.read: {name}", f"its place changes by {1e3 * moved:.3g} mm, and nobody has moved it")
