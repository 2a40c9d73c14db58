"""Intervals of few sessions: on which scale, and where the scale has an end."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tactbench.core.evaluation.interval import FURTHEST, influences, score_interval, transform_of
from tactbench.core.evaluation.metrics import METRICS


@given(st.lists(st.floats(-100, 100), min_size=2, max_size=20))
def test_leaving_one_out_of_a_mean_gives_its_standard_error(values):
    x = np.array(values)
    without = (x.sum() - x) / (len(x) - 1)
    found = influences(without, np.zeros(len(x), dtype=np.int64))
    assert np.sqrt((found**2).sum()) == pytest.approx(stats.sem(x), abs=1e-9)


def test_replicates_stand_in_within_their_stratum_only():
    """Two strata of equal weight: the variances of their means add, and what they differ by is no spread."""
    x = np.array([1.0, 2.0, 3.0, 101.0, 103.0, 105.0])
    strata = np.array([0, 0, 0, 1, 1, 1])
    parts = [x[:3], x[3:]]
    without = [(parts[0].sum() - v) / 2 + parts[1].mean() for v in parts[0]]
    without += [parts[0].mean() + (parts[1].sum() - v) / 2 for v in parts[1]]
    found = influences(np.array(without), strata)
    assert (found**2).sum() == pytest.approx(sum(stats.sem(part) ** 2 for part in parts))


@pytest.mark.parametrize("metric", sorted(METRICS))
@given(st.floats(0.01, 0.99))
def test_a_scale_and_back_is_where_it_began(metric, value):
    scale = transform_of(metric, 0.5, 1000)
    assert scale.back(scale.there(value)) == pytest.approx(value, rel=1e-9)


def over_sessions(error, metric="rmse", y=None, classes=0):
    code = np.repeat(np.arange(len(error)), error.shape[1])
    y = np.zeros(error.size, dtype=np.int64 if classes else np.float64) if y is None else y
    return score_interval(METRICS[metric], y, error.ravel(), code, code, "session", classes, 0)


def test_the_interval_of_a_share_stays_a_share_and_holds_its_score():
    wrong = np.zeros((6, 50), dtype=np.int64)
    wrong[0, :9] = 1
    found = over_sessions(wrong, "accuracy", classes=2)
    assert 0 < found.low < 0.97 < found.high < 1


def test_where_not_one_was_wrong_the_interval_has_width():
    """A row of 1.000 from few sessions must not look as if nothing could go wrong."""
    found = over_sessions(np.zeros((5, 60), dtype=np.int64), "accuracy", classes=2)
    assert found.high == 1.0
    assert 0.9 < found.low < 0.99
    many = over_sessions(np.zeros((40, 600), dtype=np.int64), "accuracy", classes=2)
    assert found.low < many.low < 1


def test_few_sessions_that_differ_wildly_put_a_bound_of_ten_times_the_error():
    error = np.ones((5, 20)) * np.array([0.001, 0.001, 0.001, 0.001, 10.0])[:, None]
    found = over_sessions(error)
    assert found.high == pytest.approx(FURTHEST * np.sqrt((error**2).mean()))
    assert 0 < found.low < 1


def test_no_error_at_all_and_labels_of_one_session_only():
    found = over_sessions(np.zeros((5, 10)))
    assert (found.low, found.high) == pytest.approx((0.0, 0.0), abs=1e-100)  # the reciprocal of nothing ends somewhere
    y = np.concatenate([np.linspace(0, 1, 20), np.zeros(80)])  # without the first session R² is undefined
    rng = np.random.default_rng(0)
    found = over_sessions((y + 0.01 * rng.normal(size=100)).reshape(5, 20), "r2", y)
    assert np.isfinite([found.low, found.high]).all()
    assert found.low <= found.high <= 1
