"""Metrics against scikit-learn, and their intervals against theory and coverage."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal, stats
from sklearn import metrics as reference

from tactbench.core.evaluation.interval import ReplicateUnits, influences, score_interval, transform_of
from tactbench.core.evaluation.metrics import METRICS

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(2, 60), st.sampled_from([0.0, 1e8]))
def test_regression_metrics_are_those_of_scikit_learn(seed, n, offset):
    rng = np.random.default_rng(seed)
    y, p = offset + rng.normal(size=n), offset + rng.normal(size=n)
    mae = reference.mean_absolute_error(y, p)
    assert METRICS["rmse"].of(y, p) == pytest.approx(reference.root_mean_squared_error(y, p), rel=1e-9)
    assert METRICS["mae"].of(y, p) == pytest.approx(mae, rel=1e-9)
    assert METRICS["r2"].of(y, p) == pytest.approx(reference.r2_score(y, p), rel=1e-6)
    # Each difference is (d, -d).
    assert METRICS["mean_euclidean_error"].of(np.c_[y, p], np.c_[p, y]) == pytest.approx(np.sqrt(2) * mae, rel=1e-9)


@given(seeds, st.integers(1, 60), st.integers(2, 6))
def test_classification_metrics_are_those_of_scikit_learn(seed, n, classes):
    rng = np.random.default_rng(seed)
    y, p = rng.integers(0, classes, n), rng.integers(0, classes, n)
    f1 = reference.f1_score(y, p, labels=np.arange(classes), average="macro", zero_division=0.0)
    assert METRICS["macro_f1"].of(y, p, classes) == pytest.approx(f1, abs=1e-12)
    assert METRICS["accuracy"].of(y, p, classes) == pytest.approx(reference.accuracy_score(y, p), abs=1e-12)
    recall = reference.recall_score(y, p, labels=np.unique(y), average="macro")
    assert METRICS["balanced_accuracy"].of(y, p, classes) == pytest.approx(recall, abs=1e-12)


def interval(y, p, recording, cluster, metric="rmse", n_classes=0, seed=0):
    return score_interval(METRICS[metric], y, p, recording, ReplicateUnits("session", cluster, ()), n_classes, seed)


def test_sessions_are_resampled_where_there_are_enough():
    rng = np.random.default_rng(0)
    cluster = np.repeat(np.arange(12), 50)
    y = rng.normal(size=600)
    p = y + 0.3 * rng.normal(size=12)[cluster] + 0.01 * rng.normal(size=600)
    by_session = interval(y, p, cluster, cluster)
    within = interval(y, p, cluster, 0 * cluster)
    assert within.high - within.low < by_session.high - by_session.low, "time alone does not see the sessions' spread"


def test_the_block_interval_covers_the_truth_where_errors_have_memory():
    rng = np.random.default_rng(4)
    hits = 0
    trials, n, a = 120, 1500, 0.8
    truth = 1 / np.sqrt(1 - a * a)
    for trial in range(trials):
        error = signal.lfilter([1.0], [1.0, -a], rng.normal(size=n + 100))[100:]
        zeros = np.zeros(n, dtype=int)
        found = interval(np.zeros(n), error, zeros, zeros, seed=trial)
        hits += found.low <= truth <= found.high
    # Nominal 95 %: 114 of 120, binomial deviation 2.4. Blocks of a finite recording undercover a little; samples taken
    # as independent cover far less: the variance of a mean square would be too small by (1 + a²) / (1 - a²), here 4.6.
    assert hits >= 0.88 * trials


@given(st.lists(st.lists(st.floats(-100, 100), min_size=2, max_size=20), min_size=1, max_size=3))
def test_leaving_one_out_of_a_sum_of_means_gives_its_standard_error(strata):
    """The variances of the means of strata add, and what they differ by is no spread."""
    total = sum(np.mean(part) for part in strata)
    without = [total - np.mean(part) + (np.sum(part) - x) / (len(part) - 1) for part in strata for x in part]
    found = influences(np.array(without), np.repeat(np.arange(len(strata)), [len(part) for part in strata]))
    assert (found**2).sum() == pytest.approx(sum(stats.sem(part) ** 2 for part in strata), abs=1e-9)


@pytest.mark.parametrize("metric", sorted(METRICS))
@given(st.floats(0.01, 0.99))
def test_a_scale_and_back_is_where_it_began(metric, value):
    scale = transform_of(metric, 0.5, 1000)
    assert scale.back(scale.there(value)) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize("metric", [name for name, metric in METRICS.items() if metric.kind != "regression"])
@given(st.integers(5, 40), st.integers(10, 200), st.randoms(use_true_random=False))
def test_where_one_or_none_was_wrong_the_interval_depends_on_the_number_of_units(metric, units, rows, random):
    """Rows of a unit may stand or fall together: a hundred from each are no surer than ten."""
    code = np.repeat(np.arange(units), 2 * rows)
    y = np.tile([0, 1], units * rows)
    wrong = y.copy()
    wrong[random.randrange(len(y))] ^= 1
    perfect, none, one = (interval(y, p, code, code, metric, 2) for p in (y, 1 - y, wrong))
    known = stats.binomtest(units, units).proportion_ci(0.95, "exact")
    assert (perfect.low, perfect.high) == pytest.approx((known.low, 1.0))
    assert (none.low, none.high) == pytest.approx((0.0, 1 - known.low))
    assert one.low <= perfect.low
