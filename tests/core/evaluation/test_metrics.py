import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn import metrics as reference

from tactbench.core.evaluation.interval import block_length, score_interval
from tactbench.core.evaluation.metrics import METRICS

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(2, 60), st.sampled_from([0.0, 1e8]))
def test_regression_metrics_are_those_of_scikit_learn(seed, n, offset):
    rng = np.random.default_rng(seed)
    y, p = offset + rng.normal(size=n), offset + rng.normal(size=n)
    assert METRICS["rmse"].of(y, p) == pytest.approx(reference.root_mean_squared_error(y, p), rel=1e-9)
    assert METRICS["mae"].of(y, p) == pytest.approx(reference.mean_absolute_error(y, p), rel=1e-9)
    assert METRICS["r2"].of(y, p) == pytest.approx(reference.r2_score(y, p), rel=1e-6)


@given(seeds, st.integers(1, 60), st.integers(2, 6))
def test_classification_metrics_are_those_of_scikit_learn(seed, n, classes):
    rng = np.random.default_rng(seed)
    y, p = rng.integers(0, classes, n), rng.integers(0, classes, n)
    labels = np.arange(classes)
    f1 = reference.f1_score(y, p, labels=labels, average="macro", zero_division=0.0)
    assert METRICS["macro_f1"].of(y, p, classes) == pytest.approx(f1, abs=1e-12)
    assert METRICS["accuracy"].of(y, p, classes) == pytest.approx(reference.accuracy_score(y, p), abs=1e-12)
    recalls = [np.mean(p[y == one] == one) for one in labels if (y == one).any()]
    assert METRICS["balanced_accuracy"].of(y, p, classes) == pytest.approx(np.mean(recalls), abs=1e-12)


def interval(y, p, recording, cluster, metric="rmse", n_classes=0, seed=0):
    return score_interval(METRICS[metric], y, p, recording, cluster, "session", n_classes, seed)


def test_sessions_are_resampled_where_there_are_enough():
    rng = np.random.default_rng(0)
    cluster = np.repeat(np.arange(12), 50)
    y = rng.normal(size=600)
    p = y + 0.3 * rng.normal(size=12)[cluster] + 0.01 * rng.normal(size=600)
    by_session = interval(y, p, cluster, cluster)
    assert "12 sessions" in by_session.method
    within = interval(y, p, cluster, np.zeros(600, dtype=int))
    assert "spread between sessions is not in it" in within.method
    assert within.high - within.low < by_session.high - by_session.low, "time alone does not see the sessions' spread"


def test_a_class_in_few_sessions_is_never_resampled_away():
    recording = np.repeat(np.arange(5), 100)
    y = recording.copy()
    p = np.where(np.random.default_rng(0).random(500) < 0.7, y, 0)
    found = interval(y, p, recording, recording, "macro_f1", 5)
    assert "within 5 recordings" in found.method
    assert found.low < METRICS["macro_f1"].of(y, p, 5) < found.high


def test_the_interval_is_decided_by_the_seed():
    rng = np.random.default_rng(0)
    y, p, one = rng.normal(size=300), rng.normal(size=300), np.zeros(300, dtype=int)
    assert interval(y, p, one, one) == interval(y, p, one, one)
    assert interval(y, p, one, one) != interval(y, p, one, one, seed=1)


def autoregressive(rng, n, a):
    x = np.empty(n)
    x[0] = rng.normal() / np.sqrt(1 - a * a)
    for t in range(1, n):
        x[t] = a * x[t - 1] + rng.normal()
    return x


def test_blocks_grow_with_the_memory_of_the_loss():
    rng = np.random.default_rng(2)
    lengths = [np.median([block_length(autoregressive(rng, 2000, a)) for _ in range(9)]) for a in (0.0, 0.7, 0.95)]
    assert lengths[0] == np.ceil(2000 ** (1 / 3))
    assert lengths[0] <= lengths[1] < lengths[2]
    assert lengths[2] > 30


def test_the_block_interval_covers_the_truth_where_errors_have_memory():
    rng = np.random.default_rng(4)
    hits, naive = 0, 0
    trials, n, a = 120, 1500, 0.8
    truth = 1 / np.sqrt(1 - a * a)
    for trial in range(trials):
        error = autoregressive(rng, n, a)
        zeros = np.zeros(n, dtype=int)
        found = interval(np.zeros(n), error, zeros, zeros, seed=trial)
        hits += found.low <= truth <= found.high
        half = 1.96 * np.std(error**2) / np.sqrt(n) / (2 * np.sqrt(np.mean(error**2)))
        naive += abs(np.sqrt(np.mean(error**2)) - truth) <= half
    # Nominal 95 %: 114 of 120, binomial deviation 2.4. Blocks of a finite recording undercover a little; samples taken
    # as independent cover far less, which is what this interval is for.
    assert hits >= 0.88 * trials
    assert naive < hits


def test_equal_errors_have_an_interval_of_no_width():
    y, one = np.zeros(50), np.zeros(50, dtype=int)
    found = interval(y, y + 0.5, one, one)
    assert found.low == pytest.approx(0.5)
    assert found.high == pytest.approx(0.5)
