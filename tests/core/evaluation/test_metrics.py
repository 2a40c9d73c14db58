"""Metrics against scikit-learn, and their intervals against theory and coverage."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from sklearn import metrics as reference

from tactbench.core.errors import UsageError
from tactbench.core.evaluation.interval import ReplicateUnits, influences, score_interval, transform_of
from tactbench.core.evaluation.metrics import METRICS, Metric

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(2, 60), st.sampled_from([0.0, 1e8]))
def test_regression_metrics_are_those_of_scikit_learn(seed, n, offset):
    rng = np.random.default_rng(seed)
    y, p = offset + rng.normal(size=n), offset + rng.normal(size=n)
    mae = reference.mean_absolute_error(y, p)
    assert METRICS["rmse"].of(y, p) == pytest.approx(reference.root_mean_squared_error(y, p), rel=1e-9)
    assert METRICS["mae"].of(y, p) == pytest.approx(mae, rel=1e-9)
    assert METRICS["r2"].of(y, p) == pytest.approx(reference.r2_score(y, p), rel=1e-6)
    some = METRICS["r2"].rows(y, p, 0)[: n // 2 + 1].sum(axis=0)
    assert METRICS["r2"].score(some, 0) == pytest.approx(reference.r2_score(y[: n // 2 + 1], p[: n // 2 + 1]), rel=1e-5)
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


def test_a_metric_of_the_callers_own_may_be_undefined_and_its_other_errors_are_named():
    def own(y, p):
        if len(y) == 1:
            raise ValueError
        return y[2] - p[0]

    metric = Metric("own", "regression", None, None, function=own)
    assert (np.isnan(metric.of(np.zeros(1), np.zeros(1))), metric.of(np.arange(3.0), np.ones(3))) == (True, 1.0)
    with pytest.raises(UsageError, match="IndexError"):
        metric.of(np.zeros(2), np.zeros(2))


def interval(y, p, cluster, metric="rmse", n_classes=0):
    return score_interval(METRICS[metric], y, p, ReplicateUnits("session", cluster, ()), n_classes)


def test_fewer_than_five_units_or_of_a_class_have_no_interval():
    rng = np.random.default_rng(0)
    y, error = rng.normal(size=600), rng.normal(size=600)
    assert interval(y, y + error, np.arange(600) % 4).low is None
    assert interval(y, y + error, np.arange(600) % 5).low is not None
    cluster, kind = np.arange(600) // 100, (np.arange(600) >= 400).astype(int)
    assert interval(kind, kind, cluster, "accuracy", 2).low is None, "two units alone hold the second class"


def test_units_whose_own_score_is_undefined_do_not_count():
    unit, error = np.arange(600) // 100, np.random.default_rng(0).normal(size=600)
    for undefined, some in ((1, True), (2, False)):
        y = np.tile([-1.0, 1.0], 300) * (unit >= undefined)
        assert (interval(y, y + 0.1 * error, unit, "r2").low is not None) == some


def test_an_error_that_few_units_do_not_bound_is_open_above():
    error = np.repeat([0.0, 0.0, 0.0, 0.0, 1.0], 20)
    assert interval(0 * error, error, np.repeat(np.arange(5), 20)).high is None


def test_a_share_near_the_middle_has_the_interval_of_the_jackknife_however_few_units_are_right():
    """Two of ten units are right, and none of the others: a share of 0.2 is no share near 0."""
    code, y = np.repeat(np.arange(10), 20), np.tile([0, 1], 100)
    found = interval(y, np.where(code < 2, y, 1 - y), code, "accuracy", 2)
    assert "Clopper" not in found.method
    found = interval(y, np.where(code < 2, 1 - y, y), code, "accuracy", 2)
    assert "Clopper" not in found.method
    once = np.where(np.arange(200) == 3, y, 1 - y)
    right, wrong = (interval(y, one, code, "accuracy", 2) for one in (once, 1 - once))
    assert (right.low, right.high) == pytest.approx((1 - wrong.high, 1 - wrong.low)), "one right as one mistake"


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
    scale = transform_of(METRICS[metric], 0.5, 1000)
    assert scale.back(scale.there(value)) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize("metric", [name for name, metric in METRICS.items() if metric.kind != "regression"])
@given(st.integers(5, 40), st.integers(10, 200), st.randoms(use_true_random=False))
def test_the_interval_of_an_answer_with_few_mistakes_is_no_narrower_than_of_one_without(metric, units, rows, random):
    """Rows of a unit may stand or fall together: a hundred from each are no surer than ten."""
    code = np.repeat(np.arange(units), 2 * rows)
    y = np.tile([0, 1], units * rows)
    few = [y.copy(), y.copy()]  # mistakes in the second class, which events are of
    for place in random.sample(range(1, len(y), 2), 2):
        few[1][place] ^= 1
    few[0][random.randrange(1, len(y), 2)] ^= 1
    perfect, none, one, two = (interval(y, p, code, metric, 2) for p in (y, 1 - y, *few))
    known = stats.binomtest(units, units).proportion_ci(0.95, "exact")
    assert (perfect.low, perfect.high) == pytest.approx((known.low, 1.0))
    assert (none.low, none.high) == pytest.approx((0.0, 1 - known.low))
    assert all(found.low < perfect.low and found.high - found.low > perfect.high - perfect.low for found in (one, two))
