"""Checks of a driver of a sensor or another device, run on its emulator in virtual time: no real link is opened."""

from __future__ import annotations

import itertools
import math
import re
import struct
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tactbench.core.conformance.check import CheckFailed, Subject, check, code_of, fail, skip
from tactbench.core.conformance.streams import (
    BAD,
    LEAST_ROWS,
    good,
    joined,
    likely,
    limits_of,
    marks_of,
    times_are_right,
)
from tactbench.core.errors import LinkError, RigError, UsageError
from tactbench.core.samples import Block, Quality, StreamData
from tactbench.core.spec.rig import DeviceDescriptor
from tactbench.core.spec.rig_file import EMULATED, DeviceEntry
from tactbench.core.spec.sensor import ChannelSpec
from tactbench.devices.driver import RowDriver
from tactbench.devices.emulation.virtual_time import EmulatedDevices
from tactbench.devices.emulator import Senses
from tactbench.devices.rig_devices import emulated_device, open_driver

# All numbers are assumed.
READ_S, RATED_S, WAIT_S, SHORT_S = 1.0, 3.0, 0.1, 0.005  # a reading; one of the rate; longest wait of a read; no wait
LATE = 0.05  # share by which the times of rows may span more or less than the time that passed
BEFORE_S, GONE_AT_S = 2.0, 10.0  # time of an emulator before its driver is made; time at which the line is unplugged
WRAPS, BEFORE_WRAP = (2**8, 2**16, 2**32), 10  # counts at which counters wrap; samples from the set count to the wrap
WRAP_ROWS = 300  # rows that are read, so that any counter of 8 bits wraps
CLOCK_WRAPS_S = (2**16 * 1e-3, 2**32 * 1e-6)  # wraps of 16 bits in milliseconds, and of 32 in microseconds
CLOCK_SHARE, CLOCK_STEP_S = 0.05, 0.5  # largest difference in rate of a device's clock, and its largest step
LAG_ROWS, LAG_S = 3, 0.02  # largest delay of a step
SLEEP_S, TRIES = 0.02, 8  # wall time of `read(0)` that is a sleep if a processor was less busy; the quickest of 8 reads
MOST_STILL = 1000  # most reads at one moment, of a device that sends many samples at once
LEVELS, MOVING_HZ, STALE = 8, 997.3, 0.1  # levels and frequency of readings; share of equal rows by chance
SIZES, HELD_S, APART_S = (1, 2, 5, 20, 40, 65536), 0.1, 1e-6  # bytes of pieces; time held back; time between pieces
DAMAGE_EVERY, DAMAGE, UNLUCKY = 16, 5, 0.1  # each n-th piece is damaged; bytes it loses; share that may pass a checksum
LOAD_N, READ_N, OVERLOAD_N = 0.5, 0.02, 1e6  # a load; noise and step of a converter; more than any sensor bears
STILL_M = 1e-5  # largest movement of a motor at rest: twice an increment of its drive


class _Adapter:
    """An emulated device behind a serial adapter that delays all bytes except answers, and splits frames anywhere.

    `change` is applied to each piece of bytes that the device sends, before it is split.
    """

    def __init__(self, inner: Any, change: Callable[[bytes], bytes]) -> None:
        self._inner, self._change, self._sizes, self._fed_s = inner, change, itertools.cycle(SIZES), 0.0

    def feed(self, piece: Any, now_s: float) -> Any:
        self._fed_s = now_s
        return self._cut(self._inner.feed(piece, now_s), now_s)

    def poll(self, now_s: float) -> Any:
        return self._cut(self._inner.poll(now_s), now_s)

    def next_s(self) -> float:
        due_s = self._inner.next_s()
        return due_s if due_s < self._fed_s + HELD_S else HELD_S * float(np.ceil(due_s / HELD_S))

    def _cut(self, sent: Any, now_s: float) -> Any:
        data, pieces = b"".join(self._change(piece) for _, piece in sent), list[Any]()
        while data:
            size = next(self._sizes)
            pieces.append((now_s + APART_S * len(pieces), data[:size]))
            data = data[size:]
        return pieces


class Opened(NamedTuple):
    """An open driver on its emulator in virtual time."""

    subject: Subject
    driver: Any
    devices: EmulatedDevices
    emulator: Any

    def clock(self) -> int:
        """Return the virtual time [ns]."""
        return self.devices.clock()

    def wait(self, seconds: float) -> None:
        """Let virtual time pass."""
        self.devices.advance(self.clock() + round(seconds * 1e9))

    def channels(self) -> list[ChannelSpec]:
        """Return the channels of all streams of the driver."""
        return [channel for stream in self.driver.streams for channel in stream.channels]

    @property
    def slowest_hz(self) -> float:
        """Rate of the slowest stream [Hz]; 100 for a stream without a stated rate."""
        return min(stream.rate_hz or 100.0 for stream in self.driver.streams)

    @property
    def due_s(self) -> float:
        """Time at which the emulator next sends without a request [s]; infinite if it sends nothing by itself."""
        return float(self.emulator.next_s()) if hasattr(self.emulator, "next_s") else math.inf

    def call(self, name: str, *given: Any) -> Any:
        """Call a method of the driver; an error fails the check with the name of the method."""
        with code_of(f"driver.{name}", self.subject):
            return getattr(self.driver, name)(*given)

    def read(self, seconds: float = READ_S) -> dict[str, StreamData]:
        """Read the driver for `seconds`; return the data joined by stream."""
        return joined("driver.read", self.driver.streams, self.blocks(seconds))

    def blocks(self, seconds: float) -> list[Block]:
        """Read the driver for `seconds`; return the blocks received."""
        blocks: list[Block] = []
        until_ns, before_ns, still = self.clock() + round(seconds * 1e9), -1, 0
        while (now_ns := self.clock()) < until_ns:
            still = still + 1 if now_ns == before_ns else 0
            if still > MOST_STILL:
                fail("driver.read", "virtual time does not advance: read() returns at once, without a wait in its link")
            before_ns = now_ns
            blocks += self.call("read", WAIT_S)
        return blocks


@contextmanager
def emulated(
    subject: Subject, *faults: str, senses: Senses = lambda t_s: {}, change: Callable[[bytes], bytes] | None = None,
    started: bool = True, before_s: float = BEFORE_S, of_both: Mapping[str, Any] = MappingProxyType({}), **options: Any,
) -> Iterator[Opened]:  # fmt: skip
    """Open the driver on its emulator, which has run for `before_s` seconds, and start it if `started`.

    `faults` apply to the emulator, `change` to each piece of bytes sent to the driver (their sizes change, too),
    `of_both` are options for driver and emulator, `options` for the driver alone.
    """
    name, entry = subject.name, DeviceEntry(link=EMULATED, faults=faults, options=dict(of_both))
    with code_of("emulator", subject):
        device = emulated_device(subject.descriptor, name, entry, senses, 1)
    if change is not None:
        device = replace(device, emulator=_Adapter(device.emulator, change))
    devices = EmulatedDevices({name: device})
    devices.advance(round(before_s * 1e9))
    entry = entry.model_copy(update={"options": {**of_both, **options}})
    with code_of("driver", subject):
        driver = open_driver(subject.descriptor, entry, devices.clock, devices.opener(name))
    opened = Opened(subject, driver, devices, device.emulator)
    try:
        if started:
            opened.call("start")
        yield opened
    finally:
        with suppress(Exception):
            driver.close()


@check("sensor", "device", needs="code-names-resolve")
def driver_opens(subject: Subject) -> None:
    """A driver opens its link when constructed, reports an identity, has the spec's streams, and closes its link.

    Call settings.open_link() once in the constructor and close the link in close(), also while sampling; return the
    streams of settings.streams, and texts from identify(); raise UsageError for unknown options.
    """
    descriptor = subject.descriptor
    if descriptor.driver is None:
        skip("its descriptor has no driver: the device can be simulated or replayed, not read")
    if descriptor.emulator is None:
        skip("its descriptor has no emulator: the driver can be tried on a real device only, by `tactbench doctor`")
    own = () if isinstance(descriptor, DeviceDescriptor) else descriptor.spec.channels()
    with emulated(subject, started=False) as opened:
        identity = dict(opened.call("identify"))
        if not all(isinstance(one, str) for pair in identity.items() for one in pair):
            fail("driver.identify", f"returned {identity!r}; a dict of names and texts is needed")
        strange = [one.name for one in opened.channels() if own and one not in own]
        if strange:
            fail("driver.streams", f"the channel {strange[0]} is not in the spec")
        opened.call("start")
        with code_of("driver.close: the link could not be opened again after close()", subject):
            opened.driver.close()
            opened.driver.close()
            opened.devices.open_link(subject.name).close()
    try:
        with emulated(subject, started=False, no_such_option=1):
            pass
    except CheckFailed as failure:
        if isinstance(failure.__cause__, UsageError):
            return
        raise
    fail("driver", "the driver accepts an unknown option, 'no_such_option', instead of raising UsageError")


@check("sensor", "device", needs="driver-opens")
def driver_reads(subject: Subject) -> None:
    """Rows have the host's time in nanoseconds, come at the rate that the driver states, and none comes twice.

    Give rows the time Received.t_ns or settings.clock(), both int64 nanoseconds; return all rows received at each read,
    and an empty list if there is no new row: a device that is polled for its last row may send the same row twice.
    """
    every: list[ChannelSpec] = []

    def moving(t_s: float) -> dict[str, float]:
        return {one.name: _reading(one, MOVING_HZ * t_s % 1.0)[0] for one in every}

    with emulated(subject, senses=moving, started=False) as opened:
        every += opened.channels()
        opened.call("start")
        opened.read(WAIT_S)
        began_ns = opened.clock()
        for name, stream in opened.read(RATED_S).items():
            where, ended_ns = f"driver.read: {name}", opened.clock()
            if not len(stream.data):
                fail(where, f"no data came within {RATED_S:g} s")
            times_are_right(where, stream, (ended_ns - began_ns) * 1e-9, LATE, ended_ns)
            _clock_is_right(f"{where}.device_ns", stream)
            again = float((np.diff(stream.data, axis=0) == 0).all(axis=1).mean())
            if again > STALE and not _is_motor(subject):
                fail(where, f"{again:.0%} of the rows repeat the previous row with a new time")


def _clock_is_right(where: str, stream: StreamData) -> None:
    """Fail the check if the device's clock is not in nanoseconds, differs in rate from the host's clock, or jumps."""
    if stream.device_ns is None or stream.t_ns is None or len(stream.t_ns) < LEAST_ROWS:
        return
    host_s, device_s = (1e-9 * (one - one[0]).astype(np.float64) for one in (stream.t_ns, stream.device_ns))
    steps = np.abs(np.diff(device_s) - np.diff(host_s))
    rate = float(np.polyfit(host_s, device_s, 1)[0])
    most = int(np.argmax(steps))
    if steps[most] > CLOCK_STEP_S:
        text = f"rises by {device_s[most + 1] - device_s[most]:.4g} s in {host_s[most + 1] - host_s[most]:.4g} s"
        fail(where, f"the clock {text}: is its counter unwrapped?")
    if abs(rate - 1) > CLOCK_SHARE:
        fail(where, f"the clock counts {rate:.4g} s per second of the host: is it in nanoseconds?")


def _reading(one: ChannelSpec, share: float) -> tuple[float, float]:
    """Return a test reading in a channel's range, `share` (0 to 1) of the way up, and its tolerance."""
    low, span, rounding = 1.0, LEVELS - 1.0, 0.0
    lower, upper = limits_of(one)
    if np.isfinite(upper - lower):
        low, span, rounding = 0.9 * lower + 0.1 * upper, 0.8 * (upper - lower), 1.0
    elif one.kind in ("force", "torque"):
        load = LOAD_N if one.kind == "force" else READ_N
        low, span = -3.7 * load, 8 * load
    elif one.rest is not None:
        low += one.rest.to(one.unit)
    return low + share * span, span / (LEVELS - 1) / 4 + rounding


def _is_motor(subject: Subject) -> bool:
    return getattr(subject.descriptor, "kind", "") == "motor"


@check("sensor", "device", needs="driver-reads")
def driver_reads_what_is_sensed(subject: Subject) -> None:
    """Swapped channels or bytes, a lost sign, a wrong unit or a hidden filter give plausible but wrong readings.

    Decode into the order and units of the stream's channels; the emulator must encode the readings of its senses. State
    the delay of a filter in `link_delay`; return no row before the device's first sample, or mark it as MISSING; keep
    the rows of a block in the order of their time.
    """
    if _is_motor(subject):
        skip("the position of a motor is set by its rig, not by a test reading")
    with emulated(subject, started=False) as opened:
        every, row_s = opened.channels(), max(0.01, 1 / opened.slowest_hz)
    steps_s, batches, stated = list[float](), Counter[str](), getattr(subject.spec, "link_delay", None)

    @cache
    def meant(turn: int) -> dict[str, tuple[float, float]]:
        """Return the expected reading and its tolerance for each channel; any two channels differ in some turn."""
        levels = [(number // LEVELS**turn + 3 * turn) % LEVELS / (LEVELS - 1) for number in range(len(every))]
        return {one.name: _reading(one, level) for one, level in zip(every, levels, strict=True)}

    def senses(t_s: float) -> dict[str, float]:
        return {name: value for name, (value, _) in meant(sum(t_s >= step_s for step_s in steps_s)).items()}

    with emulated(subject, senses=senses) as opened:
        for turn in range(max(3, math.ceil(math.log(len(every), LEVELS)))):
            if turn:
                steps_s.append(1e-9 * opened.clock() + 4 * row_s)
                opened.wait(8 * row_s)  # the step lies in the middle of a block
            blocks = opened.blocks(READ_S + 2 * LAG_ROWS * row_s)
            for block in () if turn else blocks:
                batches[block.stream] = max(batches[block.stream], len(block.data))
            for name, stream in joined("driver.read", opened.driver.streams, blocks).items():
                where, rows_s = f"driver.read: {name}", (LAG_ROWS + batches[name]) / (stream.spec.rate_hz or 1 / row_s)
                _steady(where, stream, meant(turn))
                if not turn:
                    if not _as_meant(stream, meant(0))[0]:
                        fail(where, "the first row is wrong; it may date from before the first sample")
                    continue
                since_s = (0.0 if stream.t_ns is None else 1e-9 * stream.t_ns) - steps_s[-1]
                if (~_as_meant(stream, meant(turn - 1)) & (since_s < -row_s)).any():
                    fail(where, "rows of one block are not in order of time")
                late_s = float(np.where(_as_meant(stream, meant(turn)), 0.0, since_s).max())
                if late_s > rows_s + LAG_S + (0.0 if stated is None else stated.to("s")):
                    fail(where, f"a step is {late_s:.2g} s late: state the delay of a filter in link_delay")


def _steady(where: str, stream: StreamData, meant: Mapping[str, tuple[float, float]]) -> None:
    """Fail unless the readings in the second half of a stream are as expected."""
    for column, channel in enumerate(stream.spec.channels):
        value = float(np.nanmedian(good(stream)[len(stream.data) // 2 :, column]))
        expected, near = meant[channel.name]
        if not abs(value - expected) <= near:
            others = [other for other, (one, within) in meant.items() if abs(value - one) <= within]
            guess = f", which is the reading of {others[0]}" if others else likely(value / expected)
            fail(f"{where}.{channel.name}", f"read {value:.4g}, expected {expected:.4g} {channel.unit}{guess}")


def _as_meant(stream: StreamData, meant: Mapping[str, tuple[float, float]]) -> npt.NDArray[np.bool_]:
    """Return an (n,) array, true for rows in which at least half of the finite readings are as expected."""
    expected, near = np.transpose([meant[one.name] for one in stream.spec.channels])
    off = np.abs(good(stream) - expected)
    return np.asarray((off <= near).sum(axis=1) >= 0.5 * np.isfinite(off).sum(axis=1))


@check("sensor", "device", needs="driver-reads")
def driver_decodes_the_manual(subject: Subject) -> None:
    """A byte order or scale that is wrong in both driver and emulator is detected only by a frame from the manual.

    Copy one frame and its readings from the maker's manual into the descriptor's `manual_frame`.
    """
    frame = subject.descriptor.manual_frame
    if frame is None:
        skip("manual_frame is empty: errors common to driver and emulator remain undetected")
    if subject.descriptor.emulated_link != "bytes":
        skip("its link is not a stream of bytes")
    data = [b""]
    with emulated(subject, change=lambda piece: data[0] or piece) as opened:
        opened.read()
        data[0] = bytes.fromhex(frame.data)
        opened.read(WAIT_S)
        found = {channel.name: good(stream)[-1, column] for stream in opened.read().values() if len(stream.data)
                 for column, channel in enumerate(stream.spec.channels)}  # fmt: skip
    for name, meant in frame.readings.items():
        read = found.get(name, math.nan)
        if not math.isclose(read, meant, rel_tol=1e-6, abs_tol=1e-9):
            fail(f"manual_frame.readings[{name}]", f"expected {meant:g} by the manual, the driver reads {read:g}")


@check("sensor", "device", needs="driver-reads-what-is-sensed")
def driver_takes_any_pieces(subject: Subject) -> None:
    """A serial port may deliver parts of frames or several at once; frames with lost bytes must not become readings.

    Keep the rest of a frame for the next read, and take all whole frames. Check a frame's length, end or checksum, drop
    a damaged one and find the next beginning; count it in `counts` or mark it as SUSPECT.
    """
    if subject.descriptor.emulated_link != "bytes":
        skip("its link delivers whole frames")
    seen, lost = itertools.count(), 0

    def damaged(data: bytes) -> bytes:
        if not lost or len(data) < 2 or next(seen) % DAMAGE_EVERY != DAMAGE_EVERY - 1:
            return data
        return data[: len(data) // 2] + b"\xff" + data[len(data) // 2 + lost :]

    with emulated(subject) as opened:
        sound = opened.read()
    with emulated(subject, change=damaged) as opened:
        cut = opened.read()
        lost, before = DAMAGE, dict(opened.driver.counts)
        found = opened.read(2 * READ_S)
        damages = next(seen) // DAMAGE_EVERY
        noticed = opened.driver.counts != before or not damages
    for name, stream in sound.items():
        where, came, whole, values = f"driver.read: {name}", len(cut[name].data), len(stream.data), good(found[name])
        if came < (0.9 - HELD_S / READ_S) * whole - 2:
            fail(where, f"{came} rows from frames in pieces or several at once, {whole} from whole frames one by one")
        if not len(values):
            fail(where, "no row is read if some frames are damaged")
        low, high = stream.data.min(axis=0), stream.data.max(axis=0)
        near = 3 * (high - low + 1) + 0.05 * np.abs(high)
        wrong = values[((values < low - near) | (values > high + near)).any(axis=1)]
        # A checksum of 8 bits fits a damaged frame once in 256 times.
        if len(wrong) > max(1, UNLUCKY * damages):
            text = f"a frame without {DAMAGE} of its bytes is read as whole: {wrong.flat[np.abs(wrong).argmax()]:g}"
            fail(where, text)
        noticed |= bool(np.isnan(values).any())
    if not noticed:
        fail("driver.counts", "damaged frames were neither counted in `counts` nor marked as SUSPECT")


def _counters(emulator: Any) -> dict[str, int]:
    """Return an emulator's counters by attribute name: whole numbers and the next values of ``itertools.count``."""
    texts = {name: re.fullmatch(r"(?:count\()?(\d+)\)?", repr(one)) for name, one in vars(emulator).items()}
    return {name: int(found[1]) for name, found in texts.items() if found and name != "_rows"}  # the base class's clock


@check("sensor", "device", needs="driver-reads")
def driver_counts_on(subject: Subject) -> None:
    """Counters and clocks of devices overflow to 0; unless unwrapped, later rows seem late and are dropped.

    Unwrap counters of 8, 16 or 32 bits: tactbench.plugin.devices.Unwrap(bits).
    """

    def counted(opened: Opened, seconds: float) -> int:
        """Read, fail if row numbers do not rise by one, and return the number of rows."""
        found = opened.read(seconds)
        for name, stream in found.items():
            for a, b in itertools.pairwise(() if stream.sequence is None else stream.sequence.tolist()):
                if b != a + 1:
                    fail(f"driver.read: {name}.sequence", f"row {a} is followed by row {b}, and no row was lost")
        return max(len(stream.data) for stream in found.values())

    with emulated(subject, started=False) as opened:
        quiet = not math.isfinite(opened.due_s)
        opened.call("start")
        first, before, seconds = opened.read().values(), _counters(opened.emulator), 4 * BEFORE_WRAP / opened.slowest_hz
        clocked, numbered = (any(getattr(one, name) is not None for one in first) for name in ("device_ns", "sequence"))
        if not clocked and not numbered:
            skip("the device has neither sample numbers nor a clock")
        rows, now = counted(opened, WRAP_ROWS / opened.slowest_hz), _counters(opened.emulator)
        moved = [one for one, value in now.items() if abs(value - before.get(one, value) - rows) <= 0.1 * rows]
        for wrap, name in itertools.product(WRAPS, moved if numbered else ()):
            held = vars(opened.emulator)
            held[name] = type(held[name])(wrap - BEFORE_WRAP)
            with suppress(struct.error, OverflowError):  # one of fewer bits
                opened.read(1 / opened.slowest_hz)
                counted(opened, seconds)
    for wraps_s in CLOCK_WRAPS_S if clocked and quiet else ():
        with emulated(subject, before_s=wraps_s - 1.0) as opened:
            for name, stream in opened.read(2.0).items():
                _clock_is_right(f"driver.read: {name}.device_ns", stream)


@check("sensor", "device", needs="driver-reads")
def driver_waits_and_stops(subject: Subject) -> None:
    """A rig reads several devices in turn: a read that takes too long makes the rows of the other devices late.

    Wait only in the link, and no longer than `timeout_s` in all; never sleep. Let the device stop in stop().
    """
    with emulated(subject, started=False) as opened:
        quiet = not math.isfinite(opened.due_s)
        opened.call("start")
        for wait_s in (WAIT_S, WAIT_S, 0.0):
            began_ns = opened.clock()
            opened.call("read", wait_s)
            took_s = (opened.clock() - began_ns) * 1e-9
            if took_s > wait_s + SHORT_S:
                fail("driver.read", f"read({wait_s:g}) took {took_s:.2g} s, longer than its timeout")
        spent = [(time.perf_counter(), time.thread_time())]
        for _ in range(TRIES):
            opened.driver.read(0.0)
            spent.append((time.perf_counter(), time.thread_time()))
        wall_s, busy_s = min(map(tuple, np.diff(spent, axis=0)))
        if wall_s > SLEEP_S and busy_s < wall_s / 2:
            fail("driver.read", f"read(0) sleeps for {wall_s - busy_s:.2g} s; it must return at once")
        opened.call("stop")
        opened.wait(WAIT_S)
        # Of some devices no source says how they are stopped.
        own = getattr(type(opened.driver), "quiet", None)
        if (quiet if own is None else own is not RowDriver.quiet) and math.isfinite(opened.due_s):
            fail("driver.stop", "the device still sends after stop()")


@check("sensor", "device", needs="driver-reads")
def driver_reports_what_happens(subject: Subject) -> None:
    """Data received before start() must be dropped, and an unplugged line must raise an error.

    Discard in start() the data waiting in the link (Link.discard) and any partial frame. Return an empty list from
    read() when the link raises LinkTimeout, and do not catch LinkUnplugged.
    """
    with emulated(subject, f"unplug:start_s={GONE_AT_S:g}", started=False) as opened:
        for _ in range(2):
            opened.wait(BEFORE_S)
            began_ns = opened.clock()
            opened.call("start")
            for name, stream in opened.read().items():
                early_s = 0.0 if stream.t_ns is None else (began_ns - float(stream.t_ns[0])) * 1e-9
                if early_s > 0:
                    fail("driver.start", f"a row of stream {name} has a time {early_s:.2g} s before start()")
            opened.driver.stop()
        opened.call("start")
        try:
            opened.read(GONE_AT_S)
        except CheckFailed as failure:
            if isinstance(failure.__cause__, LinkError | RigError):
                return
            if failure.__cause__ is not None:
                raise
    fail("driver.read", "returns empty lists after the line was unplugged; let LinkUnplugged pass")


@check("device", needs="driver-reads")
def device_is_fit_for_a_rig(subject: Subject) -> None:
    """A rig needs newtons and metres, marks for readings out of range, and a motor at rest until commanded.

    Give force channels unit "N", torques "N*m", a motor's channel `position` "m", and convert. Mark the end of a range
    as SATURATED. Do not move or power a motor in the driver's constructor, identify(), start() and read().
    """
    device, sensed = subject.descriptor.kind, dict[str, float]()
    if device not in ("force", "motor"):
        skip(f"a device of kind {device} is neither force sensor nor motor")
    kind, unit = ("force", "N") if device == "force" else ("position", "m")
    with emulated(subject, senses=lambda t_s: sensed) as opened:
        sensed |= {one.name: OVERLOAD_N for one in opened.channels() if device == one.kind == "force"}
        opened.read()
        own = [(f"driver.read: {name}.{one.name}", one, marks_of(stream)[:, column], good(stream)[:, column])
               for name, stream in opened.read().items() for column, one in enumerate(stream.spec.channels)
               if one.kind == kind]  # fmt: skip
    if not own:
        fail("driver.streams", f"no channel of the device is of kind {kind}")
    for where, channel, marks, values in own:
        if channel.unit != unit:
            fail(f"driver.streams: {channel.name}.unit", f"the unit is {channel.unit!r}, {unit!r} is needed")
        if kind == "force" and not (marks & (Quality.SATURATED | BAD)).all():
            fail(where, f"rows are not marked SATURATED at {OVERLOAD_N:g} N")
        there = values[np.isfinite(values)]  # none before an axis is homed
        if kind == "position" and len(there) and (moved_m := float(np.ptp(there))) > STILL_M:
            fail(where, f"the position changes by {1e3 * moved_m:.3g} mm without a move")
