"""The floor of the reference, and errors beyond it."""

import numpy as np
import pytest
from scipy import signal

from tactbench.core.evaluation.interval import ReplicateUnits
from tactbench.core.evaluation.reference_floor import FEWEST, Floor, beyond_floor, hold_of
from tactbench.core.samples import Answers
from tactbench.core.spec.drive import ForceLoop

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


def result_of(folder, *, simulated=True, hold=7.2, samples=400, **how):
    """What three recordings of 60 s come to, whose reference errs and whose taxels are the true force."""
    t_ns = (np.arange(samples) * 60 / samples * 1e9).astype(np.int64)
    true = np.interp(t_ns * 1e-9, [0, hold, 60], [0, 0, 5])

    def make(place):
        noise = np.random.default_rng(place).standard_normal((samples, 4))
        return true[:, None] * [1.0, 2.0, -1.0] + 1e-3 * noise[:, :3], true + SIGMA * noise[:, 3]

    paths = roles(folder, make, t_ns=t_ns, scene=held("held", hold, samples=samples, **how), simulated=simulated)
    return evaluated(force_task(protocols=("deployable",), splits=("roles",)), paths, split="roles")


@pytest.mark.parametrize(
    ("how", "why"),
    [({"hold": 0.0}, "no unloaded"), ({"drive": ForceLoop()}, "force loop"), ({"hold": 2.0}, f"than {FEWEST}")],
)
def test_without_a_hold_that_tells_there_is_no_floor_and_the_row_says_why(tmp_path, how, why):
    result = result_of(tmp_path / "a", **how)
    assert result.score_beyond_floor is None
    assert any(why in remark for remark in result.remarks)
    assert "floor" not in result.replicates


@pytest.mark.parametrize("how", [{"simulated": False}, {"drive": ForceLoop()}])
def test_only_a_simulated_force_without_a_loop_is_known_truly(tmp_path, how):
    assert result_of(tmp_path / "a", **how).true_score is None
