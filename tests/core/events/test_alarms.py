"""Alarms against a detector that sees one frame at a time, their matching against mir_eval, and scores by hand."""

import mir_eval
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.events.alarms import alarms, match, score_events, time_base
from tactbench.core.spec.events import nanoseconds
from tests.core.events.made import MS, clocks, policies, policy, seconds, truth, truths


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


GRID_S = 2.0**-9
"""A whole number of nanoseconds, and exact in floating point: both libraries see the same ties."""
GRID_NS = 1_953_125


def test_as_many_pairs_as_mir_eval_on_ten_thousand_random_cases():
    rng = np.random.default_rng(19)
    differences = 0
    for _ in range(10_000):
        # Onsets, alarms and the window's two sides, in steps of the grid; often crowded, with equal times.
        length = int(rng.integers(5, 400))
        onset, alarm = (np.sort(rng.integers(0, length, int(rng.integers(0, 25)))) for _ in range(2))
        before, after = (int(side) for side in rng.integers(0, 40, 2))

        # mir_eval's window is symmetric: the distance from the middle of ours, in half steps.
        def distance(a, b, middle=after - before):
            return np.abs(2 * np.subtract.outer(b, a).T - middle)

        theirs = mir_eval.util.match_events(onset, alarm, before + after, distance=distance)
        sides = policy(before=before * GRID_S, after=after * GRID_S)
        differences += len(match(onset * GRID_NS, alarm * GRID_NS, sides)[0]) != len(theirs)
    assert differences == 0


def test_of_two_alarms_on_one_event_the_first_is_the_hit():
    events, hits = match(np.array([100 * MS]), np.array([10, 120, 160]) * MS, policy())
    assert (events.tolist(), hits.tolist()) == ([0], [1])


def test_an_alarm_ten_seconds_after_the_event_is_false_whatever_the_defaults_of_others_say():
    """With its defaults, timescoring 0.0.7 says F1 = 1 and no false alarm."""
    event, raised = truth([(100.0, 110.0)], span=(0.0, 600.0)), seconds(95.0, 101.0, 108.0, 120.0)
    scores = score_events([event], [raised], policy(before=0.5, after=2.0))
    assert (scores.n_hits, scores.n_alarms, scores.f1) == (1, 4, pytest.approx(0.4))
    # 95 s and 120 s; that at 108 s lies in the event, which is no time to count false alarms on.
    assert scores.n_false_alarms == 2
    assert scores.false_alarms_per_minute == pytest.approx(2 / ((600 - 10.5) / 60), rel=1e-9)


def test_counts_and_latencies_by_hand():
    first, second = truth([(10.0, 12.0), (30.0, 31.0)]), truth([(5.0, 6.0)], disturbance=True, span=(0.0, 30.0))
    rules = policy(before=0.05, after=0.2, time="disturbances")
    scores = score_events([first, second], [seconds(2.0, 9.98, 10.1, 30.15, 50.0), seconds(5.5, 21.0, 22.0)], rules)
    assert np.array_equal(scores.latency_s, [-0.02, 0.15, np.nan], equal_nan=True)
    assert (scores.n_hits, scores.n_misses, scores.n_alarms, scores.n_false_alarms) == (2, 1, 8, 2)
    assert (scores.precision, scores.recall) == (2 / 8, 2 / 3)
    assert scores.f1 == 4 / 11
    # 30 s less the event with its window; the window's last nanosecond belongs to the window.
    assert scores.base_ns == 30_000_000_000 - 1_050_000_001
    assert scores.latency_percentile_s(50) == pytest.approx(0.065)


def test_what_cannot_be_said_is_nan_and_no_number():
    nothing = score_events([truth(span=(0.0, 0.0))], [seconds()], policy())
    undefined = (nothing.precision, nothing.recall, nothing.f1, nothing.false_alarms_per_minute)
    assert all(np.isnan(value) for value in undefined)
    assert np.isnan(nothing.latency_percentile_s(50))
    missed = score_events([truth([(10.0, 12.0)])], [seconds()], policy())
    assert np.isnan(missed.precision)
    assert (missed.recall, missed.f1, missed.false_alarms_per_minute) == (0.0, 0.0, 0.0)


@given(truths, policies)
def test_the_time_base_holds_what_its_definition_says_millisecond_by_millisecond(truth_of, rules):
    clock = np.arange(-5, 100, dtype=np.int64) * MS
    expected = []
    for now in clock.tolist():
        in_span = truth_of.span_ns[0] <= now < truth_of.span_ns[1]
        named = in_span and (truth_of.disturbance or rules.false_alarm_time == "non-events")
        taken = any(
            onset - nanoseconds(rules.window_before_s) <= now <= max(onset + nanoseconds(rules.window_after_s), end)
            for onset, end in truth_of.event_ns.tolist()
        )
        expected.append(named and not taken)
    held, length_ns = time_base(truth_of, rules, clock)
    assert np.array_equal(held, expected)
    # Its length is the number of held milliseconds but for the ends of events, which hold one nanosecond more.
    assert abs(length_ns - sum(expected) * MS) <= MS * len(truth_of.event_ns)
