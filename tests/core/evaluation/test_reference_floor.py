"""The floor of the reference, and errors beyond it."""

import numpy as np
import pytest
from scipy import signal, stats

from tactbench.core.evaluation.interval import ReplicateUnits
from tactbench.core.evaluation.reference_floor import FEWEST, Floor, beyond_floor, hold_of, integrated_correlation
from tactbench.core.samples import Answers
from tactbench.core.spec.scene import ForceLoop

from .made import evaluated, force_task, held, roles

SIGMA = 0.6875


def low_passed(rng, n, memory):
    """White noise behind a first-order low-pass, of deviation SIGMA, settled before it begins."""
    settled = 20 * int(1 / (1 - memory))
    white = rng.standard_normal(n + settled) * SIGMA * np.sqrt(1 - memory**2)
    return signal.lfilter([1.0], [1.0, -memory], white)[settled:]


@pytest.mark.parametrize(("n", "memory"), [(600, 0.0), (12, 0.0), (600, 0.9), (120, 0.8)])
def test_the_variance_of_a_hold_is_unbiased_white_or_filtered_long_or_short(n, memory):
    """Over 400 recordings: 3 % of the deviation is 6 % of the variance."""
    rng = np.random.default_rng(11)
    noise = [low_passed(rng, n, memory) for _ in range(400)]
    offsets = rng.normal(0, 5, len(noise))
    holds = {place: hold_of(one + offset) for place, (one, offset) in enumerate(zip(noise, offsets, strict=True))}
    # Correlated samples are worth n (1 - m²) / (1 + m²) independent ones: three standard errors of so many, at most
    # 3 %, and no less than what the estimated correlation of a short hold is known to leave (1.3 % at 0.8 of 120).
    worth = len(noise) * (n - 1) * (1 - memory**2) / (1 + memory**2)
    assert Floor(holds).value == pytest.approx(SIGMA, rel=min(0.03, max(3 / np.sqrt(2 * worth), 0.015)))


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_the_standard_error_of_a_floor_is_the_spread_of_floors_white_or_filtered(memory):
    rng = np.random.default_rng(12)
    floors = [Floor({0: hold_of(low_passed(rng, 600, memory)), 1: hold_of(low_passed(rng, 600, memory))})
              for _ in range(300)]  # fmt: skip
    spread = np.std([one.value for one in floors])
    assert np.mean([one.standard_error for one in floors]) == pytest.approx(spread, rel=0.15)


def asked(error, recordings, seed):
    """What an estimator with (n,) errors of this deviation answers, a noisy reference beside it, and its floor."""
    rng, rows, hold = np.random.default_rng(seed), 4400, 600
    n = rows * recordings
    recording = np.repeat(np.arange(recordings), rows)
    true = np.tile(np.linspace(0, 5, rows), recordings)
    y = true + SIGMA * rng.standard_normal(n)
    predicted = true + error * rng.standard_normal(n)
    row = np.tile(np.arange(hold, hold + rows), recordings)
    answers = Answers(y, predicted, recording, row, np.zeros(n, dtype=np.int64), row / 83.3, y)
    holds = {place: hold_of(SIGMA * rng.standard_normal(hold)) for place in range(recordings)}
    unit = ReplicateUnits("session", recording, tuple(f"s{place}" for place in range(recordings)))
    return answers, unit, Floor(holds)


@pytest.mark.parametrize(("error", "recordings", "most"), [(0.5, 5, 0.06), (2.0, 5, 0.03)])
def test_the_error_of_its_own_comes_out_from_below_the_noise(error, recordings, most):
    inside, scores = [], []
    for seed in range(60):
        answers, unit, floor = asked(error, recordings, seed)
        score, found = beyond_floor(floor, answers, unit)
        inside.append(found.low <= error <= found.high)
        scores.append(score)
    assert np.mean(scores) == pytest.approx(error, rel=0.05)
    assert np.std(scores) < most
    # 95 % promised; of 60, 51 or fewer would come by chance in one run of 300.
    assert np.sum(inside) >= 52


def test_the_interval_beyond_a_floor_leaves_each_unit_out_with_its_hold():
    answers, unit, floor = asked(0.5, 6, 1)
    score, found = beyond_floor(floor, answers, unit)
    squares = (answers.y_pred - answers.y_true) ** 2
    others = [squares[unit.codes != one].mean() - Floor({k: v for k, v in floor.holds.items() if k != one}).square
              for one in range(6)]  # fmt: skip
    reach = stats.t.ppf(0.975, 5) * np.sqrt(5 / 6 * np.sum((others - np.mean(others)) ** 2))
    expected = np.sqrt([score**2 - reach, score**2 + reach])
    assert (found.low, found.high) == pytest.approx(expected, rel=1e-9)


def naive_correlation(x):
    """The sum of a flat-top window over lags, lag by lag (Politis and White 2004, with the corrected constants)."""
    n, variance = len(x), np.mean(x**2)
    reach = max(5, int(np.ceil(np.sqrt(np.log10(n)))))
    longest = min(int(np.ceil(np.sqrt(n))) + reach, n - 1)
    rho = [np.sum(x[lag:] * x[: n - lag]) / n / variance for lag in range(n)]
    near = [abs(rho[lag]) < 2 * np.sqrt(np.log10(n) / n) for lag in range(1, longest + 1)]
    quiet = (lag for lag in range(longest - reach + 1) if all(near[lag : lag + reach]))
    width = min(2 * max(next(quiet, longest), 1), min(2 * longest, n - 1))
    weights = [min(1.0, 2 * (1 - lag / width)) for lag in range(width + 1)]
    return max(1.0, 2 * np.dot(weights, rho[: width + 1]) - 1)


@pytest.mark.parametrize(("n", "memory"), [(7, 0.0), (8, 0.9), (9, 0.0), (12, 0.5), (60, 0.9), (400, 0.95), (300, 0.0)])
def test_integrated_correlation_is_that_of_a_sum_lag_by_lag(n, memory):
    for seed in range(5):
        x = low_passed(np.random.default_rng(seed), n, memory)
        x = x - x.mean()
        assert integrated_correlation(x) == pytest.approx(naive_correlation(x) if n >= 8 else 1.0, rel=1e-9)


def result_of(folder, *, simulated=True, hold=7.2, samples=400, lost=0.0, **how):
    """What three recordings of 60 s come to, whose reference errs and whose taxels are the true force."""
    t_ns = (np.arange(samples) * 60 / samples * 1e9).astype(np.int64)
    true = np.interp(t_ns * 1e-9, [0, hold, 60], [0, 0, 5])

    def make(place):
        noise = np.random.default_rng(place).standard_normal((samples, 4))
        force = np.where(t_ns * 1e-9 < lost * place, np.nan, true + SIGMA * noise[:, 3])
        return true[:, None] * [1.0, 2.0, -1.0] + 1e-3 * noise[:, :3], force

    paths = roles(folder, make, t_ns=t_ns, scene=held("held", hold, samples=samples, **how), simulated=simulated)
    return evaluated(force_task(protocols=("deployable",), splits=("roles",)), paths, split="roles")


@pytest.mark.parametrize(
    ("how", "why"),
    [
        ({"hold": 0.0}, "no unloaded"),
        ({"drive": ForceLoop()}, "force loop"),
        ({"hold": 2.0}, f"than {FEWEST}"),
        ({"lost": 3.55}, "than two"),
    ],
)
def test_without_a_hold_that_tells_there_is_no_floor_and_the_row_says_why(tmp_path, how, why):
    result = result_of(tmp_path / "a", **how)
    assert result.score_beyond_floor is None
    assert any(why in remark for remark in result.remarks)
    assert "floor" not in result.replicates


@pytest.mark.parametrize("how", [{"simulated": False}, {"drive": ForceLoop()}])
def test_only_a_simulated_force_without_a_loop_is_known_truly(tmp_path, how):
    assert result_of(tmp_path / "a", **how).true_score is None
