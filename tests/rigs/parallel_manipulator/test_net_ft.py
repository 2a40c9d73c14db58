"""Raw data transfer of a Net F/T box: golden vectors, the emulated box, and the driver, in virtual time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.devices.driver import SequenceCheck
from tactbench.plugin import Quality, RigError, UsageError
from tactbench.plugin.devices import DriverSettings, EmulatorSettings, LinkTimeout, LinkUnplugged
from tactbench.rigs.parallel_manipulator.net_ft.driver import (
    AXES,
    Command,
    NetFtDriver,
    NetFtOptions,
    decode_records,
    decode_request,
    encode_record,
    encode_request,
    quality,
)
from tactbench.rigs.parallel_manipulator.net_ft.emulator import DatagramFault, RdtEmulator
from tests.rigs.parallel_manipulator.pumps import VirtualLink, read_for

REQUESTS = [
    ("12 34 00 00 00 00 00 00", (Command.STOP, 0)),
    ("12 34 00 02 00 00 00 00", (Command.START_REALTIME, 0)),
    ("12 34 00 02 00 00 00 0A", (Command.START_REALTIME, 10)),
    ("12 34 00 02 FF FF FF FF", (Command.START_REALTIME, 0xFFFFFFFF)),
]
ZERO = " ".join(["00"] * 24)
# AT-2: bytes, sequences, status, values by 1e6 counts per unit, mark.
RECORDS = [
    (f"00 00 00 01 00 00 00 01 00 00 00 00 {ZERO}", 1, 1, 0, [0] * 6),
    (f"00 00 00 02 00 00 00 08 00 00 00 00 00 0F 42 40 {ZERO[:59]}", 2, 8, 0, [1, 0, 0, 0, 0, 0]),
    (
        "00 00 00 06 00 00 00 24 00 00 00 00 00 BC 61 4E FF 7A 40 08 00 07 A1 20 00 03 D0 90 FF FE 17 B8 00 00 F4 24",
        6, 36, 0, [12.345678, -8.765432, 0.5, 0.25, -0.125, 0.0625],
    ),
    (
        f"00 00 00 07 00 00 00 2B 80 01 00 00 {ZERO[:23]} FE FC 99 C0 {ZERO[:35]}",
        7, 43, 0x80010000, [0, 0, -17, 0, 0, 0],
    ),
    (f"00 00 00 09 00 00 00 39 80 00 00 04 {ZERO}", 9, 57, 0x80000004, [0] * 6),
    (f"00 00 00 0A 00 00 00 40 FF FF FF FF {ZERO}", 10, 64, 0xFFFFFFFF, [0] * 6),
    (
        f"7F FF FF FF 80 00 00 00 00 00 00 00 7F FF FF FF 80 00 00 00 {ZERO[:47]}",
        0x7FFFFFFF, 0x80000000, 0, [2147.483647, -2147.483648, 0, 0, 0, 0],
    ),
    (
        f"00 00 00 00 FF FF FF F7 00 00 00 00 {ZERO[:59]} 00 0F 42 40",
        0, 0xFFFFFFF7, 0, [0, 0, 0, 0, 0, 1],
    ),
]  # fmt: skip
COUNTS = {"counts_per_newton": 1e6, "counts_per_newton_metre": 1e6}
OPTIONS = NetFtOptions(**COUNTS)


@pytest.mark.parametrize(("sent", "request_"), REQUESTS, ids=[sent for sent, _ in REQUESTS])
def test_requests(sent, request_):
    assert encode_request(*request_) == bytes.fromhex(sent)
    assert decode_request(bytes.fromhex(sent)) == request_


@pytest.mark.parametrize(("sent", "rdt", "ft", "status", "values"), RECORDS, ids=[str(row[1]) for row in RECORDS])
def test_records(sent, rdt, ft, status, values):
    ((*head, counts),) = decode_records(bytes.fromhex(sent)).tolist()
    assert head == [rdt, ft, status]
    assert OPTIONS.wrench(counts).tolist() == values
    assert OPTIONS.counts(values).tolist() == list(counts)
    assert encode_record(*head, counts) == bytes.fromhex(sent)


def test_what_is_no_datagram_of_this_protocol_is_rejected():
    for n in (8, 35, 37):
        with pytest.raises(ValueError, match="size"):
            decode_records(bytes(n))
    for other in ("", "12 34 00 00 00 00 00", "12 35 00 02 00 00 00 00", "12 34 00 01 00 00 00 00"):
        assert decode_request(bytes.fromhex(other)) is None


def test_marks_of_a_status():
    good, saturated, suspect = Quality.GOOD, Quality.SATURATED, Quality.SUSPECT
    marks = {0: good, 0x80010000: good, 0x80020000: saturated, 0x80030000: saturated, 0x80000004: suspect,
             0x80000000: suspect, 0x10000: suspect, 1: suspect, 0xFFFFFFFF: saturated | suspect}  # fmt: skip
    assert quality(np.array([*marks], ">u4")).tolist() == [*marks.values()]


# The emulator --------------------------------------------------------------------------------------------------------


def pressed(time_s):
    """Return a wrench that every axis takes part in, within the range of a Nano17."""
    wave = np.sin(2 * np.pi * 3.0 * time_s)
    return (1.0 * wave, -2.0 * wave, -5.0 + wave, 0.01 * wave, -0.02 * wave, 0.003)


def box(wrench=pressed, rate_hz=1000.0, faults=()):
    def senses(time_s):
        return dict(zip(AXES, wrench(time_s), strict=True))

    made = RdtEmulator(EmulatorSettings(senses, np.random.default_rng(1), COUNTS | {"rate_hz": rate_hz}))
    made.faults = list(faults)
    return made


def start(emulator, now_s=0.0):
    return emulator.feed(encode_request(Command.START_REALTIME), now_s)


@pytest.mark.parametrize(("asked", "sent"), [(1000, 1000), (7000, 7000), (3000, 3500), (999, 1000), (1, 1)])
def test_rates_divide_that_of_the_sensor(asked, sent):
    emulator = box(rate_hz=asked)
    assert driver_on(emulator, rate_hz=asked)[0].streams[0].rate_hz == sent
    start(emulator)
    assert len(emulator.poll(1.0)) == sent


def test_a_box_that_is_stopped_sends_nothing():
    emulator = box()
    start(emulator, 1.0)
    assert len(emulator.poll(1.05)) == 50
    emulator.feed(encode_request(Command.STOP), 1.05)
    assert emulator.next_s() == np.inf
    assert emulator.poll(2.0) == []
    assert emulator.feed(b"hello", 2.0) == []


# The driver, in virtual time ------------------------------------------------------------------------------------------


def driver_on(emulator, *, begin_s=100.0, **options):
    """Return a driver and the link in virtual time between it and `emulator`."""
    link = VirtualLink(emulator, begin_s=begin_s)
    return NetFtDriver(DriverSettings(open_link=lambda: link, options=COUNTS | options, clock=link.clock)), link


def through(*faults, seconds=2.0, **more):
    """Return the driver after some time of a box with faults, and the block of that time."""
    emulator = box(faults=faults, **more)
    driver, link = driver_on(emulator, begin_s=0.0)
    driver.start()
    block = read_for(driver, link, seconds - 1 / 7000)  # starting has waited for the first record
    driver.close()
    return driver, block


def test_the_driver_reads_forces_in_newtons_with_both_clocks():
    driver, link = driver_on(box())
    assert driver.identify() == {"rate_hz": "1000", "status": "00000000"}
    driver.start()
    block = read_for(driver, link, 1.0)
    (stream,) = driver.streams
    assert (stream.name, stream.rate_hz, block.stream) == ("force_torque", 1000.0, "force_torque")
    assert [(c.name, c.unit, c.kind) for c in stream.channels] == [
        *((axis, "N", "force") for axis in ("fx", "fy", "fz")),
        *((axis, "N*m", "torque") for axis in ("tx", "ty", "tz")),
    ]
    # The box counts from 1 at time 0; its records are as old as the samples that they hold.
    at_s = block.device_ns / 1e9 - 1 / 7000
    assert np.abs(block.data - np.array([pressed(t) for t in at_s])).max() <= 1e-6
    assert np.abs(block.t_ns / 1e9 - at_s).max() < 2e-9  # Nanoseconds are whole.
    assert block.sequence.tolist() == list(range(1, len(block.data) + 1))
    assert np.diff(block.device_ns).tolist() == [1_000_000] * (len(block.data) - 1)
    assert not block.quality.any()
    assert driver.counts == {}


def test_a_saturated_sensor_is_marked_and_counted():
    driver, block = through(DatagramFault("saturated", 0.5, 1.0))
    saturated = (block.device_ns / 1e9 - 1 / 7000 >= 0.5 - 1e-9) & (block.device_ns / 1e9 - 1 / 7000 < 1.0 - 1e-9)
    assert (block.quality[saturated] == Quality.SATURATED).all()
    assert (block.quality[~saturated] == Quality.GOOD).all()
    assert driver.counts == {"errors": saturated.sum()}


def test_a_box_that_is_silent_or_gone():
    driver, link = driver_on(box(faults=[DatagramFault("dropped", end_s=102.0)]))
    for ask in (driver.identify, driver.start):
        with pytest.raises(LinkTimeout):
            ask()
    driver.stop()
    assert driver.read(0.1) == []
    link.clock.advance(round(102e9))
    driver.start()
    assert driver.read(0.1)[0].sequence[0] == 1
    # Stopped, it sends nothing, and what was under way belongs to nobody.
    link.go(0.01)
    driver.stop()
    driver.start()
    assert driver.read(0.0)[0].sequence[0] == 1
    link.line.gone = True
    with pytest.raises(LinkUnplugged):
        driver.read(0.1)
    driver.close()
    driver.close()


class Joining(RdtEmulator):
    """A box that sends several records in a datagram."""

    joined, several, begin_s = b"", 4, 0.0

    def _on_the_way(self, datagram, at_s):
        if at_s < self.begin_s:
            return super()._on_the_way(datagram, at_s)
        self.joined += datagram
        if len(self.joined) < 36 * self.several:
            return []
        whole, self.joined = self.joined, b""
        return super()._on_the_way(whole, at_s)


def test_several_records_in_a_datagram_are_refused_with_the_length():
    joining = Joining(EmulatorSettings(lambda t: {}, np.random.default_rng(1), COUNTS))
    driver, link = driver_on(joining)
    for ask in (driver.identify, driver.start):
        with pytest.raises(RigError, match="144"):
            ask()
    joining.begin_s, joining.several = link.now_s + 0.5, 7  # somebody changes it while it samples
    driver.start()
    with pytest.raises(RigError, match="252"):
        read_for(driver, link, 5.0)


@pytest.mark.parametrize("again_s", [0.4, 4.0])
def test_a_box_that_is_started_anew_by_another_program_loses_next_to_nothing(again_s):
    emulator = box()
    driver, link = driver_on(emulator, begin_s=0.0)
    driver.start()
    check, kept, again = SequenceCheck(), [], False
    while link.now_s < 6.0:
        if not again and link.now_s > again_s:
            start(emulator, link.now_s)
            again = True
        kept += [block for block in map(check, driver.read(0.02)) if block is not None]
    rows = sum(len(block.data) for block in kept)
    numbers = np.concatenate([block.sequence for block in kept])
    assert (np.diff(numbers) > 0).all()
    assert rows == check.received - check.late
    assert rows > 5900
    lost = check.gaps - check.late  # what the completeness of a recording goes by
    assert 20 <= lost <= 25
    gaps = np.concatenate([block.quality.any(axis=1) if block.quality is not None else np.zeros(len(block.data), bool)
                           for block in kept])  # fmt: skip
    assert gaps.sum() == 1


def test_other_rates_are_refused_with_the_right_one():
    driver, _ = driver_on(box(rate_hz=500), rate_hz=1000)
    with pytest.raises(RigError, match="rate_hz: 500"):
        driver.identify()


@given(st.lists(st.binary(max_size=80), max_size=10))
@settings(max_examples=40)
def test_any_datagrams_are_survived(datagrams):
    emulator = box(rate_hz=1)
    driver, link = driver_on(emulator, rate_hz=1)
    for datagram in datagrams:
        emulator.feed(datagram, link.now_s)
    driver.start()
    driver.read(0.0)
    noise = [datagram for datagram in datagrams if len(datagram) % 36]
    for datagram in noise:
        link.arrive(datagram)
    while link._arrived:
        assert driver.read(0.0) == []
    assert driver.counts == ({"rejected": len(noise)} if noise else {})


@pytest.mark.parametrize("wrong", [{"rate_hz": 8000}, {"counts_per_newton": 0}])
def test_options_that_are_refused(wrong):
    (name,) = wrong
    with pytest.raises(UsageError, match=name):
        driver_on(box(), **wrong)
