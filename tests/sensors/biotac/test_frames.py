"""Frames of the BioTac against its emulator: what was sensed comes back, and what was not is marked."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import Quality
from tactbench.sensors.biotac import SPEC
from tactbench.sensors.biotac.codec import CHANNELS, Fault, encoded
from tactbench.sensors.biotac.emulator import BioTacFault, Emulator
from tactbench.sensors.biotac.frames import DEFAULT_FRAME, FrameBatches

SPEED_HZ = 4_400_000
PERIOD_S = 1 / 4400
GOOD, MISSING, SUSPECT, SATURATED = (
    int(flag) for flag in (Quality.GOOD, Quality.MISSING, Quality.SUSPECT, Quality.SATURATED)
)
COLUMN = {channel.name: column for stream in SPEC.streams for column, channel in enumerate(stream.channels)}


def wave(t_s):
    """A level and a slope of each channel's own, inside the converter for half a second."""
    return {name: 300.0 + 100.0 * k + 1000.0 * t_s for k, name in enumerate(CHANNELS)}


def carried_out(steps, sensor, begin_s):
    """What comes in during a batch, and when it is over."""
    data, now_s = [], begin_s
    for step in steps:
        data.append(sensor.exchange(step.select, step.data, now_s))
        now_s += 8 * len(step.data) / SPEED_HZ + 1e-6 * step.pause_us
    return data, now_s


def run(batches, sensor, n):
    """Carry out batches one after the other from 0 s, and return the streams' blocks by name."""
    now_s = 0.0
    for _ in range(n):
        first, steps = batches.next()
        begin_ns = round(now_s * 1e9)
        data, now_s = carried_out(steps, sensor, now_s)
        batches.take(first, data, t_ns=round(now_s * 1e9), device_ns=begin_ns)
    return {block.stream: block for block in batches.blocks(incomplete=True)}


def expected(name, n):
    """What word n reads: pauses are whole microseconds, and the slope is 0.001 count in one."""
    return round(wave(n * PERIOD_S + 2 * 8 / SPEED_HZ)[name])


@pytest.mark.parametrize("speed_hz", [500_000, 3_300_001, 10_000_000])
@pytest.mark.parametrize("words", [None, 1, 17])
def test_words_come_at_their_rate_whatever_the_clock(speed_hz, words):
    batches = FrameBatches(speed_hz=speed_hz, words=words)
    sent, now_s = 0, 0.0
    while sent < 4400:
        first, steps = batches.next()
        # Whole microseconds, rounded down.
        assert first / 4400 - 1e-6 - 1e-9 <= now_s <= first / 4400 + 1e-9
        length_s = sum(8 * len(step.data) / speed_hz + 1e-6 * step.pause_us for step in steps)
        assert batches.timing(first)[1] == pytest.approx(1e9 * length_s, abs=2.0)
        assert all(step.pause_us == 50 for step in steps[::2])
        assert all(step.pause_us >= 10 for step in steps[1::2])
        sent, now_s = sent + len(steps) // 2, now_s + length_s


def test_times_of_rows_are_those_at_which_words_were_sampled():
    asked = []
    sensor = Emulator(lambda t_s: asked.append(t_s) or wave(t_s))
    blocks = run(FrameBatches(speed_hz=SPEED_HZ), sensor, 3)
    # The batch's beginning and the word's place are whole nanoseconds each.
    assert blocks["vibration"].device_ns == pytest.approx(1e9 * np.array(asked[1::2]), abs=2.0)
    assert blocks["electrodes"].device_ns == pytest.approx(1e9 * np.array(asked[::44]), abs=2.0)
    assert set(np.diff(blocks["electrodes"].t_ns)) == {10_000_000}


def test_without_a_counter_times_are_counted_back_from_the_end():
    batches = FrameBatches(speed_hz=SPEED_HZ)
    first, steps = batches.next()
    asked = []
    data, end_s = carried_out(steps, Emulator(lambda t_s: asked.append(t_s) or {}), 5.0)
    batches.take(first, data, t_ns=round(end_s * 1e9))
    slow, fast = batches.blocks()
    assert slow.device_ns is None
    assert slow.t_ns == pytest.approx(1e9 * np.array(asked[:1]), abs=3.0)
    assert fast.t_ns == pytest.approx(1e9 * np.array(asked[1::2]), abs=3.0)


def test_a_resend_that_is_bad_too_leaves_the_first_word_marked():
    batches = FrameBatches(speed_hz=SPEED_HZ, resends=1)
    faults = [BioTacFault("parity", channels=frozenset({"E5"}))]
    block = run(batches, Emulator(wave, faults=faults), 2)["electrodes"]
    assert set(block.quality[:, COLUMN["E5"]]) == {SUSPECT}
    assert batches.counts == {"parity E5": 2}


@pytest.mark.parametrize(("kind", "seen"), [("dropped-reply", Fault.NOT_CONNECTED), ("error-reply", Fault.ERROR)])
def test_what_did_not_come_is_missing_and_nothing_else(kind, seen):
    batches = FrameBatches(speed_hz=SPEED_HZ)
    blocks = run(batches, Emulator(wave, faults=[BioTacFault(kind, channels=frozenset({"E5", "PAC"}), every=3)]), 9)
    lost = Counter([name for name in DEFAULT_FRAME * 9 if name in ("E5", "PAC")][2::3])
    for stream, name in (("electrodes", "E5"), ("vibration", "PAC")):
        quality = blocks[stream].quality
        assert np.count_nonzero(quality) == np.count_nonzero(quality[:, COLUMN[name]] == MISSING) == lost[name]
    assert batches.counts == {f"{seen} {name}": lost[name] for name in ("E5", "PAC")}


def test_the_ends_of_the_converter_are_marked_saturated():
    state = {**wave(0.0), "E1": -5.0, "E2": 0.6, "E3": 4094.4, "E4": 4095.0}
    (row,) = run(FrameBatches(speed_hz=SPEED_HZ), Emulator(lambda t_s: state), 1)["electrodes"].quality
    assert row[:4].tolist() == [SATURATED, GOOD, GOOD, SATURATED]


def test_batches_without_a_reply_and_words_that_were_not_asked_for_are_gaps():
    batches, sensor = FrameBatches(speed_hz=SPEED_HZ, words=10), Emulator(wave)
    for n in range(20):
        first, steps = batches.next()
        if not 4 <= n < 9:
            data, _ = carried_out(steps, sensor, first * PERIOD_S)
            batches.take(first, data, t_ns=0, skipped=0 if n < 15 else 88)
    blocks = {block.stream: block for block in batches.blocks(incomplete=True)}
    slow, fast = blocks["electrodes"], blocks["vibration"]
    # Words 0-39, 90-149, and 150-199 as words 238-287.
    assert fast.sequence.tolist() == [*range(20), *range(45, 75), *range(119, 144)]
    assert slow.sequence.tolist() == [0, 2, 3, 5, 6]
    missing = slow.quality == MISSING
    # By place in the frame, PDC, TAC and TDC the last: 20 slow words, 21 from the second on, 9, 13 left of the fourth.
    assert np.count_nonzero(~missing, axis=1).tolist() == [20, 21, 9, 13, 12]
    assert slow.data[1, COLUMN["E2"]] == expected("E2", 90)


@settings(max_examples=30)
@given(
    replies=st.lists(
        st.lists(st.one_of(st.binary(max_size=3), st.integers(0, 4095).map(encoded)), min_size=20, max_size=20),
        max_size=6,
    ),
    resends=st.integers(0, 1),
)
def test_any_replies_are_survived_and_the_next_frame_is_whole(replies, resends):
    batches = FrameBatches(speed_hz=SPEED_HZ, resends=resends, words=10 // (1 + resends))
    for reply in replies:
        batches.take(batches.next()[0], reply, t_ns=0)
    batches.blocks()
    levels = {name: 1000.0 + number for number, name in enumerate(CHANNELS)}
    sensor = Emulator(lambda t_s: levels)
    first, steps = batches.next()
    begun = first
    while first < begun + 2 * 44:  # the frame that was begun, and a whole one
        batches.take(first, carried_out(steps, sensor, first * PERIOD_S)[0], t_ns=0)
        first, steps = batches.next()
    whole = -(-begun // 44)
    slow, fast = batches.blocks()
    for block, rows in ((slow, slow.sequence == whole), (fast, fast.sequence // 22 == whole)):
        (stream,) = (stream for stream in SPEC.streams if stream.name == block.stream)
        expected = [levels[channel.name] for channel in stream.channels]
        assert block.data[rows].tolist() == [expected] * (1 if block is slow else 22)
        assert not block.quality[rows].any()
