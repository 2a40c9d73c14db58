"""The curve over all thresholds against each threshold on its own, and the operating point."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.errors import DataError
from tactbench.core.events.alarms import alarms
from tactbench.core.events.curve import ScoredRecording, threshold_curve
from tactbench.core.events.metrics import score_events
from tests.core.events.made import policies, policy, scored_recordings, seconds, truth


def at_one(recordings, threshold, rules):
    """Return the scores at one threshold, by way of its alarms."""
    raised = [alarms(one.t_ns, one.score >= threshold, rules) for one in recordings]
    return score_events([one.truth for one in recordings], raised, rules)


def assert_same(one, other):
    assert (one.n_alarms, one.n_false_alarms, one.base_ns) == (other.n_alarms, other.n_false_alarms, other.base_ns)
    assert np.array_equal(one.latency_s, other.latency_s, equal_nan=True)


@given(st.lists(scored_recordings(), max_size=3), policies)
def test_the_curve_is_each_threshold_on_its_own(recordings, rules):
    curve = threshold_curve(recordings, rules)
    # Every score that occurs, between them, below and above all; the rows of the curve themselves.
    for threshold in (-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 2.25, 2.5, 2.75, 3.0, 5.0, 7.0, 8.0, np.inf, *curve.threshold):
        assert_same(curve.at(threshold), at_one(recordings, threshold, rules))


@given(st.lists(scored_recordings(), min_size=1, max_size=2), policies, st.sampled_from([0.0, 500.0, 1e6]))
def test_the_operating_point_is_the_best_that_is_allowed(recordings, rules, bound):
    curve = threshold_curve(recordings, rules)
    rate = curve.scores.false_alarms_per_minute
    if np.isnan(rate).any() or curve.scores.latency_s.shape[1] == 0:
        with pytest.raises(DataError, match="operating point"):
            curve.operating_point(bound)
        return
    chosen = curve.at(curve.operating_point(bound))
    assert chosen.false_alarms_per_minute <= bound
    best = max(
        zip(curve.scores.recall, np.nan_to_num(curve.scores.f1), curve.threshold, rate <= bound, strict=True),
        key=lambda row: (row[3], *row[:3]),
    )
    assert curve.operating_point(bound) == best[2]
    assert chosen.recall == best[0]


def test_of_thresholds_of_equal_recall_the_fewest_false_positives_decide_and_then_the_highest():
    # An event at 1 s and a false rise at 5 s, outside the disturbance: each threshold up to 4 keeps the bound.
    clock, score = seconds(*range(10)), np.array([0.0, 4.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0])
    one = ScoredRecording(clock, score, truth([(1.0, 1.5)], span=(0.0, 10.0)))
    assert threshold_curve([one], policy()).operating_point(10.0) == 4.0
    # A second rise in the window of the event at every threshold above 2: the lower threshold has the better F1.
    score = np.array([0.0, 4.0, 2.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    one = ScoredRecording(clock, score, one.truth)
    assert threshold_curve([one], policy(after=3.0)).operating_point(0.0) == 2.0


def test_a_detector_that_hits_nothing_within_the_bound_never_raises_an_alarm():
    # On in every other second, from 1 s on; the onset at 4 s allows an alarm within 10 ms.
    clock = seconds(*np.arange(0.0, 20.0, 0.01))
    worthless = ScoredRecording(clock, (clock // 10**9 % 2).astype(float), truth([(4.0, 4.5)], span=(0.0, 20.0)))
    curve = threshold_curve([worthless], policy(before=0.0, after=0.01))
    assert curve.operating_point(0.0) == np.inf
