"""The driver against the emulated sensor, in virtual time."""

import math
from collections import deque
from contextlib import contextmanager

import numpy as np
import pytest

from tactbench.plugin import RigError, UsageError
from tactbench.plugin.devices import (
    DriverSettings,
    EmulatorSettings,
    LinkError,
    LinkUnplugged,
    SpiLink,
    SpiReply,
)
from tactbench.sensors.biotac import SPEC
from tactbench.sensors.biotac.codec import CHANNELS
from tactbench.sensors.biotac.driver import BioTacDriver
from tactbench.sensors.biotac.emulator import BioTacFault, Emulator, build_emulator
from tactbench.sensors.biotac.frames import DEFAULT_FRAME

SERIAL = {
    "serial number": "BT-2P-02.2.0-B-11-E-0004",
    "flex version": "B.D",
    "software version": "2.38",
}


class Sensed:
    """What is sensed: a wave of each channel's own, written down word by word."""

    def __init__(self):
        self.words = []

    def __call__(self, t_s):
        self.words.append({n: 2000 + 1500 * math.sin((3 + k) * t_s + k) for k, n in enumerate(CHANNELS)})
        return self.words[-1]

    def frames(self):
        """Return what the words of whole frames read, (n, 44)."""
        read = [round(word[DEFAULT_FRAME[n % 44]]) for n, word in enumerate(self.words)]
        return np.reshape(read[: len(read) // 44 * 44], (-1, 44))


def emulator(sensed, *faults, **options):
    return build_emulator(EmulatorSettings(sensed, np.random.default_rng(1), options, faults))


class Clock:
    """Nanoseconds that pass only while somebody waits."""

    def __init__(self):
        self.now_ns = 10**9

    def __call__(self):
        return self.now_ns


class Adapter(SpiLink):
    """An SPI adapter in virtual time: batches run without the host, a reply is there when its batch is over.

    Replies to batches whose count since the beginning is in `lost` do not come.
    """

    def __init__(self, exchange, clock, *, speed_hz=4_400_000, holds=4, begin_us=0, lost=()):
        super().__init__("spi://virtual", clock)
        self.speed_hz, self.holds = speed_hz, holds
        self.sent = 0
        self.unplugged = False
        self._exchange, self._begin_us, self._lost = exchange, begin_us, set(lost)
        self._free_s = 0.0
        self._replies = deque()

    def send(self, steps):
        number = self._next_number()
        assert len(self._replies) < self.holds
        begin_s = now_s = max(self._free_s, 1e-9 * self._clock())
        data = []
        for step in steps:
            data.append(self._exchange(step.select, step.data, now_s))
            now_s += 8 * len(step.data) / self.speed_hz + 1e-6 * step.pause_us
        self._free_s = now_s
        counter_us = (int(1e6 * begin_s) + self._begin_us) % 2**32
        reply = None if self.sent in self._lost else SpiReply(number, tuple(data), round(1e9 * now_s), counter_us)
        self._replies.append((round(1e9 * now_s), reply))
        self.sent += 1
        return number

    def receive(self, timeout_s):
        self._usable(timeout_s)
        if self.unplugged:
            raise self._unplugged(OSError("pulled"))
        until_ns = self._clock.now_ns + round(1e9 * timeout_s)
        while self._replies and self._replies[0][1] is None and len(self._replies) > 1:
            self._replies.popleft()  # the host hears of it when a later one comes
        if self._replies and self._replies[0][1] is not None and self._replies[0][0] <= until_ns:
            due_ns, reply = self._replies.popleft()
            self._clock.now_ns = max(self._clock.now_ns, due_ns)
            return reply
        self._clock.now_ns = until_ns
        raise self._nothing_came(timeout_s)

    def abandon(self):
        self._replies.clear()

    def _release(self):
        pass


@contextmanager
def virtual(sensed, *faults, options=None, **adapter):
    """A driver in virtual time, its link and its clock."""
    clock = Clock()
    link = Adapter(emulator(sensed, *faults, **(options or {})).exchange, clock, **adapter)
    with BioTacDriver(DriverSettings(lambda: link, SPEC.streams, options or {}, clock)) as driver:
        yield driver, link, clock


def joined(blocks):
    """Blocks of a stream one after the other, by the stream's name."""
    found = {}
    for stream in SPEC.streams:
        parts = [block for block in blocks if block.stream == stream.name]
        if parts:
            keys = ("t_ns", "device_ns", "data", "quality", "sequence")
            columns = {key: [getattr(part, key) for part in parts] for key in keys}
            found[stream.name] = {
                key: None if column[0] is None else np.concatenate(column) for key, column in columns.items()
            }
    return found


def read_frames(driver, frames, timeout_s=2.0):
    """Read until so many frames have come, whole or not."""
    blocks, rows, empty = [], 0, 0
    while rows < frames:
        new = driver.read(timeout_s)
        empty = 0 if new else empty + 1
        assert empty < 10, "nothing comes any more"
        rows += sum(len(block.data) for block in new if block.stream == "electrodes")
        blocks += new
    return joined(blocks)


def assert_sensed(streams, frames):
    """Every sample that is not marked is what was sensed at its word, (n, 44)."""
    places = [DEFAULT_FRAME.index(channel.name) for channel in SPEC.streams[0].channels]
    sensed = {"electrodes": frames[:, places], "vibration": frames[:, 1::2].reshape(-1, 1)}
    for name, stream in streams.items():
        good = stream["quality"] == 0
        assert np.array_equal(stream["data"][good], sensed[name][stream["sequence"]][good])


@pytest.mark.parametrize("speed_hz", [1_000_000, 4_400_000])
def test_the_mean_rate_is_4400_words_a_second(speed_hz):
    sensed = Sensed()
    with virtual(sensed, speed_hz=speed_hz) as (driver, _, clock):
        assert driver.streams == SPEC.streams
        driver.start()
        streams = read_frames(driver, 100)
        assert clock.now_ns == pytest.approx(2e9, rel=1e-4)
        assert driver.counts == {}
    fast = streams["vibration"]
    assert np.array_equal(fast["sequence"], np.arange(2200))
    # A pause is a whole microsecond, so is the counter.
    assert np.abs(np.diff(fast["device_ns"]) - 1e9 / 2200).max() <= 2000.0
    # When a reply came: the end of its frame, up to a microsecond that the counter left out.
    late_ns = fast["t_ns"][21::22] - fast["device_ns"][21::22]
    assert 0 < late_ns.min() <= late_ns.max() < 227_273 + 1000
    assert_sensed(streams, sensed.frames())


def test_the_counter_is_counted_on_over_its_wraps():
    with virtual(Sensed(), begin_us=2**32 - 1_000_000 - 35_000) as (driver, _, _):
        driver.start()
        slow = read_frames(driver, 8)["electrodes"]
        assert driver.counts == {}
    assert slow["device_ns"].min() < 2**32 * 1000 < slow["device_ns"].max()
    assert np.diff(slow["device_ns"]) == pytest.approx(1e7, abs=1000)


def test_a_lost_reply_is_a_gap_and_the_next_frame_is_whole():
    sensed = Sensed()
    with virtual(sensed, lost=[3, 4, 8]) as (driver, _, _):
        driver.start()
        streams = read_frames(driver, 7)
        assert driver.counts == {"batches lost": 3}
    assert streams["electrodes"]["sequence"].tolist() == [0, 1, 2, 5, 6, 7, 9]
    assert not streams["electrodes"]["quality"].any()
    assert len(streams["vibration"]["sequence"]) == 7 * 22
    assert_sensed(streams, sensed.frames())


def test_when_no_reply_comes_it_gives_up_and_goes_on_in_time():
    with virtual(Sensed(), lost=range(2, 6)) as (driver, _, _):
        driver.start()
        slow = read_frames(driver, 6, timeout_s=0.1)["electrodes"]
        counts = driver.counts
    assert counts["batches lost"] == 4
    assert slow["sequence"][:2].tolist() == [0, 1]
    # Where it goes on, numbers go with the time, to half a frame.
    frames = (slow["device_ns"] - slow["device_ns"][0]) / 1e7
    assert np.abs(slow["sequence"] - frames).max() <= 0.5
    # Half a second of patience and four frames, to a time-out of the reads.
    assert 50 <= slow["sequence"][2] - 2 <= 70
    assert counts["frames not requested"] == slow["sequence"][2] - 6
    assert counts["batches late"] == 1


def test_a_host_that_is_late_leaves_a_gap_as_long_as_the_pause():
    sensed = Sensed()
    with virtual(sensed) as (driver, _, clock):
        driver.start()
        before = read_frames(driver, 5)
        clock.now_ns += 500_000_000
        after = read_frames(driver, 10)["electrodes"]
        assert driver.counts == {"batches late": 1, "frames not requested": 46}
    assert before["electrodes"]["sequence"].tolist() == [*range(5)]
    assert after["sequence"][0] == 5
    (gap,) = np.flatnonzero(np.diff(after["sequence"]) > 1)
    assert after["sequence"][gap + 1] - after["sequence"][gap] == 47
    frames = (after["device_ns"] - before["electrodes"]["device_ns"][0]) / 1e7
    assert np.abs(after["sequence"] - frames).max() <= 0.5


def test_stopped_it_reads_nothing_and_begins_anew():
    with virtual(Sensed(), "parity:channels=E5") as (driver, link, _):
        assert driver.read(0.0) == []
        driver.start()
        driver.start()
        read_frames(driver, 3)
        driver.stop()
        assert driver.read(1.0) == []
        sent = link.sent
        driver.start()
        again = read_frames(driver, 2)["electrodes"]
        assert again["sequence"].tolist() == [0, 1]
        assert again["device_ns"][0] >= 1e9 + (sent - 1) * 1e7
        assert driver.counts == {"parity E5": 5}


def test_what_is_asked_while_it_samples_is_refused():
    with virtual(Sensed()) as (driver, _, _):
        assert driver.identify() == SERIAL
        driver.start()
        with pytest.raises(RigError, match="before start"):
            driver.identify()
        driver.stop()
        assert driver.identify() == SERIAL


@pytest.mark.parametrize(
    ("sensor", "read"),
    [
        (Emulator(faults=[BioTacFault("not-connected")]), "ff ff"),
        (Emulator(properties={"serial number": b"NT2P0220B11E0004"}), "4e 54"),
    ],
    ids=["none", "another"],
)
def test_a_sensor_that_is_no_biotac_is_refused_with_its_serial_number(sensor, read):
    link = Adapter(sensor.exchange, Clock())
    with BioTacDriver(DriverSettings(lambda: link)) as driver, pytest.raises(RigError, match=read):
        driver.identify()


def test_another_frame_and_select():
    options = {"frame": "PAC PDC, E1", "select": 6}
    with virtual(Sensed(), options=options) as (driver, _, _):
        slow, fast = driver.streams
        assert [channel.name for channel in slow.channels] == ["E1", "PDC"]
        assert slow.rate_hz == fast.rate_hz == pytest.approx(4400 / 3)
        driver.start()
        streams = read_frames(driver, 500)
        assert driver.counts == {}
    for stream in streams.values():
        assert np.array_equal(stream["sequence"], np.arange(len(stream["sequence"])))
        assert not stream["quality"].any()
        rate_hz = 1e9 * (len(stream["sequence"]) - 1) / np.ptp(stream["device_ns"])
        assert rate_hz == pytest.approx(4400 / 3, rel=1e-4)


def test_with_a_resend_words_of_bad_parity_are_replaced():
    with virtual(Sensed(), "parity:every=7", options={"resends": 1}) as (driver, _, _):
        driver.start()
        streams = read_frames(driver, 10)
        counts = driver.counts
    assert not any(stream["quality"].any() for stream in streams.values())
    bad = {name.removeprefix("parity "): n for name, n in counts.items() if name.startswith("parity ")}
    assert counts == {**{f"parity {k}": n for k, n in bad.items()}, **{f"resent {k}": n for k, n in bad.items()}}
    assert sum(bad.values()) == 63  # of 880 words, the odd ones of every seventh: the others are resends
    assert streams["electrodes"]["sequence"].tolist() == [*range(10)]


def test_an_unplugged_link_ends_the_reading_and_closes():
    with virtual(Sensed()) as (driver, link, _):
        driver.start()
        driver.read(1.0)
        link.unplugged = True
        for _ in range(2):
            with pytest.raises(LinkUnplugged):
                driver.read(1.0)
        driver.stop()
        driver.close()
        driver.close()


def test_options_that_are_none_are_refused_before_the_link_is_opened():
    with pytest.raises(UsageError, match="frame"):
        BioTacDriver(DriverSettings(lambda: pytest.fail("opened"), options={"frame": "E1 E20"}))


@pytest.mark.parametrize(
    ("speed_hz", "options", "said"),
    [(100_000, {}, "100000 Hz"), (500_000, {"resends": 1}, "500000 Hz")],
)
def test_a_clock_that_is_none_for_it_is_refused_and_the_link_closed(speed_hz, options, said):
    link = Adapter(emulator(Sensed()).exchange, Clock(), speed_hz=speed_hz)
    with pytest.raises(RigError, match=said):
        BioTacDriver(DriverSettings(lambda: link, options=options))
    with pytest.raises(LinkError, match="closed"):
        link.receive(0.0)
