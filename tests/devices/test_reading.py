"""Several devices at once, and the queue of each stream: every row is there or counted, and every thread ends."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterable

import numpy as np
import pytest

from tactbench.core.samples import Block, Quality
from tactbench.devices import reading as module
from tactbench.devices.reading import StreamQueue
from tactbench.plugin import RigError, UsageError
from tactbench.plugin.devices import LinkTimeout, Reading, StreamCounts
from tests.devices.numbered import NumberedDriver, numbered, stream_of

WIDE = stream_of("wide", 5000.0, 64)
FORCE = stream_of("force", 1000.0, 6, "float64")


class HandClock:
    """Stands until it is set."""

    def __init__(self) -> None:
        self.now_ns = 0

    def __call__(self) -> int:
        return self.now_ns


@pytest.fixture
def clock() -> HandClock:
    return HandClock()


@pytest.fixture(autouse=True)
def _no_thread_is_left():
    yield
    readers = [thread for thread in threading.enumerate() if thread.name.startswith("reading")]
    for thread in readers:  # one that was to stop before it had read anything may not have noticed yet
        thread.join(1.0)
    assert not [thread.name for thread in readers if thread.is_alive()]


def joined(blocks: Iterable[Block], stream: str) -> tuple[list[int], list[int]]:
    """Numbers of all rows of a stream, and of those marked with a gap; the readings are checked."""
    numbers, marked = [], []
    for block in blocks:
        if block.stream == stream:
            assert (block.data == block.sequence[:, None].astype(block.data.dtype)).all()
            numbers += block.sequence.tolist()
            if block.quality is not None:
                marked += block.sequence[(block.quality & Quality.GAP).all(axis=1)].tolist()
    return numbers, marked


# Rows of a device that loses two and doubles one: first row and length of its datagrams.
PIECES = [(65_000, 500), (65_500, 100), (65_600, 1), (65_600, 1), (65_603, 400), (66_003, 50)]
NUMBERS = [*range(65_000, 65_601), *range(65_603, 66_053)]


def in_virtual_time(clock: HandClock) -> tuple[list[Block], Reading]:
    with numbered(WIDE, clock) as (far, driver):
        due = [(7_000_000 * k, piece) for k, piece in enumerate(PIECES, 1)]

        def advance(to_ns: int) -> None:
            while due and due[0][0] <= to_ns:
                clock.now_ns, piece = due.pop(0)
                far.send(*piece)
            clock.now_ns = to_ns

        with Reading({"device": driver}, clock=clock, advance=advance) as reading:
            blocks = list(reading.blocks(0.3))
        assert clock.now_ns == 300_000_000
        assert (driver.sampling, driver.stops) == (False, 1)
    return blocks, reading


def in_real_time(clock: HandClock) -> tuple[list[Block], Reading]:
    with numbered(WIDE, clock) as (far, driver):
        with Reading({"device": driver}, clock=clock) as reading:
            for piece in PIECES:
                far.send(*piece)
                far.taken()
            clock.now_ns += 1
            blocks = list(reading.blocks(0.0))
        assert (driver.sampling, driver.stops) == (False, 1)
    return blocks, reading


@pytest.mark.parametrize("read", [in_virtual_time, in_real_time])
def test_the_same_rows_in_virtual_and_in_real_time(read, clock):
    blocks, reading = read(clock)
    assert joined(blocks, "wide") == (NUMBERS, [65_603])
    counts = reading.stream_counts["wide"]
    assert counts == StreamCounts(received=1052, written=1051, duplicates=1, gaps=2)
    assert reading.counts == {"device: pieces": 6}
    assert reading.ended == ""


def test_a_device_that_is_gone_ends_the_reading(clock):
    """What came before is there, and the other device is stopped."""
    with (
        numbered(WIDE, clock) as (far, wide),
        numbered(FORCE, clock) as (far_force, force),
    ):
        with Reading({"wide": wide, "force": force}, clock=clock) as reading:
            far.send(0, 500)
            far_force.send(0, 100)
            far_force.taken()
            far_force.unplug()
            blocks = list(reading.blocks(60.0))
        assert clock.now_ns == 0, "it ended before its time"
        assert not wide.sampling
    assert reading.ended.startswith("force: ")
    assert joined(blocks, "force")[0] == list(range(100))
    assert joined(blocks, "wide")[0] == list(range(500))


class Broken(NumberedDriver):
    def read(self, timeout_s):
        raise ZeroDivisionError("seven by nothing")


class Unannounced(NumberedDriver):
    def read(self, timeout_s):
        return [Block("other", None, np.zeros((1, 1)))]


@pytest.mark.parametrize(("kind", "said"), [(Broken, "ZeroDivisionError"), (Unannounced, "'other'")])
def test_any_error_of_a_driver_ends_the_reading(kind, said, clock):
    with numbered(WIDE, clock, kind) as (_, driver):
        with Reading({"wide": driver}, clock=clock) as reading:
            assert list(reading.blocks(60.0)) == []
        assert driver.stops == 1
    assert reading.ended.startswith("wide: ")
    assert said in reading.ended


@pytest.mark.parametrize("when", ["starting", "waiting"])
def test_ctrl_c(when, clock):
    """The wait ends, devices stop, rows that nobody takes are counted."""

    class Interrupting(NumberedDriver):
        def read(self, timeout_s):
            blocks = super().read(timeout_s)
            if blocks:
                os.kill(os.getpid(), signal.SIGINT)
            return blocks

    with numbered(WIDE, clock, Interrupting) as (far, driver):
        reading = Reading({"wide": driver}, clock=clock)
        if when == "starting":
            far.send(0, 100)

        def consume():
            with reading:
                if when == "waiting":
                    far.send(0, 100)
                list(reading.blocks(60.0))

        with pytest.raises(KeyboardInterrupt):
            consume()
        assert (driver.sampling, driver.stops) == (False, 1)
    counts = reading.stream_counts["wide"]
    assert counts.received == 100 == counts.written + counts.dropped
    assert reading.ended == ""


class Deaf(NumberedDriver):
    def start(self):
        raise LinkTimeout("It does not answer.")


@pytest.mark.parametrize("virtual", [True, False])
def test_a_device_that_does_not_start_stops_those_before(virtual, clock):
    with numbered(WIDE, clock) as (_, first), numbered(FORCE, clock, Deaf) as (_, second):
        reading = Reading(
            {"wide": first, "force": second}, clock=clock, advance=(lambda to_ns: None) if virtual else None
        )
        with pytest.raises(LinkTimeout), reading:
            pass
        assert (first.sampling, first.stops, second.stops) == (False, 1, 1)


def test_two_streams_of_one_name_are_refused(clock):
    with numbered(WIDE, clock) as (_, first), numbered(WIDE, clock) as (_, second):
        with pytest.raises(UsageError, match="'wide'"), Reading({"a": first, "b": second}, clock=clock):
            pass
        assert (first.stops, second.stops) == (1, 1)


def test_a_reader_that_does_not_come_back_is_waited_for_with_a_bound(clock, monkeypatch):
    monkeypatch.setattr(module, "STOP_S", 0.05)
    away, back = threading.Event(), threading.Event()

    class Stuck(NumberedDriver):
        def read(self, timeout_s):
            away.set()
            back.wait(60.0)
            return []

    with numbered(WIDE, clock, Stuck) as (_, driver):
        with Reading({"wide": driver}, clock=clock) as reading:
            away.wait(60.0)
            list(reading.blocks(0.0))
        assert reading.ended.startswith("wide: ")
        assert driver.stops == 0, "one thread uses a driver"
        back.set()
        for thread in threading.enumerate():
            if thread.name == "reading wide":
                thread.join()
        assert driver.stops == 1


def test_a_driver_that_takes_time_to_ask_does_not_hold_up_the_others(clock):
    """Each of its reads gives rows and takes 3 ms of the virtual clock."""

    class Asking(NumberedDriver):
        def read(self, timeout_s):
            clock.now_ns += 3_000_000
            far.send(self._pieces, 1)
            return super().read(timeout_s)

    def advance(to_ns: int) -> None:
        clock.now_ns = max(clock.now_ns, to_ns)

    with numbered(WIDE, clock, Asking) as (far, first), numbered(FORCE, clock) as (far_force, second):
        with Reading({"asking": first, "force": second}, clock=clock, advance=advance) as reading:
            far_force.send(0, 10)
            blocks = list(reading.blocks(1.0))
        assert 1_000_000_000 <= clock.now_ns < 1_030_000_000
    assert joined(blocks, "force")[0] == list(range(10))
    assert reading.stream_counts["wide"].written > 10


# The queue of a stream ------------------------------------------------------------------------------------------------

NARROW = stream_of("s", 100.0, 2)


def queue_of(monkeypatch, seconds: float) -> StreamQueue:
    monkeypatch.setattr(module, "QUEUE_S", seconds)
    return StreamQueue("device", NARROW)


def rows_of(first: int, n: int, **more) -> Block:
    numbers = np.arange(first, first + n)
    return Block("s", 10 * numbers, np.stack([numbers, -numbers], 1).astype(np.int16), sequence=numbers, **more)


def test_a_full_queue_drops_the_newest_block_and_marks_the_next_row(monkeypatch):
    queue = queue_of(monkeypatch, 0.1)
    for first in (0, 4, 8):
        queue.put(rows_of(first, 4), 1)
    assert queue.dropped == 4
    (first,) = queue.take()
    assert (first.sequence.tolist(), first.quality) == (list(range(8)), None)
    queue.put(rows_of(12, 4, quality=np.full((4, 2), Quality.SUSPECT, dtype=np.uint8)), 1)
    (last,) = queue.take()
    assert last.quality[:, 0].tolist() == [Quality.SUSPECT | Quality.GAP, *[Quality.SUSPECT] * 3]
    assert list(queue.take()) == []


@pytest.mark.parametrize(
    "other",
    [
        Block("s", np.arange(2), np.zeros((2, 2), dtype=np.int16)),
        Block("s", np.arange(2), np.zeros((2, 3), dtype=np.int16), sequence=np.arange(2, 4)),
        Block("s", np.arange(3), np.zeros((2, 2), dtype=np.int16), sequence=np.arange(2, 4)),
    ],
    ids=["no numbers", "three channels", "three times"],
)
def test_a_block_that_does_not_fit_the_first_is_refused(other, monkeypatch):
    queue = queue_of(monkeypatch, 5.0)
    queue.put(rows_of(0, 2), 1)
    with pytest.raises(RigError, match="'s'"):
        queue.put(other, 2)
