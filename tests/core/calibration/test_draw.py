"""Draws follow their priors, and are the same alone and among others."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tactbench.core.calibration.draw import parameters_of, sample
from tactbench.core.spec.calibration import Fixed, LogUniform, Uniform
from tests.core.calibration.toy import procedure


@pytest.mark.parametrize(
    ("prior", "law"),
    [
        (Uniform(kind="uniform", low=-2, high=5), stats.uniform(-2, 7)),
        (LogUniform(kind="log-uniform", low=0.05, high=20), stats.loguniform(0.05, 20)),
    ],
)
def test_draws_follow_their_prior(prior, law):
    values = [sample(prior, np.random.default_rng([3, number])) for number in range(2000)]
    assert min(values) >= prior.low
    assert max(values) <= prior.high
    # Kolmogorov and Smirnov: of right draws one seed in a thousand is refused, and this one is not.
    assert stats.kstest(values, law.cdf).pvalue > 1e-3


@given(st.floats(1e-300, 1e300), st.floats(1e-300, 1e300), st.integers(0, 2**32))
def test_a_log_uniform_draw_never_leaves_its_bounds(a, b, seed):
    low, high = min(a, b), max(a, b)
    if low < high:
        assert low <= sample(LogUniform(kind="log-uniform", low=low, high=high), np.random.default_rng(seed)) <= high


def test_a_fixed_prior_gives_its_value():
    assert sample(Fixed(kind="fixed", value=0.25), np.random.default_rng(0)) == 0.25


def test_a_draw_is_the_same_alone_and_among_others():
    spec = procedure()
    forwards = [parameters_of(spec, 5, number) for number in range(20)]
    backwards = [parameters_of(spec, 5, number) for number in reversed(range(20))][::-1]
    assert forwards == backwards
    assert parameters_of(spec, 5, 13) == forwards[13]
    assert len({seed for seed, _ in forwards}) == 20
    assert parameters_of(spec, 6, 13) != forwards[13]


def test_one_nuisance_more_leaves_the_others_as_they_are():
    whole = procedure()
    fewer = procedure(nuisances=[whole.nuisances[1].model_dump()])
    (seed, values), (same, alone) = parameters_of(whole, 5, 3), parameters_of(fewer, 5, 3)
    assert (same, alone["height"]) == (seed, values["height"])


def test_nuisances_of_one_draw_are_independent():
    values = [parameters_of(procedure(), 5, number)[1] for number in range(1000)]
    pairs = np.array([(one["width"], math.log(one["height"])) for one in values])
    # 1000 independent pairs: the standard error of a correlation is .032; four of them.
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 0.13
