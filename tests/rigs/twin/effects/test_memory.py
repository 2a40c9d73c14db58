from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.rigs.twin.effects.memory import lag, recurrence, wandering


def _steps(t_s, load, tau):
    """The same lag, one sample after the other, from the solution of z' = (x - z) / tau for straight x."""
    z = [load[0]]
    for n in range(1, t_s.size):
        dt = t_s[n] - t_s[n - 1]
        if dt == 0:
            z.append(z[-1])
            continue
        slope = (load[n] - load[n - 1]) / dt
        z.append(load[n] - slope * tau + (z[-1] - load[n - 1] + slope * tau) * np.exp(-dt / tau))
    return np.array(z)


@given(
    st.lists(st.one_of(st.just(0.0), st.floats(1e-3, 50)), min_size=1, max_size=40),
    st.floats(0.1, 20),
    st.integers(0, 100),
)
def test_the_lag_is_exact_for_any_steps(steps, tau, seed):
    t_s = np.concatenate([[0.0], np.cumsum(steps)])
    load = np.random.default_rng(seed).uniform(0, 5, t_s.size)
    load[1:][np.asarray(steps) == 0] = load[:-1][np.asarray(steps) == 0]
    # Rounding; the textbook form loses digits at dt/tau = 1e-4, hence not tighter.
    np.testing.assert_allclose(lag(t_s, load, tau), _steps(t_s, load, tau), atol=1e-9)


@given(st.floats(0.01, 30), st.floats(0.05, 20))
def test_one_long_step_is_two_short_ones(dt, tau):
    long = lag(np.array([0.0, 2 * dt]), np.array([1.0, 3.0]), tau)
    short = lag(np.array([0.0, dt, 2 * dt]), np.array([1.0, 2.0, 3.0]), tau)
    assert short[-1] == pytest.approx(long[-1], rel=1e-12)


def test_a_repeated_time_stamp_changes_nothing():
    plain = lag(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0]), 3.0)
    doubled = lag(np.array([0.0, 1.0, 1.0, 1.0, 2.0]), np.array([0.0, 1.0, 1.0, 1.0, 2.0]), 3.0)
    np.testing.assert_array_equal(doubled[[0, 1, 4]], plain)
    np.testing.assert_array_equal(doubled[1:4], np.repeat(plain[1], 3))


def test_steps_far_beyond_the_time_constant_reach_equilibrium():
    found = lag(np.array([0.0, 1e6, 2e6]), np.array([0.0, 1.0, 1.0]), 1.0)
    assert found[-1] == 1.0


def test_a_held_load_is_its_own_lag():
    np.testing.assert_allclose(lag(np.arange(50.0), np.full(50, 2.5), 7.0), 2.5, rtol=1e-15)


@given(st.integers(1, 70), st.integers(0, 50))
def test_doubling_is_the_plain_recurrence(n, seed):
    rng = np.random.default_rng(seed)
    decay, drive = rng.uniform(0, 1, n), rng.standard_normal((n, 3))
    expected = drive.copy()
    for i in range(1, n):
        expected[i] += decay[i] * expected[i - 1]
    np.testing.assert_allclose(recurrence(decay, drive), expected, atol=1e-12)


def test_wandering_has_the_moments_of_ornstein_and_uhlenbeck():
    t_s = np.cumsum(np.tile([0.5, 1.5], 150))
    paths = wandering(t_s, 2.0, 10.0, 4000, np.random.default_rng(5))
    # 4000 independent paths: a mean has sd 2/63 = 0.032, a variance 4 sqrt(2/4000) = 0.09; four of them.
    assert np.abs(paths[[0, 7, -1]].mean(axis=1)).max() < 0.13
    assert np.abs(paths[[0, 7, -1]].var(axis=1) - 4.0).max() < 0.36
    lagged = (paths[20] * paths[30]).mean() / 4.0
    # 1/sqrt(4000) = 0.016; four of them.
    assert lagged == pytest.approx(np.exp(-(t_s[30] - t_s[20]) / 10.0), abs=0.064)
    span = t_s[-1] - t_s[0]
    times = 10.0 / span
    expected = 2 * 4.0 * times * (1 - times * (1 - np.exp(-1 / times)))
    # Trapezoid over unequal steps; 2.2 % sampling error of a variance of 4000, four of them.
    means = np.trapezoid(paths, t_s, axis=0) / span
    assert means.var() == pytest.approx(expected, rel=0.09)


def test_wandering_stays_put_at_a_repeated_time_stamp():
    paths = wandering(np.array([0.0, 1.0, 1.0, 2.0]), 1.0, 5.0, 3, np.random.default_rng(0))
    np.testing.assert_array_equal(paths[1], paths[2])


@pytest.mark.parametrize("t_s", [[0.0, 1.0, 0.5], [0.0, np.nan, 1.0], [0.0, np.inf, np.inf]])
def test_a_clock_that_runs_backwards_is_refused(t_s):
    for use in (lambda t: lag(t, np.ones(3), 1.0), lambda t: wandering(t, 1.0, 1.0, 2, np.random.default_rng(0))):
        with pytest.raises(RigError, match="time stamps") as refused:
            use(np.array(t_s))
        assert "ascending" in refused.value.hint


@pytest.mark.parametrize("tau", [0.0, -1.0, np.nan, np.inf])
def test_a_time_constant_that_is_none_is_refused(tau):
    with pytest.raises(RigError, match="time constant"):
        lag(np.arange(3.0), np.ones(3), tau)


def test_no_samples_are_no_samples():
    assert lag(np.zeros(0), np.zeros(0), 1.0).shape == (0,)
    assert wandering(np.zeros(0), 1.0, 1.0, 3, np.random.default_rng(0)).shape == (0, 3)


def test_a_step_of_any_length_warns_of_nothing():
    # 1e200 time constants in one step: its cube would overflow.
    assert lag(np.array([0.0, 1e150]), np.array([0.0, 1.0]), 1e-50)[-1] == pytest.approx(1.0)
