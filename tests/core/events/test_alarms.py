"""Alarms against a detector that sees one frame at a time; their matching against mir_eval."""

import mir_eval
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.events.alarms import alarms, match
from tactbench.core.events.metrics import GroundTruth, score_events
from tactbench.core.spec.events import nanoseconds
from tests.core.events.made import MS, clocks, policies, policy, seconds, times


@st.composite
def frames(draw):
    clock = draw(clocks)
    active = draw(st.lists(st.booleans(), min_size=clock.size, max_size=clock.size))
    return clock, np.asarray(active, dtype=np.bool_)


def one_by_one(clock, active, rules):
    """Return the alarms of a detector that decides at each frame and never looks back at more than its own state."""
    gap, length, refractory = (nanoseconds(s) for s in (rules.merge_gap_s, rules.minimum_length_s, rules.refractory_s))
    raised, begun, last, was_active, told = [], None, None, False, False
    for now, on in zip(clock.tolist(), active.tolist(), strict=True):
        if on:
            if not (was_active or (last is not None and now - last <= gap)):
                begun, told = now, False
            if not told and now - begun >= length:
                told = True
                if not raised or now - raised[-1] >= refractory:
                    raised.append(now)
            last = now
        was_active = on
    return raised


@given(frames(), policies)
def test_alarms_are_those_of_a_detector_that_sees_one_frame_at_a_time(given_frames, rules):
    assert alarms(*given_frames, rules).tolist() == one_by_one(*given_frames, rules)


def test_the_policy_by_an_example():
    clock = seconds(*(0.01 * np.arange(100)))
    active = np.zeros(100, dtype=np.bool_)
    active[[10, 11, 12, 15, 16, 50, 80, 81, 82, 83]] = True
    assert alarms(clock, active, policy()).tolist() == seconds(0.10, 0.15, 0.50, 0.80).tolist()
    assert alarms(clock, active, policy(merge=0.03)).tolist() == seconds(0.10, 0.50, 0.80).tolist()
    assert alarms(clock, active, policy(minimum=0.02)).tolist() == seconds(0.12, 0.82).tolist()
    assert alarms(clock, active, policy(merge=0.03, minimum=0.05)).tolist() == seconds(0.15).tolist()
    assert alarms(clock, active, policy(refractory=0.4)).tolist() == seconds(0.10, 0.50).tolist()


GRID_S = 2.0**-9
"""A whole number of nanoseconds, and exact in floating point: both libraries see the same ties."""
GRID_NS = 1_953_125


def random_case(rng):
    """Return onsets, alarms and the window's two sides, in steps of the grid; often crowded, with equal times."""
    length = int(rng.integers(5, 400))
    onset, alarm = (np.sort(rng.integers(0, length, int(rng.integers(0, 25)))) for _ in range(2))
    before, after = (int(side) for side in rng.integers(0, 40, 2))
    return onset, alarm, before, after


def pairs(onset, alarm, before, after):
    sides = policy(before=before * GRID_S, after=after * GRID_S)
    return len(match(onset * GRID_NS, alarm * GRID_NS, sides)[0])


def test_as_many_pairs_as_mir_eval_on_ten_thousand_random_cases():
    rng = np.random.default_rng(19)
    differences = 0
    for _ in range(10_000):
        onset, alarm, before, after = random_case(rng)
        # mir_eval's window is symmetric: the distance from the middle of ours, in half steps.
        theirs = mir_eval.util.match_events(
            onset,
            alarm,
            before + after,
            distance=lambda a, b, middle=after - before: np.abs(2 * np.subtract.outer(b, a).T - middle),
        )
        differences += pairs(onset, alarm, before, after) != len(theirs)
    assert differences == 0


def test_onset_scores_are_those_of_mir_eval():
    rng = np.random.default_rng(20)
    for _ in range(500):
        onset, alarm, window, _ = random_case(rng)
        if onset.size == 0 or alarm.size == 0:
            continue  # mir_eval warns, and says 0 where we say that it cannot be said
        f1, precision, recall = mir_eval.onset.f_measure(onset * GRID_S, alarm * GRID_S, window=window * GRID_S)
        rules = policy(before=window * GRID_S, after=window * GRID_S)
        events = np.column_stack([onset, onset]) * GRID_NS
        ours = score_events([GroundTruth(events, False, (0, 10**10))], [alarm * GRID_NS], rules)
        found = [float(value) for value in (ours.f1, ours.precision, ours.recall)]
        assert found == pytest.approx([f1, precision, recall], rel=1e-12)  # their F1 is a mean of rounded ratios


few_times = st.lists(st.integers(0, 12), max_size=5).map(lambda ms: np.asarray(ms, dtype=np.int64) * MS)


@given(times, times, policies)
def test_each_pair_lies_within_the_window_and_nothing_is_used_twice(onset, alarm, sides):
    events, hits = match(onset, alarm, sides)
    late = alarm[hits] - onset[events]
    assert np.all((late >= -round(sides.window_before_s * 1e9)) & (late <= round(sides.window_after_s * 1e9)))
    assert len(set(events.tolist())) == len(set(hits.tolist())) == events.size == hits.size


def test_of_two_alarms_on_one_event_the_first_is_the_hit():
    events, hits = match(np.array([100 * MS]), np.array([160 * MS, 120 * MS]), policy())
    assert (events.tolist(), hits.tolist()) == ([0], [1])
