"""Scores by hand-made cases, by definition point for point, and where defaults of others would mislead."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.events.alarms import match
from tactbench.core.events.metrics import GroundTruth, TimeBase, displacement_at_detection, score_events
from tactbench.core.spec.events import nanoseconds
from tests.core.events.made import MS, policies, policy, seconds, times, truth, truths

# One event from 100 s to 110 s; three alarms around it, and one 10 s after its end.
# timescoring 0.0.7 with its defaults says F1 = 1 and no false alarm.
SEIZURE = truth([(100.0, 110.0)], span=(0.0, 600.0))
ALARMS = seconds(95.0, 101.0, 108.0, 120.0)


def test_an_alarm_ten_seconds_after_the_event_is_false_whatever_the_defaults_of_others_say():
    scores = score_events([SEIZURE], [ALARMS], policy(before=0.5, after=2.0))
    assert (scores.n_hits, scores.n_alarms, scores.n_misses) == (1, 4, 0)
    assert scores.precision == 0.25
    assert scores.f1 == pytest.approx(0.4)
    # 95 s and 120 s; that at 108 s lies in the event, which is no time to count false alarms on.
    assert scores.n_false_alarms == 2
    assert scores.false_alarms_per_minute == pytest.approx(2 / ((600 - 10.5) / 60), rel=1e-9)


def test_counts_and_latencies_by_hand():
    first = truth([(10.0, 12.0), (30.0, 31.0)], disturbances=[(0.0, 6.0), (4.0, 8.0), (29.0, 33.0)])
    second = truth([(5.0, 6.0)], disturbances=[(20.0, 26.0)])
    rules = policy(before=0.05, after=0.2, time="disturbances")
    scores = score_events([first, second], [seconds(2.0, 9.98, 10.1, 30.15, 50.0), seconds(21.0, 22.0)], rules)
    assert np.array_equal(scores.latency_s, [-0.02, 0.15, np.nan], equal_nan=True)
    assert (scores.n_hits, scores.n_misses, scores.n_alarms, scores.n_false_alarms) == (2, 1, 7, 3)
    assert (scores.precision, scores.recall) == (2 / 7, 2 / 3)
    assert scores.f1 == 4 / 10
    # 8 s, then 4 s less the event with its window, then 6 s; the window's last nanosecond belongs to the window.
    assert scores.base_s == pytest.approx(8.0 + 4.0 - 1.05 + 6.0, abs=1.1e-9)
    assert scores.latency_percentile_s(50) == pytest.approx(0.065)


def test_what_cannot_be_said_is_nan_and_no_number():
    nothing = score_events([truth(span=(0.0, 0.0))], [seconds()], policy())
    undefined = (nothing.precision, nothing.recall, nothing.f1, nothing.false_alarms_per_minute)
    assert all(np.isnan(value) for value in undefined)
    assert np.isnan(nothing.latency_percentile_s(50))
    missed = score_events([truth([(10.0, 12.0)])], [seconds()], policy())
    assert np.isnan(missed.precision)
    assert (missed.recall, missed.f1, missed.false_alarms_per_minute, missed.n_misses) == (0.0, 0.0, 0.0, 1)


@given(truths, policies)
def test_the_time_base_holds_what_its_definition_says_millisecond_by_millisecond(truth_of, rules):
    clock = np.arange(-5, 100, dtype=np.int64) * MS
    expected = []
    for now in clock.tolist():
        within = [begin <= now < end for begin, end in truth_of.disturbance_ns.tolist()]
        in_span = truth_of.span_ns[0] <= now < truth_of.span_ns[1]
        named = any(within) and in_span if rules.false_alarm_time == "disturbances" else in_span
        taken = any(
            onset - nanoseconds(rules.window_before_s) <= now <= max(onset + nanoseconds(rules.window_after_s), end)
            for onset, end in truth_of.event_ns.tolist()
        )
        expected.append(named and not taken)
    base = TimeBase.of(truth_of, rules)
    assert np.array_equal(base.holds(clock), expected)
    # Its length is the number of held milliseconds but for the ends of events, which hold one nanosecond more.
    assert abs(base.length_ns - sum(expected) * MS) <= MS * len(truth_of.event_ns)


@given(truths, times, policies)
def test_no_hit_lies_in_the_time_base_of_false_alarms(truth_of, alarm_ns, rules):
    hits = match(truth_of.event_ns[:, 0], alarm_ns, rules)[1]
    assert not TimeBase.of(truth_of, rules).holds(alarm_ns[hits]).any()


@given(st.lists(st.integers(-50, 200), max_size=9), st.integers(0, 3), st.sampled_from([0.0, 5.0, 50.0, 95.0, 100.0]))
def test_percentiles_are_numpys_over_the_hits(late_ms, misses, percent):
    onset = np.arange(len(late_ms) + misses) * 1000 * MS
    events = np.column_stack([onset, onset + MS]).reshape(-1, 2).astype(np.int64)
    alarm = onset[: len(late_ms)] + np.asarray(late_ms, dtype=np.int64) * MS
    scores = score_events([GroundTruth(events, events[:0], (0, 10**10))], [alarm], policy())
    found = scores.latency_percentile_s(percent)
    expected = np.percentile(np.asarray(late_ms) / 1000, percent) if late_ms else np.nan
    assert found == pytest.approx(expected, abs=1e-12, nan_ok=True)  # a few roundings of numbers below 0.2
    assert scores.n_misses == misses


def test_displacement_at_detection_is_what_the_surface_moved_since_the_onset():
    clock = seconds(0.0, 1.0, 2.0, 3.0)
    displacement = np.array([0.0, 0.0, 0.010, 0.030])
    onset = seconds(1.0, 1.0, 1.0, 2.5, 1.0)
    late = np.array([0.5, -0.5, 1.5, 1.0, np.nan])
    moved = displacement_at_detection(onset, late, clock, displacement)
    assert moved == pytest.approx([0.005, 0.0, 0.020, np.nan, np.nan], nan_ok=True)
