"""Partial rank correlations: what depends is found, what does not is about zero."""

import numpy as np
import pytest

from tactbench.core.calibration.sensitivity import partial_rank_correlations, sensitivities
from tests.core.calibration.toy import draws, procedure

RNG = np.random.default_rng(4)
X = RNG.uniform(size=(2000, 3))


def test_a_monotone_dependence_is_found_however_bent_and_an_unrelated_one_is_not():
    noisy = X[:, 0] + 0.2 * RNG.standard_normal(2000)
    plain, bent = partial_rank_correlations(X, np.column_stack([noisy, np.exp(9 * noisy)]))
    np.testing.assert_allclose(plain, bent, atol=1e-12)
    assert plain[0] > 0.75
    # 2000 independent pairs: the standard error of a correlation is .022; four of them.
    assert np.all(np.abs(plain[1:]) < 0.09)
    falling = partial_rank_correlations(X, -noisy[:, None])[0]
    np.testing.assert_allclose(falling, -plain, atol=1e-9)


def test_what_another_parameter_explains_is_taken_out():
    small = 0.05 * X[:, 1] + X[:, 0]
    together = partial_rank_correlations(X, small[:, None])[0]
    plain = np.corrcoef(X[:, 1], small)[0, 1]
    # The first parameter hides the second from a plain correlation and not from a partial one.
    assert abs(plain) < 0.2
    assert together[1] > 0.7


def test_it_is_the_correlation_of_the_residuals_of_ranks():
    y = X[:, 0] * X[:, 1] + 0.1 * RNG.standard_normal(2000)
    ranks = np.argsort(np.argsort(np.column_stack([X, y]), axis=0), axis=0).astype(float)
    others = np.column_stack([np.ones(2000), ranks[:, 1:3]])
    left = [column - others @ np.linalg.lstsq(others, column, rcond=None)[0] for column in (ranks[:, 0], ranks[:, 3])]
    assert partial_rank_correlations(X, y[:, None])[0, 0] == pytest.approx(np.corrcoef(left)[0, 1], abs=1e-6)


def test_intervals_are_seeded_and_hold_what_is_known():
    spec, some = procedure(), draws(200)
    first, again = (sensitivities(spec, some, np.random.default_rng(1)) for _ in range(2))
    assert first == again
    found = {(one.output, one.parameter): one for one in first}
    assert found["narrow", "width"].high < -0.9
    tall = found["narrow", "height"]
    assert tall.low <= tall.correlation <= tall.high
    assert tall.low < 0.2
    assert tall.high > -0.2
    assert sensitivities(spec, some[:5], np.random.default_rng(1)) == []
