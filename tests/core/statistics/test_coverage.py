"""Intervals cover what they say: a quick part of ``benchmarks/coverage.py``, which has the whole table."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tactbench.core.evaluation.interval import ReplicateUnits, score_interval
from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.statistics.ranking import ranks

TRIALS = 250
FEWEST = int(stats.binom.ppf(0.001, TRIALS, 0.95))
"""226 of 250: an interval that covers 95 % has fewer in one run of a thousand. That of an RMSE over six sessions covers
about 93.5 % and may have fewer with another seed; 216, what 92 % would have, would let percentiles through."""


@pytest.fixture(scope="module")
def synthetic():
    """The synthetic sensors of the benchmark."""
    path = Path(__file__).parents[3] / "benchmarks" / "coverage.py"
    spec = importlib.util.spec_from_file_location("coverage_of_intervals", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("sessions", [6, 15])
@pytest.mark.parametrize("metric", ["rmse", "macro_f1"])
def test_the_interval_of_a_score_covers_the_truth(synthetic, metric, sessions):
    """Widened percentiles of six resampled sessions have 225 (RMSE) and 213 (F1) of these 250."""
    draw, k = (synthetic.numbers, 0) if metric == "rmse" else (synthetic.classes, synthetic.CLASSES)
    truth = synthetic.truth_of(metric, draw, 0.5, 1.0)
    rng = np.random.default_rng([1, sessions])
    code = np.repeat(np.arange(sessions), synthetic.ROWS)
    unit = ReplicateUnits("session", code, ())
    hits = 0
    for _ in range(TRIALS):
        y, answered = draw(rng, sessions, 0.5, 1.0)
        found = score_interval(METRICS[metric], y.ravel(), answered.ravel(), unit, k)
        hits += found.low <= truth <= (np.inf if found.high is None else found.high)
    assert hits >= FEWEST


def test_the_best_of_ten_and_all_others_have_their_rank_in_its_interval(synthetic):
    """Ranks resampled with the sessions cover 80 % of these near ties."""
    rng = np.random.default_rng(3)
    share = []
    for _ in range(60):
        shared = rng.normal(size=(8, 1))
        sums = [synthetic.sums_of("rmse", *synthetic.numbers(rng, 8, 0.5, 1 + 0.01 * n, shared)) for n in range(10)]
        found = ranks([synthetic.row_of(str(place), "rmse", one) for place, one in enumerate(sums)])
        share.append(np.mean([found[str(n)].low <= n + 1 <= found[str(n)].high for n in range(10)]))
    assert np.mean(share) >= 0.92
