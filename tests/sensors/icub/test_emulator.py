"""Boards that do what their firmware does, and faults that end as the decoder says."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import Quality, UsageError
from tactbench.plugin.devices import CanFrame
from tactbench.sensors.icub.codec import (
    BROADCAST,
    BoardSetup,
    Command,
    OldSetup,
    OldSetup2,
    Sample,
    SkinDecoder,
    Transmit,
    TriangleSetup,
    VersionRequest,
    command_frame,
    read_version,
    skin_id,
)
from tactbench.sensors.icub.emulator import REST_RESULT, VERSION, Board, BoardFault, Bus, frame_s, results_of
from tactbench.sensors.icub.spec import SPEC

GOOD, MISSING, SATURATED, SUSPECT = Quality.GOOD, Quality.MISSING, Quality.SATURATED, Quality.SUSPECT
PERIOD_S = 0.04
PAIR_S = 270e-6
"""Two frames of 135 bits at 1 Mbit/s."""


def still(triangle: int, now_s: float) -> Sequence[int]:
    return (REST_RESULT,) * 12


def fingertip(press: Callable[[float], Iterable[float]]) -> Callable[[int, float], Sequence[int] | None]:
    """One chip, of triangle 3, whose taxels fall by `press(seconds)` counts."""
    return lambda triangle, now_s: results_of(243.0 - d for d in press(now_s)) if triangle == 3 else None


def told(bus: Bus, *commands: Command, to: int = 14, now_s: float = 0.0) -> list[CanFrame]:
    return [frame for command in commands for _, frame in bus.feed(command_frame(to, command), now_s)]


def polled(bus: Bus, until_s: float) -> list[CanFrame]:
    return [frame for _, frame in bus.poll(until_s)]


def started(bus: Bus, to: int = 14, triangle: int = 3, **setup: int) -> Bus:
    """As a host does it: set up the board, enable a triangle, start; at 0 s."""
    told(bus, BoardSetup(**setup), TriangleSetup(triangle, triangle), Transmit(True), to=to)
    return bus


def samples_of(bus: Bus, until_s: float, period_s: float = PERIOD_S) -> tuple[list[Sample], SkinDecoder]:
    decoder = SkinDecoder(period_s)
    samples = [sample for frame in polled(bus, until_s) for sample in decoder.feed(frame)]
    return samples + decoder.flush(), decoder


def with_fault(*faults: BoardFault, until_s: float = 0.41) -> tuple[list[Sample], SkinDecoder]:
    return samples_of(started(Bus([Board(14, fingertip(lambda now_s: [100 * now_s] * 12), faults)])), until_s)


def test_nothing_is_sent_before_the_start_and_after_the_stop():
    bus = Bus([Board(14, still)])
    assert bus.poll(10.0) == []
    assert told(bus, BoardSetup(), TriangleSetup(0, 15), now_s=10.0) == []
    assert bus.poll(20.0) == []
    assert math.isinf(bus.next_s())
    told(bus, Transmit(True), now_s=20.0)
    assert len(bus.poll(20.05)) == 32
    told(bus, Transmit(False), to=BROADCAST, now_s=20.05)
    assert bus.poll(30.0) == []


def test_samples_come_at_the_board_s_rate():
    samples, decoder = samples_of(started(Bus([Board(14, fingertip(lambda _: [0.0] * 12))])), 1.01)
    assert [sample.sequence for sample in samples] == list(range(25))
    # The host has a frame at its end; nanoseconds are rounded.
    assert [sample.t_ns for sample in samples] == pytest.approx(
        [1e9 * (PERIOD_S * (k + 1) + PAIR_S / 2) for k in range(25)], abs=1
    )
    assert {sample.taxels for sample in samples} == {bytes([240] * 12)}
    assert {mark for sample in samples for mark in sample.quality} == {GOOD}
    assert decoder.foreign == 0


def test_a_board_setup_disables_all_triangles():
    bus = Bus([Board(14, still)])
    told(bus, BoardSetup(), Transmit(True))
    assert bus.poll(1.0) == []


def test_a_triangle_setup_stops_and_takes_a_new_baseline():
    bus = started(Bus([Board(14, fingertip(lambda now_s: [20.0 if now_s > 0.1 else 0.0] * 12))]))
    (*_, before), _ = samples_of(bus, 0.19)
    told(bus, TriangleSetup(3, 3), now_s=0.19)
    assert bus.poll(0.5) == []
    told(bus, Transmit(True), now_s=0.5)
    (after,), _ = samples_of(bus, 0.55)
    assert (set(before.taxels), set(after.taxels)) == ({220}, {240})


def test_a_board_that_was_not_set_up_has_the_firmware_s_defaults():
    bus = Bus([Board(14, still)])
    told(bus, Transmit(True))
    samples, _ = samples_of(bus, 0.11, period_s=0.05)
    assert len(samples) == 2 * 16
    assert {sample.taxels for sample in samples} == {bytes([245] * 12)}


def test_the_old_set_up_starts_with_defaults_and_40_ms():
    board = Board(14, still)
    bus = Bus([board])
    told(bus, BoardSetup(1, 20, 240), OldSetup(), OldSetup2())
    samples, _ = samples_of(bus, 0.09)
    assert len(samples) == 2 * 16
    assert {sample.taxels for sample in samples} == {bytes([245] * 12)}
    assert board.ignored == 1  # its second half is unknown to the firmware


def test_what_the_firmware_passes_over_is_counted():
    board = Board(14, still)
    bus = started(Bus([board]))
    bus.feed(CanFrame(0x20E, bytes.fromhex("50 05 04 02 01 00 22")), 0.0)
    bus.feed(CanFrame(0x20E, bytes.fromhex("50 00 10 02 01 00 22")), 0.0)
    told(bus, BoardSetup(skin_type=3))
    assert board.ignored == 3
    assert len(bus.poll(0.05)) == 2
    assert bus.feed(CanFrame(0x20E, b""), 0.05) == []
    assert bus.feed(CanFrame(0x20D, bytes([7, 1])), 0.05) == []  # another board's
    assert len(bus.poll(0.09)) == 2


def test_the_version_is_answered_to_the_one_who_asks():
    bus = Bus([Board(14, still)])
    bus.feed(command_frame(14, VersionRequest(2, 0), source=5), 1.0)
    (answer,) = polled(bus, 1.001)
    assert answer.id == 0x2E5
    assert read_version(answer) == (14, VERSION)
    bus.feed(command_frame(14, VersionRequest(2, 1)), 2.0)
    (answer,) = polled(bus, 2.001)
    found = read_version(answer)
    assert found is not None
    assert not found[1].fits


@given(
    first=st.lists(st.floats(0.0, 255.0), min_size=12, max_size=12),
    second=st.lists(st.floats(0.0, 255.0), min_size=12, max_size=12),
    no_load=st.integers(0, 255),
)
@settings(max_examples=60, deadline=None)
def test_what_is_sensed_comes_out_to_a_count(first, second, no_load):
    bus = Bus([Board(14, lambda triangle, now_s: results_of(second if now_s else first))])
    (sample,), _ = samples_of(started(bus, no_load=no_load), 0.05)
    for value, mark, before, after in zip(sample.taxels, sample.quality, first, second, strict=True):
        exact = no_load + after - before
        # Half a result of rounding on either side, then less than a count is dropped upwards: 1.25 at shift 2.
        assert abs(value - np.clip(exact, 0.0, 255.0)) <= 1.25
        assert bool(mark & SATURATED) == (value in (0, 255))


def test_the_rest_of_the_emulated_chip_is_that_of_the_spec():
    rest = [channel.rest.to("count") for channel in SPEC.channels("taxel") if channel.rest is not None]
    assert results_of(rest) == (REST_RESULT,) * 12
    assert min(results_of([242.0])) > REST_RESULT  # pressure lowers the reading


def test_integral_readings_come_out_exactly():
    press = np.arange(12.0)
    bus = Bus([Board(14, fingertip(lambda now_s: press if now_s else np.zeros(12)))])
    (sample,), _ = samples_of(started(bus), 0.05)
    assert list(sample.taxels) == list(240 - np.arange(12))


def test_far_beyond_its_range_the_board_doubts_the_taxel():
    change = np.array([239.0, 240.0, 479.75, 480.0, -14.0, -15.0, -29.75, -30.0, 0.0, 0.0, 0.0, 0.0])
    bus = Bus([Board(14, fingertip(lambda now_s: change * bool(now_s)))])
    (sample,), decoder = samples_of(started(bus), 0.05)
    assert list(sample.taxels) == [1, 0, 0, 0, 254, 255, 255, 255, 240, 240, 240, 240]
    assert sample.word == 1 << 4 + 3 | 1 << 4 + 7
    assert decoder.counts[14, 3].out_of_range == [int(taxel in (3, 7)) for taxel in range(12)]


def test_the_raw_test_sends_low_bytes_without_flags():
    bus = Bus([Board(14, lambda triangle, now_s: range(0x8100, 0x810C) if triangle == 3 else None)])
    (sample,), _ = samples_of(started(bus, skin_type=7), 0.05)
    assert (list(sample.taxels), sample.word) == (list(range(12)), 0)


def test_compensation_takes_off_the_temperature_taxel_s_change():
    # All results rise by 43: taxel 0 has gain 70, so a drift of ((43 >> 2) * 70) >> 5 = 21 is taken off and
    # (43 - 21) >> 2 = 5 is left; taxel 10 has gain 0: 43 >> 2 = 10. Falling: -(10 * 70) >> 5 = -22, -21 >> 2 = -6;
    # -43 >> 2 = -11.
    for sign, wanted in ((1, (235, 230)), (-1, (246, 251))):
        bus = Bus([Board(14, lambda triangle, now_s, s=sign: [REST_RESULT + 43 * s * bool(now_s)] * 12)])
        (sample,), _ = samples_of(started(bus, skin_type=0), 0.05)
        assert (sample.taxels[0], sample.taxels[10]) == wanted
    for kind in (1, 2):
        bus = Bus([Board(14, lambda triangle, now_s: [REST_RESULT + 43 * bool(now_s)] * 12)])
        (sample,), _ = samples_of(started(bus, skin_type=kind), 0.05)
        assert set(sample.taxels) == {230}


def test_an_absent_chip_reads_not_connected():
    def plugged(triangle: int, now_s: float) -> Sequence[int] | None:
        return still(triangle, now_s) if triangle == 3 and now_s < 0.1 else None

    bus = Bus([Board(14, plugged)])
    told(bus, BoardSetup(), TriangleSetup(3, 4), Transmit(True))
    samples, decoder = samples_of(bus, 0.13)
    words = [(sample.triangle, sample.word) for sample in samples]
    # Absent at the baseline, nothing has changed; gone later, every taxel is far out of range as well.
    assert words == [(3, 0), (4, 0x0002), (3, 0), (4, 0x0002), (3, 0xFFF2), (4, 0x0002)]
    assert set(samples[-1].quality) == set(samples[-2].quality) == {MISSING}
    assert (decoder.counts[14, 3].not_connected, decoder.counts[14, 4].not_connected) == (1, 3)


def test_five_missed_acknowledgements_make_a_new_baseline():
    samples, decoder = with_fault(BoardFault("no-ack", start_s=0.1, channels=frozenset({"T3"}), triangle=3))
    assert [sample.word for sample in samples] == [0, 0] + [0x0041] * 5 + [0, 0, 0]
    assert {mark for sample in samples[2:7] for mark in sample.quality} == {SUSPECT, SUSPECT | SATURATED}
    # The new baseline was taken while the finger was pressed: 28 counts are lost, and no flag says so.
    assert samples[6].taxels[0] == 240 - 28
    assert samples[7].taxels[0] == 240
    assert decoder.counts[14, 3].no_ack == 5


def test_dropped_heads():
    samples, decoder = with_fault(BoardFault("dropped-frame", half="head", every=3))
    lost = [sample.sequence for sample in samples if MISSING in sample.quality]
    assert lost == [2, 5, 8]
    assert {sample.quality for sample in samples if sample.sequence in lost} == {(MISSING,) * 7 + (GOOD,) * 5}
    assert decoder.counts[14, 3].missing_heads == 3
    assert len(samples) == 10


def test_dropped_tails():
    samples, decoder = with_fault(BoardFault("dropped-frame", half="tail", start_s=0.2, end_s=0.3))
    lost = [sample.sequence for sample in samples if MISSING in sample.quality]
    assert lost == [4, 5, 6]
    assert {sample.quality for sample in samples if sample.sequence in lost} == {(SUSPECT,) * 7 + (MISSING,) * 5}
    assert (decoder.counts[14, 3].missing_tails, decoder.counts[14, 3].samples) == (3, 10)


def test_dropped_samples_leave_a_long_interval():
    samples, decoder = with_fault(BoardFault("dropped-frame", start_s=0.2, end_s=0.21))
    assert len(samples) == 9
    assert {mark for sample in samples for mark in sample.quality} == {GOOD}
    assert decoder.counts[14, 3].long_intervals == 1


def test_doubled_frames():
    samples, decoder = with_fault(BoardFault("doubled-frame", start_s=0.2, end_s=0.21))
    assert len(samples) == 10
    assert decoder.counts[14, 3].doubled == 2
    marked = {sample.sequence: sample.quality for sample in samples if SUSPECT in sample.quality}
    assert marked == {4: (SUSPECT,) * 7 + (GOOD,) * 5, 5: (GOOD,) * 7 + (SUSPECT,) * 5}
    assert [sample.taxels for sample in samples] == [sample.taxels for sample in with_fault()[0]]


def test_late_frames():
    usual, late = with_fault()[0], with_fault(BoardFault("late-answer", delay_s=0.003), until_s=0.42)[0]
    assert [sample.taxels for sample in late] == [sample.taxels for sample in usual]
    assert [b.t_ns - a.t_ns for a, b in zip(usual, late, strict=True)] == pytest.approx([3e6] * 10, abs=2)


def test_a_late_answer():
    bus = Bus([Board(14, still, [BoardFault("late-answer", delay_s=0.2)])])
    told(bus, VersionRequest(), now_s=1.0)
    assert bus.next_s() == pytest.approx(1.2, abs=1e-9)
    assert bus.poll(1.2) == []
    assert len(bus.poll(1.201)) == 1


def test_a_late_tail_is_of_no_sample():
    samples, _ = with_fault(BoardFault("late-answer", half="tail", start_s=0.1, end_s=0.13, delay_s=0.038))
    assert [sample.quality for sample in samples[2:4]] == [
        (SUSPECT,) * 7 + (MISSING,) * 5,
        (MISSING,) * 7 + (GOOD,) * 5,
    ]


def test_a_stuck_taxel():
    samples, _ = with_fault(BoardFault("stuck-taxel", channels=frozenset({"T6"}), start_s=0.1, end_s=0.3))
    usual = with_fault()[0]
    held = usual[2].taxels[5]
    for sample, free in zip(samples, usual, strict=True):
        assert sample.taxels[:5] + sample.taxels[6:] == free.taxels[:5] + free.taxels[6:]
        assert sample.taxels[5] == (held if 2 <= sample.sequence <= 6 else free.taxels[5])
        assert set(sample.quality) == {GOOD}  # nothing in the frames gives it away


def test_not_connected():
    samples, decoder = with_fault(BoardFault("not-connected", start_s=0.1, end_s=0.3))
    assert [set(sample.quality) for sample in samples] == [{GOOD}] * 2 + [{MISSING}] * 5 + [{GOOD}] * 3
    assert decoder.counts[14, 3].not_connected == 5


def test_an_error_word():
    samples, _ = with_fault(BoardFault("error-word", start_s=0.1, end_s=0.13, word=0x8001))
    assert [sample.word for sample in samples[:4]] == [0, 0, 0x8001, 0]
    assert samples[2].quality == (SUSPECT,) * 11 + (SUSPECT | SATURATED,)


def test_an_unplugged_board_is_silent_and_has_forgotten_its_set_up():
    bus = started(Bus([Board(14, still, [BoardFault("unplugged", start_s=0.1, end_s=0.3)])]))
    assert len(bus.poll(0.1)) == 4
    assert told(bus, VersionRequest(), now_s=0.2) == polled(bus, 0.4) == []
    told(bus, Transmit(True), now_s=0.4)
    samples, _ = samples_of(bus, 0.46, period_s=0.05)
    assert {sample.taxels for sample in samples} == {bytes([245] * 12)}
    assert len(samples) == 16


def test_faults_can_be_switched_while_it_runs():
    board = Board(14, fingertip(lambda _: [0.0] * 12))
    bus = started(Bus([board]))
    bus.poll(0.1)
    fault = BoardFault("not-connected")
    board.faults.append(fault)
    (ill,), _ = samples_of(bus, 0.13)
    board.faults.remove(fault)
    (well,), _ = samples_of(bus, 0.17)
    assert (set(ill.quality), set(well.quality)) == ({MISSING}, {GOOD})


@pytest.mark.parametrize("name", sorted(BoardFault.known.keys() - {"unplugged"}))
def test_every_fault_leaves_other_triangles_alone(name):
    bus = Bus([Board(14, still, [BoardFault(name, triangle=3)])])
    told(bus, BoardSetup(), TriangleSetup(0, 4), Transmit(True))
    samples, _ = samples_of(bus, 0.19)
    whole = [sample for sample in samples if sample.triangle != 3]
    assert len(whole) == 4 * 4
    assert {mark for sample in whole for mark in sample.quality} == {GOOD}
    assert {sample.taxels for sample in whole} == {bytes([240] * 12)}


def test_boards_share_the_bus_one_frame_at_a_time():
    bus = Bus([Board(14, still), Board(2, still)])
    for address in (14, 2):
        told(bus, BoardSetup(), TriangleSetup(0, 15), to=address)
    told(bus, Transmit(True), to=BROADCAST)
    frames = polled(bus, 0.079)
    # Both read at 40 ms; the lower identifier goes first, and heads stay before their tails.
    wanted = [skin_id(address, triangle) for address in (2, 14) for triangle in range(16) for _ in range(2)]
    assert [frame.id for frame in frames] == wanted
    assert [frame.data[0] for frame in frames] == [0x40, 0xC0] * 32
    ends_ns = np.array([frame.t_ns for frame in frames])
    assert ends_ns[0] == pytest.approx(40e6 + 135e3, abs=1)
    assert np.diff(ends_ns) == pytest.approx(np.full(63, 135e3), abs=1)
    decoder = SkinDecoder(PERIOD_S)
    samples = [sample for frame in frames for sample in decoder.feed(frame)]
    assert {(sample.board, sample.triangle) for sample in samples} == {(b, t) for b in (2, 14) for t in range(16)}


def test_the_length_of_a_frame_is_that_of_the_spec_s_delay():
    # 2 frames of 135 bits, as SensorSpec.link_delay derives it; it states 10 microseconds.
    assert 2 * frame_s(CanFrame(0x4E3, bytes(8))) == pytest.approx(PAIR_S, abs=1e-12)


def test_a_bus_that_is_too_slow_loses_frames_and_says_so():
    board = Board(14, still)
    bus = Bus([board])
    told(bus, BoardSetup(period_ms=1), TriangleSetup(0, 15), Transmit(True))
    frames = bus.poll(1.0)
    assert 7300 < len(frames) <= 1.0 / 135e-6
    # 999 ticks of 32 frames; up to 64 wait and one is on the wire.
    assert 0 <= 999 * 32 - len(frames) - board.lost <= 65


@given(st.lists(st.floats(0.0, 0.5), max_size=20))
@settings(max_examples=30, deadline=None)
def test_how_often_it_is_polled_changes_nothing(times):
    def fresh() -> Bus:
        faults = [
            BoardFault("dropped-frame", every=3),
            BoardFault("doubled-frame", half="head"),
            BoardFault("no-ack", start_s=0.2),
        ]
        boards = [
            Board(address, fingertip(lambda now_s: 50 * np.sin(7 * now_s + np.arange(12))), faults)
            for address in (1, 14)
        ]
        return started(started(Bus(boards), to=1), to=14)

    whole = fresh().poll(0.5)
    bus = fresh()
    assert [frame for now_s in [*sorted(times), 0.5] for frame in bus.poll(now_s)] == whole
    bus, stepped = fresh(), []
    while (due_s := bus.next_s()) <= 0.5:
        stepped += bus.poll(due_s)
    assert stepped == whole


@given(
    st.lists(
        st.builds(
            CanFrame,
            st.one_of(st.integers(0, 0x7FF), st.sampled_from([0x20E, 0x20F])),
            st.builds(
                lambda code, rest: bytes([code]) + rest,
                st.sampled_from([0x4D, 0x50, 0x07, 0x4C, 0x4E, 0x1C]),
                st.binary(max_size=7),
            ),
        ),
        max_size=20,
    )
)
@settings(max_examples=60, deadline=None)
def test_any_commands_are_survived(commands):
    bus = Bus([Board(14, fingertip(lambda _: [0.0] * 12), [BoardFault("no-ack", channels=frozenset({"T7"}))])])
    for number, frame in enumerate(commands):
        bus.feed(frame, 0.01 * number)
    bus.poll(0.01 * len(commands))
    # However it was set up, a host's start brings it back.
    begin_s = 1.0
    told(bus, Transmit(False), now_s=begin_s)
    bus.poll(2.0)
    bus.boards[14].faults.clear()
    told(bus, BoardSetup(), TriangleSetup(3, 3), Transmit(True), now_s=2.0)
    (sample,), _ = samples_of(bus, 2.05)
    assert sample.taxels == bytes([240] * 12)


def test_what_cannot_be_is_refused():
    for wrong in (
        lambda: BoardFault("unheard-of"),
        lambda: BoardFault("stuck-taxel", channels=frozenset({"T13"})),
        lambda: BoardFault("dropped-frame", every=0),
        lambda: BoardFault("late-answer", delay_s=-1.0),
        lambda: BoardFault("error-word", word=0x10000),
        lambda: Board(15, still),
        lambda: Bus([Board(1, still), Board(1, still)]),
    ):
        with pytest.raises(UsageError):
            wrong()
