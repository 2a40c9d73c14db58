"""Frames of the BioTac against its emulator: what was sensed comes back, and what was not is marked."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import Quality
from tactbench.sensors.biotac.codec import CHANNELS, INDEX, RESEND, Fault, encoded, sampling_command
from tactbench.sensors.biotac.emulator import EmulatedFault, Emulator
from tactbench.sensors.biotac.frames import DEFAULT_FRAME, FrameRows, FrameScheduler
from tactbench.sensors.biotac.spec import SPEC

PERIOD_S = 1 / 4400
READ_S = 2 * 8 / 4.4e6 + 50e-6
GOOD, MISSING, SUSPECT, SATURATED = (
    int(flag) for flag in (Quality.GOOD, Quality.MISSING, Quality.SUSPECT, Quality.SATURATED)
)
COLUMN = {channel.name: column for stream in SPEC.streams for column, channel in enumerate(stream.channels)}


def wave(t_s: float) -> dict[str, float]:
    """A level and a slope of each channel's own, inside the converter for half a second."""
    return {name: 300.0 + 100.0 * k + 1000.0 * t_s for k, name in enumerate(CHANNELS)}


def run(scheduler: FrameScheduler, sensor: Emulator, commands: int, first: int = 0) -> dict:
    """Send commands at the default rate, finish, and return the streams' blocks by name."""
    for n in range(first, first + commands):
        start_s = n * PERIOD_S
        scheduler.take(_exchange(scheduler, sensor, n, start_s))
        while scheduler.resend_due:
            start_s += 1e-4
            scheduler.take(_exchange(scheduler, sensor, n, start_s))
    scheduler.finish()
    return {block.stream: block for block in scheduler.blocks()}


def _exchange(scheduler: FrameScheduler, sensor: Emulator, n: int, start_s: float) -> bytes:
    sensor.feed(scheduler.word(round(n * PERIOD_S * 1e9)), start_s)
    return sensor.feed(b"\x00\x00", start_s + READ_S)


def expected(name: str, n: int) -> int:
    return round(wave(n * PERIOD_S + 2 * 8 / 4.4e6)[name])


def test_every_word_comes_back_as_a_sample_of_its_stream():
    frames = 4
    scheduler = FrameScheduler()
    blocks = run(scheduler, Emulator(wave), frames * 44)
    slow, fast = blocks["electrodes"], blocks["vibration"]
    assert slow.data.shape == (frames, 22)
    assert fast.data.shape == (frames * 22, 1)
    for frame in range(frames):
        for place, name in enumerate(DEFAULT_FRAME):
            n = frame * 44 + place
            got = fast.data[n // 2, 0] if name == "PAC" else slow.data[frame, COLUMN[name]]
            assert got == expected(name, n), (frame, name)
    assert slow.sequence.tolist() == list(range(frames))
    assert fast.sequence.tolist() == list(range(22 * frames))
    assert slow.t_ns.tolist() == [round(frame * 0.01 * 1e9) for frame in range(frames)]
    assert np.diff(fast.t_ns) == pytest.approx(1e9 / 2200, abs=1.0)
    assert not slow.quality.any()
    assert not fast.quality.any()
    assert not any(scheduler.faults.values())


def test_the_streams_keep_the_specs_order_and_type():
    blocks = run(FrameScheduler(), Emulator(wave), 44)
    assert list(blocks) == [stream.name for stream in SPEC.streams]
    for stream in SPEC.streams:
        assert blocks[stream.name].data.dtype == stream.dtype
    # TDC comes before TAC in the stream and after it in the frame.
    assert DEFAULT_FRAME.index("TAC") < DEFAULT_FRAME.index("TDC")
    assert COLUMN["TDC"] < COLUMN["TAC"]


def test_blocks_are_handed_out_once_and_as_soon_as_they_are_whole():
    scheduler, sensor, seen = FrameScheduler(), Emulator(wave), Counter()
    for n in range(3 * 44):
        scheduler.take(_exchange(scheduler, sensor, n, n * PERIOD_S))
        for block in scheduler.blocks():
            seen[block.stream] += len(block.data)
        # A word is a sample when the next one is asked for.
        assert seen["vibration"] == n // 2
        assert seen["electrodes"] == (n - 43) // 44 + 1 if n >= 43 else seen["electrodes"] == 0
    scheduler.finish()
    (last,) = scheduler.blocks()
    assert last.sequence.tolist() == [65]
    assert scheduler.blocks() == []


def test_a_resend_mends_a_word_of_bad_parity():
    scheduler = FrameScheduler()
    sensor = Emulator(wave, faults=[EmulatedFault("parity", every=7)])
    blocks = run(scheduler, sensor, 10 * 44)
    clean = run(FrameScheduler(), Emulator(wave), 10 * 44)
    for name, block in blocks.items():
        assert np.array_equal(block.data, clean[name].data)
        assert not block.quality.any()
    bad = sum(counts[Fault.PARITY] for counts in scheduler.faults.values())
    # Every seventh word, resends among them.
    assert bad == (440 + bad) // 7
    assert scheduler.resent.total() == bad


def test_bad_parity_without_a_resend_is_marked_with_the_number_that_came():
    scheduler = FrameScheduler(resends=0)
    faults = [EmulatedFault("parity", channels=frozenset({"E5"}))]
    block = run(scheduler, Emulator(lambda t_s: {**wave(t_s), "E5": 1739.0}, faults=faults), 16 * 44)["electrodes"]
    column = COLUMN["E5"]
    assert set(block.quality[:, column]) == {SUSPECT}
    # One bit in turn, from the last: two parity bits and two reserved ones leave the number as it is.
    off = block.data[:, column].astype(int) ^ 1739
    assert sorted(off) == [0, 0, 0, 0] + [1 << bit for bit in range(12)]
    assert scheduler.faults["E5"] == {Fault.PARITY: 16}
    assert not np.delete(block.quality, column, axis=1).any()
    assert {name for name, counts in scheduler.faults.items() if counts} == {"E5"}


def test_resends_end_and_what_stays_bad_is_marked():
    scheduler = FrameScheduler(resends=2)
    faults = [EmulatedFault("parity", channels=frozenset({"E5"}))]
    block = run(scheduler, Emulator(wave, faults=faults), 2 * 44)["electrodes"]
    assert set(block.quality[:, COLUMN["E5"]]) == {SUSPECT}
    assert scheduler.faults["E5"] == {Fault.PARITY: 6}
    assert scheduler.resent.total() == 0


@pytest.mark.parametrize(
    ("fault", "seen"),
    [
        (EmulatedFault("dropped-reply", channels=frozenset({"E5", "PAC"}), every=3), Fault.NO_REPLY),
        (EmulatedFault("error-reply", channels=frozenset({"E5", "PAC"}), every=3), Fault.ERROR),
    ],
    ids=lambda value: value.name if isinstance(value, EmulatedFault) else None,
)
def test_what_did_not_come_is_missing_and_nothing_else(fault, seen):
    scheduler = FrameScheduler()
    blocks = run(scheduler, Emulator(wave, faults=[fault]), 9 * 44)
    words = [name for name in DEFAULT_FRAME * 9 if name in ("E5", "PAC")]
    lost = Counter(name for place, name in enumerate(words, start=1) if place % 3 == 0)
    slow, fast = blocks["electrodes"], blocks["vibration"]
    assert np.count_nonzero(slow.quality) == lost["E5"]
    assert np.count_nonzero(slow.quality[:, COLUMN["E5"]] == MISSING) == lost["E5"]
    assert np.count_nonzero(fast.quality == MISSING) == np.count_nonzero(fast.quality) == lost["PAC"]
    assert {name: counts[seen] for name, counts in scheduler.faults.items() if counts} == lost
    assert len(slow.data) == 9
    assert len(fast.data) == 9 * 22


def test_a_doubled_reply_is_kept_out_counted_and_marked():
    scheduler = FrameScheduler()
    faults = [EmulatedFault("doubled-reply", channels=frozenset({"E5"}))]
    block = run(scheduler, Emulator(wave, faults=faults), 3 * 44)["electrodes"]
    clean = run(FrameScheduler(), Emulator(wave), 3 * 44)["electrodes"]
    assert np.array_equal(block.data, clean.data)
    assert set(block.quality[:, COLUMN["E5"]]) == {SUSPECT}
    assert np.count_nonzero(block.quality) == 3
    assert scheduler.faults["E5"] == {Fault.DUPLICATE: 3}


def test_a_second_reply_before_the_next_word_is_a_duplicate():
    scheduler = FrameScheduler()
    scheduler.take(b"\x01\x01")
    scheduler.word(0)
    scheduler.take(encoded(1739))
    scheduler.take(encoded(1739))
    scheduler.finish()
    scheduler.take(encoded(1739))
    (block,) = scheduler.blocks()
    assert block.data[0, 0] == 1739
    assert block.quality[0, 0] == SUSPECT
    assert scheduler.faults["E1"] == {Fault.DUPLICATE: 1}


def test_a_sensor_that_is_not_connected_has_rows_of_missing_samples():
    scheduler = FrameScheduler()
    faults = [EmulatedFault("not-connected", start_s=0.01, end_s=0.02)]
    block = run(scheduler, Emulator(wave, faults=faults), 3 * 44)["electrodes"]
    assert (block.quality == MISSING).all(axis=1).tolist() == [False, True, False]
    assert not block.quality[[0, 2]].any()
    assert sum(counts[Fault.NOT_CONNECTED] for counts in scheduler.faults.values()) == 44


def test_a_reply_that_is_never_taken_is_missing():
    scheduler = FrameScheduler()
    for n in range(44):
        scheduler.word(n)
    scheduler.finish()
    slow, fast = scheduler.blocks()
    assert (slow.quality == MISSING).all()
    assert (fast.quality == MISSING).all()
    assert all(counts[Fault.NO_REPLY] for counts in scheduler.faults.values())


def test_the_ends_of_the_converter_are_marked_saturated():
    state = {**wave(0.0), "E1": -5.0, "E2": 0.6, "E3": 4094.4, "E4": 4095.0}
    (row,) = run(FrameScheduler(), Emulator(lambda t_s: state), 44)["electrodes"].quality
    assert row[:4].tolist() == [SATURATED, GOOD, GOOD, SATURATED]


def test_commands_that_were_not_sent_leave_gaps_in_the_sequence():
    scheduler, sensor = FrameScheduler(), Emulator(wave)
    for n in range(10):
        scheduler.take(_exchange(scheduler, sensor, n, n * PERIOD_S))
    scheduler.skip(2 * 44)
    blocks = run(scheduler, sensor, 3 * 44 - 98, first=98)
    slow, fast = blocks["electrodes"], blocks["vibration"]
    assert slow.sequence.tolist() == [0, 2]
    assert fast.sequence.tolist() == [*range(5), *range(49, 66)]
    # E1 to E5 of the first frame and, at the same place of the third, the rest.
    assert (slow.quality[0] == MISSING).tolist() == [False] * 5 + [True] * 17
    assert (slow.quality[1] == MISSING).tolist() == [True] * 5 + [False] * 17
    assert slow.data[1, COLUMN["E6"]] == expected("E6", 98)


def test_sensors_on_one_bus_are_asked_the_same_word():
    first, second = FrameScheduler(), FrameScheduler()
    for n in range(44):
        word = first.word(n)
        assert second.word(n) == word
        first.take(b"\x6d\x59" if n == 3 else b"\x6d\x58")
        second.take(b"\x6d\x58")
        if first.resend_due:
            assert n == 3
            assert first.word(n) == RESEND
            first.take(b"\x6d\x58")
        assert not second.resend_due


def test_another_frame_has_rows_of_its_own():
    scheduler = FrameScheduler(("PAC", "PDC"))
    blocks = run(scheduler, Emulator(wave), 20)
    assert blocks["vibration"].sequence.tolist() == list(range(10))
    assert blocks["electrodes"].sequence.tolist() == list(range(10))
    quality = blocks["electrodes"].quality
    assert not quality[:, COLUMN["PDC"]].any()
    assert (np.delete(quality, COLUMN["PDC"], axis=1) == MISSING).all()


def test_frames_that_are_none_are_refused():
    with pytest.raises(ValueError, match="got E20"):
        FrameScheduler(("E1", "E20"))
    with pytest.raises(ValueError, match="got none"):
        FrameRows(())


@settings(max_examples=30)
@given(
    replies=st.lists(st.one_of(st.binary(max_size=7), st.integers(0, 4095).map(encoded)), max_size=60),
    resends=st.integers(0, 2),
)
def test_any_replies_are_survived_and_the_next_frame_is_whole(replies, resends):
    scheduler = FrameScheduler(resends=resends)
    sent = 0
    for reply in replies:
        word = scheduler.word(sent)
        sent += word != RESEND
        scheduler.take(reply)
    # To the next frame's beginning with what a sensor answers, then one frame more.
    while scheduler.resend_due or sent % 44:
        word = scheduler.word(sent)
        sent += word != RESEND
        scheduler.take(encoded(1000))
    scheduler.blocks()
    for place, name in enumerate(DEFAULT_FRAME):
        assert scheduler.word(sent + place) == sampling_command(INDEX[name])
        scheduler.take(encoded(1000 + place))
    scheduler.finish()
    blocks = {block.stream: block for block in scheduler.blocks()}
    last = blocks["electrodes"]
    assert last.sequence[-1] == sent // 44
    assert not last.quality[-1].any()
    assert last.data[-1, COLUMN["E2"]] == 1002
    assert blocks["vibration"].data[-22:, 0].tolist() == [1001 + 2 * n for n in range(22)]
    assert not blocks["vibration"].quality[-22:].any()
