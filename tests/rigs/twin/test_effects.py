"""Everything with memory is exact for any step; noises have the moments they state."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.rigs.twin.effects.creep import lag
from tactbench.rigs.twin.effects.wander import ornstein_uhlenbeck

times = st.lists(st.floats(0.0, 5.0), min_size=2, max_size=30).map(lambda steps: np.cumsum([0.0, *steps]))


def test_a_step_relaxes_as_the_standard_linear_solid_does():
    t = np.concatenate([[0.0, 0.0], np.linspace(0.01, 20.0, 50)])
    x = np.where(np.arange(len(t)) > 0, 1.0, 0.0)
    # Exact but for rounding: the recursion multiplies fifty exponentials.
    np.testing.assert_allclose(lag(x, t, 2.5)[1:], 1 - np.exp(-t[1:] / 2.5), atol=1e-14)


@given(times, st.floats(1e-3, 1e3))
def test_splitting_a_step_changes_nothing(t, tau):
    x = np.interp(t, [0.0, t[-1] + 1e-9], [0.0, 3.0])
    fine_t = np.sort(np.concatenate([t, (t[1:] + t[:-1]) / 2]))
    fine_x = np.interp(fine_t, [0.0, t[-1] + 1e-9], [0.0, 3.0])
    coarse, fine = lag(x, t, tau), lag(fine_x, fine_t, tau)
    # Rounding of e/2 - e²/6 + … against the closed form near e = 1e-4: 1e-16 / 1e-4.
    np.testing.assert_allclose(np.interp(t, fine_t, fine), coarse, atol=3e-11)


@given(times, st.floats(1e-3, 1e3))
def test_a_constant_stays_and_nothing_overshoots(t, tau):
    np.testing.assert_allclose(lag(np.full(len(t), 2.0), t, tau), 2.0, rtol=1e-12)
    assert lag(np.arange(len(t)) % 2.0, t, tau).max() <= 1 + 1e-12


def test_a_step_of_a_thousand_time_constants_is_equilibrium_and_time_going_back_changes_nothing():
    assert lag(np.array([0.0, 1.0, 1.0]), np.array([0.0, 1.0, 1e3]), 1.0)[-1] == pytest.approx(1.0, abs=1e-15)
    z = lag(np.array([0.0, 1.0, 5.0, 5.0]), np.array([0.0, 1.0, 0.5, 0.5]), 1.0)
    assert z[1] == z[2] == z[3]


def test_free_drift_has_the_moments_of_an_ornstein_uhlenbeck_process():
    t = np.arange(2000) * 0.5
    rng = np.random.default_rng(5)
    runs = np.array([ornstein_uhlenbeck(t, 3.0, 20.0, rng) for _ in range(400)])
    # 400 runs: the standard error of a variance is sqrt(2/400) = 7 %; four of them.
    for column in (0, 37, 1999):
        assert runs[:, column].var() == pytest.approx(9.0, rel=0.28)
    # Correlation exp(-lag/tau); over 400 runs x 2000/80 independent stretches its standard error is below 1 %.
    for steps in (10, 40, 80):
        found = (runs[:, steps:] * runs[:, :-steps]).mean() / 9.0
        assert found == pytest.approx(np.exp(-steps * 0.5 / 20.0), abs=0.04)
    horizon, tau = 1000.0, 20.0
    expected = 2 * 9.0 * (tau / horizon) * (1 - (tau / horizon) * (1 - np.exp(-horizon / tau)))
    assert runs.mean(axis=1).var() == pytest.approx(expected, rel=0.28)


def test_duplicate_times_do_not_kick_the_drift():
    drift = ornstein_uhlenbeck(np.array([0.0, 1.0, 1.0, 1.0, 2.0]), 1.0, 5.0, np.random.default_rng(0))
    assert drift[1] == drift[2] == drift[3] != drift[4]
