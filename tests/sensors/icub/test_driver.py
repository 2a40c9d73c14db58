"""The fingertip's driver against emulated boards, in virtual time."""

from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import Quality, UsageError
from tactbench.plugin.devices import (
    CanFrame,
    DriverSettings,
    LinkError,
)
from tactbench.sensors.icub import STREAMS
from tactbench.sensors.icub.codec import (
    BoardSetup,
    OldSetup,
    OldSetup2,
    Transmit,
    TriangleSetup,
    read_command,
    skin_frames,
)
from tactbench.sensors.icub.driver import SETTLE_S, FingertipDriver
from tactbench.sensors.icub.emulator import BoardFault
from tests.sensors.icub.emulated import (
    NAMES,
    VirtualLink,
    emulator,
    in_virtual_time,
    joined,
    rising,
)

GOOD, MISSING, SATURATED, SUSPECT = Quality.GOOD, Quality.MISSING, Quality.SATURATED, Quality.SUSPECT


def read_until(driver, link, until_s):
    """Read all samples up to `until_s`, of which there must be one."""
    blocks = []
    while link.now_s < until_s:
        blocks += driver.read(until_s - link.now_s)
    return joined(blocks)


@contextmanager
def started(*given, **options):
    """A driver in virtual time that has been started, and its link."""
    driver, link = in_virtual_time(*given, **options)
    with driver:
        driver.start()
        yield driver, link


def sensed(seconds):
    return [rising(seconds)[name] for name in NAMES]


def test_it_reads_exactly_what_is_sensed():
    with started() as (driver, link):
        assert link.now_s == pytest.approx(SETTLE_S)
        block = read_until(driver, link, 2.51)
        assert driver.counts == {}
    assert block.sequence is block.device_ns is None
    assert len(block.data) == 100
    taken_s = SETTLE_S + 0.02 * np.arange(1, 101)
    # At the end of the head, 135 bits later.
    assert block.t_ns == pytest.approx(1e9 * taken_s + 135e3, abs=2)
    assert block.data.tolist() == [sensed(at_s) for at_s in taken_s]
    assert not block.quality.any()


@given(
    counts=st.lists(st.integers(0, 255), min_size=12, max_size=12),
    no_load=st.integers(1, 254),
    shift=st.integers(0, 7),
    skin_type=st.sampled_from([1, 2]),
)
@settings(max_examples=60, deadline=None)
def test_every_count_comes_through_whatever_the_set_up(counts, no_load, shift, skin_type):
    readings = dict(zip(NAMES, map(float, counts), strict=True))
    with started(lambda _: readings, no_load=no_load, shift=shift, skin_type=skin_type) as (driver, _):
        (block,) = driver.read(1.0)
        assert block.data.tolist() == [counts]
        assert block.quality.tolist() == [[SATURATED if value in (0, 255) else GOOD for value in counts]]


def test_streams_have_the_rate_of_the_set_up():
    for options, rate_hz in (({}, 50.0), ({"period_ms": 40}, 25.0), ({"old_setup": True}, 25.0)):
        driver, _ = in_virtual_time(**options)
        (stream,) = driver.streams
        assert stream.rate_hz == pytest.approx(rate_hz)
        assert stream.channels == STREAMS[0].channels


def told(link):
    """Return commands on the bus: seconds and what they are."""
    found = [(1e-9 * frame.t_ns, read_command(frame)) for frame in link.seen]
    return [(at_s, command[1]) for at_s, command in found if command is not None]


def test_the_set_up_in_order():
    with started(board=3, triangle=2, skin_type=2, period_ms=30, no_load=245, shift=1, cdc_offset=5) as (driver, link):
        driver.stop()
    assert [command for _, command in told(link)] == [
        Transmit(False), BoardSetup(2, 30, 245), TriangleSetup(2, 2, 1, True, 5), Transmit(True), Transmit(False),
    ]  # fmt: skip
    assert [at_s for at_s, _ in told(link)] == pytest.approx([0, 0, 0, SETTLE_S, SETTLE_S], abs=1e-9)
    assert {frame.id & 0xF for frame in link.seen if frame.id >> 8 == 2} == {3}


def test_the_old_set_up():
    # MTB4 firmware takes its own defaults then: type 0, which takes off a share of T7's change, 245 at rest.
    with started(lambda now_s: {**rising(now_s), "T7": 245.0}, triangle=4, old_setup=True) as (driver, link):
        block = read_until(driver, link, 0.99)
        assert [command for _, command in told(link)] == [
            Transmit(False), OldSetup(1, 0x2000), OldSetup2(0, 0x22, 240), Transmit(True),
        ]  # fmt: skip
        # It sends all triangles, every 40 ms; what came before the start is dropped.
        assert np.diff(block.t_ns) == pytest.approx(np.full(11, 40e6), abs=2)
        wanted = [sensed(SETTLE_S + 0.04 * number) for number in range(1, 13)]
        assert block.data.tolist() == [[*row[:6], 245, *row[7:]] for row in wanted]
        assert set(driver.counts) == {"frames of others"}


def test_frames_of_class_3_are_read_with_the_old_set_up():
    with started(old_setup=True, faults=("dropped-frame",)) as (driver, link):
        head, tail = skin_frames(14, 0, range(100, 112), old=True)
        for frame in (head, CanFrame(tail.id, tail.data[:6])):
            link.put(frame)
        (block,) = driver.read(0.001)
        assert block.data.tolist() == [list(range(100, 112))]
        assert driver.counts == {"samples without error word": 1}


def test_identify():
    driver, _ = in_virtual_time()
    assert driver.identify() == {
        "board": "14", "triangle": "0", "model": "MTB4", "firmware": "1.0.1", "protocol": "2.0",
    }  # fmt: skip


def test_a_board_that_does_not_say_its_version_can_be_read():
    driver, link = in_virtual_time(faults=("unplugged:end_s=0.4",))
    assert "model" not in driver.identify()
    assert link.now_s == pytest.approx(0.5)
    driver.start()
    assert len(driver.read(0.1)) == 1


def test_after_the_stop_nothing_comes_and_a_start_begins_anew():
    with started(faults=("dropped-frame:half=tail,start_s=0.6,end_s=0.61",)) as (driver, link):
        read_until(driver, link, 0.7)
        driver.stop()
        driver.stop()
        assert driver.read(1.0) == []
        driver.start()
        begun_s = link.now_s
        block = read_until(driver, link, begun_s + 0.05)
        assert block.data.tolist() == [sensed(begun_s + 0.02), sensed(begun_s + 0.04)]
        assert driver.counts == {"tails missing": 1}  # the pause is no long interval
    driver.close()
    with pytest.raises(LinkError):
        driver.read(0.1)


def ten(*faults):
    """Return samples of ten periods from 0.52 s on, and what was counted; taxels fall by a count a period."""
    with started(faults=faults) as (driver, link):
        return read_until(driver, link, 0.715), driver.counts


HEAD_ONLY = (SUSPECT,) * 7 + (MISSING,) * 5
TAIL_ONLY = (MISSING,) * 7 + (GOOD,) * 5
FAULTS = {
    "dropped-frame:start_s=0.55,end_s=0.57": ({}, 9, {"long intervals": 1}),
    "dropped-frame:half=head,start_s=0.55,end_s=0.59": ({2: TAIL_ONLY, 3: TAIL_ONLY}, 10, {"heads missing": 2}),
    "dropped-frame:half=tail,start_s=0.55,end_s=0.57": ({2: HEAD_ONLY}, 10, {"tails missing": 1}),
    "doubled-frame:half=head,start_s=0.55,end_s=0.57": (
        {2: (SUSPECT,) * 7 + (GOOD,) * 5}, 10, {"frames doubled": 1},
    ),
    "doubled-frame:half=tail,start_s=0.55,end_s=0.57": (
        {3: (GOOD,) * 7 + (SUSPECT,) * 5}, 10, {"frames doubled": 1},
    ),
    "late-answer:half=tail,start_s=0.55,end_s=0.57,delay_s=0.015": (
        {2: (SUSPECT,) * 12}, 10, {"halves far apart": 1},
    ),
    "not-connected:start_s=0.55,end_s=0.57": (
        {2: (MISSING,) * 12}, 10, {"samples not connected": 1} | {f"{name} out of range": 1 for name in NAMES},
    ),
    "no-ack:start_s=0.55,end_s=0.57,channels=T2+T3": (
        {2: (SUSPECT,) + (SUSPECT | SATURATED,) * 2 + (SUSPECT,) * 9}, 10,
        {"samples not acknowledged": 1, "T2 out of range": 1, "T3 out of range": 1},
    ),
    "unplugged:start_s=0.55": ({}, 2, {}),
}  # fmt: skip
"""Fault -> marked samples, how many samples, counts."""


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_ends_as_documented(fault):
    marked, number, counted = FAULTS[fault]
    block, counts = ten(fault)
    usual, none = ten()
    assert none == {}
    assert counts == counted
    assert block.quality.tolist() == [list(map(int, marked.get(row, (GOOD,) * 12))) for row in range(number)]
    # What is not marked is as without the fault, the sample after it included.
    as_usual = dict(zip(usual.t_ns // 20_000_000, usual.data, strict=True))
    for t_ns, values, quality in zip(block.t_ns, block.data, block.quality, strict=True):
        good = quality == GOOD
        assert values[good].tolist() == as_usual[t_ns // 20_000_000][good].tolist()


def test_a_stuck_taxel_stays_where_it_was_and_is_not_marked():
    (block, counts), (usual, _) = ten("stuck-taxel:start_s=0.55,channels=T6"), ten()
    assert counts == {}
    assert not block.quality.any()
    assert block.data[:, 5].tolist() == [*usual.data[:2, 5], *[usual.data[2, 5]] * 8]


def test_a_tail_that_never_comes_holds_nothing_back():
    with started(faults=("dropped-frame:half=tail,start_s=0.51", "unplugged:start_s=0.53")) as (driver, link):
        assert driver.read(0.0205) == []  # the head is there; its tail may still come
        begun_s = link.now_s
        blocks = driver.read(0.02)
        assert link.now_s - begun_s <= 0.0201
        assert [block.quality.tolist() for block in blocks] == [[list(map(int, HEAD_ONLY))]]
        assert blocks[0].data.tolist()[0][:7] == sensed(0.52)[:7]


def test_frames_of_others_are_counted_and_left_out():
    with started() as (driver, link):
        for frame in (
            *skin_frames(14, 1, [9] * 12), *skin_frames(13, 0, [9] * 12), *skin_frames(14, 0, [9] * 12, old=True),
            CanFrame(0x4E0, b"\x40" + bytes(7), extended=True), CanFrame(0x20E, b"\x07\x00\x00"),
        ):  # fmt: skip
            link.put(frame)
        block = read_until(driver, link, 0.55)
        assert driver.counts == {"frames of others": 8}
    assert block.data.tolist() == [sensed(0.52), sensed(0.54)]


def test_its_own_frames_may_come_back():
    class Echoing(VirtualLink):
        def send(self, frame):
            super().send(frame)
            self.put(frame)

    link = Echoing(emulator())
    with FingertipDriver(DriverSettings(lambda: link, STREAMS, {}, link.now_ns)) as driver:
        assert driver.identify()["model"] == "MTB4"
        driver.start()
        assert read_until(driver, link, 0.55).data.tolist() == [sensed(0.52), sensed(0.54)]
        assert driver.counts == {}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"skin_type": 7}, "skin_type"),
        ({"old_setup": True, "period_ms": 20}, "period_ms"),
    ],
)
def test_options_that_cannot_be_are_refused_before_the_link_is_opened(options, said):
    with pytest.raises(UsageError, match=said):
        FingertipDriver(DriverSettings(lambda: pytest.fail("opened"), STREAMS, options))
    with pytest.raises(UsageError, match=said):
        emulator(**options)


@pytest.mark.parametrize("fault", ["unheard-of", "stuck-taxel:channels=T13"])
def test_faults_that_are_none_are_refused(fault):
    with pytest.raises(UsageError):
        BoardFault.parse(fault)
