"""The smoothed force is a plain mean over half a second to either side, and nothing from elsewhere."""

import numpy as np

from tactbench.core.report.smoothing import smoothed_force
from tactbench.core.samples import Answers


def test_it_is_the_mean_by_definition():
    rng = np.random.default_rng(3)
    time = np.sort(rng.uniform(0, 20, 400))
    force = 1e6 + rng.normal(0, 1, 400)
    force[rng.random(400) < 0.1] = np.nan
    recording = np.repeat([0, 1, 2], (200, 190, 10))
    force[recording == 2] = np.nan
    zeros = np.zeros(400, dtype=np.int64)
    found = smoothed_force(Answers(zeros, zeros, recording, np.arange(400), zeros, time, force))
    for row in range(400):
        near = (recording == recording[row]) & (np.abs(time - time[row]) <= 0.5) & np.isfinite(force)
        # 1e-9 of an offset of 1e6: sums are centred first.
        assert np.isclose(found[row], force[near].mean(), rtol=1e-12, atol=0) if near.any() else np.isnan(found[row])
