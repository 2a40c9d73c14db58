"""The loop on a linear spring, where eigenvalues say what it must do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tactbench.plugin import ForceLoop, assumed
from tactbench.rigs.twin.effects.loop_dynamics import Dynamics

FREE = (-math.inf, math.inf)


def _q(value, unit):
    return assumed(value, unit, "test")


def _loop(step_s=0.012, cutoff_hz=1.0, limited=False, **more):
    changed = {} if limited else {"speed": _q(1e20, "mm/s"), "acceleration": _q(1e30, "mm/s/s")}
    stated = {
        "resolution": _q(0.0, "N"),
        "cutoff": None if cutoff_hz is None else _q(cutoff_hz, "Hz"),
        **changed,
        **more,
    }
    return Dynamics.of(ForceLoop(**stated), step_s)


def _kicked(loop, stiffness, steps=4000, kick_mm=1e-3):
    """The depths of a loop about a point of a spring that also pulls, begun beside that point."""
    noise = np.zeros(steps)
    noise[0] = stiffness * kick_mm
    return loop.carried(lambda x: stiffness * x, np.zeros(steps), noise, FREE)


LOOPS = [
    _loop(),
    _loop(cutoff_hz=None),
    _loop(cutoff_hz=4.0, delay=_q(40, "ms")),
    _loop(step_s=1e-3, cutoff_hz=None, delay=_q(5, "ms"), motor_lag=_q(8, "ms")),
    _loop(cutoff_hz=None, proportional=_q(0.0, "mm/N"), delay=_q(0, "ms")),
]


def _steps(loop, stiffness):
    """So many that a swing changes by a factor of 1e12."""
    return min(9000, int(np.log(1e12) / abs(np.log(loop.growth(stiffness)))))


@pytest.mark.parametrize("loop", LOOPS)
def test_the_loop_settles_below_its_limit_and_swings_up_above(loop):
    limit = loop.limit_n_per_mm()
    assert 0.1 < limit < 1e4
    for factor, settles in ((0.97, True), (1.03, False)):
        depths = np.abs(_kicked(loop, factor * limit, steps=_steps(loop, factor * limit)))
        third = depths.size // 3
        early, late = depths[:third].max(), depths[-third:].max()
        assert (late < 0.1 * early) if settles else (late > 10 * early)


@pytest.mark.parametrize("loop", LOOPS)
def test_a_swing_grows_as_the_largest_eigenvalue_says(loop):
    stiffness = 1.02 * loop.limit_n_per_mm()
    depths = np.abs(_kicked(loop, stiffness, steps=_steps(loop, stiffness)))
    third = depths.size // 3
    first, second = depths[third : 2 * third].max(), depths[2 * third : 3 * third].max()
    # Peaks of two windows; the crest of a swing may lie between two steps.
    assert np.log(second / first) / third == pytest.approx(np.log(loop.growth(stiffness)), rel=0.03)


@given(st.floats(0.01, 1), st.floats(0, 5), st.floats(0.1, 20), st.integers(0, 6), st.floats(0.1, 50))
@settings(max_examples=40)
def test_one_step_is_the_matrix_times_the_state(kp, ki, cutoff, delay, stiffness):
    loop = _loop(cutoff_hz=cutoff, proportional=_q(kp, "mm/N"), integral=_q(ki, "mm/N/s"), delay=_q(12.0 * delay, "ms"))
    assert loop.delay_steps == delay
    assume(loop.growth(stiffness) < 1.2)
    found = _kicked(loop, stiffness, steps=12, kick_mm=1.0)
    # A kick on the measured force enters like a depth of 1 mm at the first step, which is not there afterwards.
    matrix = loop.matrix(stiffness)
    first = np.zeros(3 + delay)
    first[0] = 1.0
    state = matrix @ first
    state[0] -= loop.left * 1.0
    for n in range(1, 12):
        assert found[n] == pytest.approx(state[0], abs=1e-9 * 1.2**12 * max(1.0, stiffness))
        state = matrix @ state


def test_the_limit_of_a_bare_integral_without_delay_is_two():
    # x' = x - ki T k x: settles for ki T k < 2.
    loop = _loop(
        cutoff_hz=None, proportional=_q(0, "mm/N"), integral=_q(0.5, "mm/N/s"), delay=_q(0, "s"), motor_lag=_q(0, "s")
    )
    assert loop.limit_n_per_mm() == pytest.approx(2 / (0.5 * 0.012), rel=1e-5)


def test_a_low_pass_raises_the_limit_of_a_proportional_loop():
    # By less than the slowing of the filter, 1/(1-a) = 13.8 steps: the delay eats some of it.
    gained = _loop().limit_n_per_mm() / _loop(cutoff_hz=None).limit_n_per_mm()
    assert 5 < gained < 13.8


def test_and_lowers_that_of_a_purely_integral_one():
    bare = {"proportional": _q(0.0, "mm/N")}
    assert _loop(**bare).limit_n_per_mm() < _loop(cutoff_hz=None, **bare).limit_n_per_mm()


@given(st.floats(0.1, 1e3), st.floats(1.0, 1e4), st.integers(0, 3))
@settings(max_examples=30)
def test_the_motor_keeps_its_limits_and_stops_where_it_should(speed, acceleration, seed):
    loop = _loop(cutoff_hz=None, limited=True, speed=_q(speed, "mm/s"), acceleration=_q(acceleration, "mm/s/s"))
    noise = np.random.default_rng(seed).standard_normal(600)
    depths = loop.carried(lambda x: 5.0 * max(x, 0.0), np.full(600, 3.0), noise, (-1.0, 1.5))
    velocity = np.diff(depths) / loop.step_s
    assert np.abs(velocity).max() <= speed * (1 + 1e-9)
    assert np.abs(np.diff(velocity, prepend=0.0)).max() <= acceleration * loop.step_s * (1 + 1e-9) + 1e-9


def test_a_move_by_a_limited_motor_does_not_overshoot():
    # No force, so that the command stays: wanted 1 N times 1 mm/N.
    loop = _loop(
        cutoff_hz=None, limited=True, proportional=_q(1.0, "mm/N"), integral=_q(0.0, "mm/N/s"),
        acceleration=_q(40.0, "mm/s/s"), motor_lag=_q(0, "s"),
    )  # fmt: skip
    depths = loop.carried(lambda x: 0.0, np.ones(400), np.zeros(400), FREE)
    # Whole steps of velocity end within an eighth of what one step of acceleration moves.
    assert depths.max() <= 1.0 + 40.0 * 0.012**2 / 8 + 1e-9
    assert depths[-1] == pytest.approx(1.0, abs=1e-6)
    assert np.diff(depths).min() > -40.0 * 0.012**2


def test_the_measured_force_is_rounded():
    coarse = _loop(cutoff_hz=None, resolution=_q(1.0, "N"), integral=_q(0.0, "mm/N/s"))
    # 0.4 N reads as none: the loop does not move against it.
    assert not coarse.carried(lambda x: 0.4, np.zeros(50), np.zeros(50), FREE).any()
    assert coarse.carried(lambda x: 0.6, np.zeros(50), np.zeros(50), FREE).any()
