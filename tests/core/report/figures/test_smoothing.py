"""The smoothed force is a plain mean over half a second to either side, and nothing from elsewhere."""

import numpy as np

from tactbench.core.report.smoothing import smoothed_force
from tactbench.core.samples import Answers


def answers(time_s, force_n, recording=None):
    n = len(time_s)
    zeros = np.zeros(n, dtype=np.int64)
    where = zeros if recording is None else np.asarray(recording)
    return Answers(zeros, zeros, where, np.arange(n), zeros, np.asarray(time_s, float), np.asarray(force_n, float))


def test_it_is_the_mean_by_definition():
    rng = np.random.default_rng(3)
    time = np.sort(rng.uniform(0, 20, 400))
    force = 1e6 + rng.normal(0, 1, 400)
    force[rng.random(400) < 0.1] = np.nan
    recording = np.repeat([0, 1], 200)
    found = smoothed_force(answers(time, force, recording))
    for row in range(400):
        near = (recording == recording[row]) & (np.abs(time - time[row]) <= 0.5) & np.isfinite(force)
        # 1e-9 of an offset of 1e6: sums are centred first.
        assert np.isclose(found[row], force[near].mean(), rtol=1e-12, atol=0) if near.any() else np.isnan(found[row])


def test_a_ramp_stays_and_noise_goes():
    time = np.arange(6000) / 100
    ramp = 5 * time / 60
    noise = np.random.default_rng(1).normal(0, 0.7, 6000)
    inner = slice(50, -50)
    np.testing.assert_allclose(smoothed_force(answers(time, ramp))[inner], ramp[inner], atol=1e-12)
    # A mean of 101 readings: a tenth; neighbours share readings, so the estimate itself is loose by a fifth.
    left = np.std(smoothed_force(answers(time, noise))[inner])
    assert 0.8 * 0.7 / np.sqrt(101) < left < 1.2 * 0.7 / np.sqrt(101)


def test_rows_without_force_have_none():
    assert np.isnan(smoothed_force(answers([0.0, 0.1], [np.nan, np.nan]))).all()
