"""The force loop: its step, its limits, its stability, and the largest forces."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from tactbench.plugin import ForceLoop, RigError, UsageError, assumed
from tactbench.rigs.parallel_manipulator.force_law import ForceController, ForceLaw
from tactbench.rigs.parallel_manipulator.loop_stability import (
    LinearLoop,
    advised_integral_m_n_s,
    check_gains,
    largest_gain_factor,
    pressed_spring,
    ramp_error_n,
)
from tactbench.rigs.parallel_manipulator.worst_case import (
    Reaction,
    approach_speed_m_s,
    check_largest_force,
    first_touch_n,
    largest_force_n,
)
from tactbench.rigs.twin.effects.loop_dynamics import Dynamics

RATE_HZ, T = 100.0, 0.01


def _q(value, unit):
    return assumed(value, unit, "test")


def _loop(kp=0.0, ki=0.5, cutoff=5.0, rate=RATE_HZ, **more):
    return ForceLoop(
        proportional=_q(kp, "mm/N"),
        integral=_q(ki, "mm/N/s"),
        cutoff=None if cutoff is None else _q(cutoff, "Hz"),
        rate=_q(rate, "Hz"),
        **{"resolution": _q(0.0, "N"), **more},
    )


def _law(loop=None, speed=1.0, travel=(-10.0, 10.0), **more):
    return ForceLaw(
        loop=loop or _loop(), speed=_q(speed, "mm/s"), travel=(_q(travel[0], "mm"), _q(travel[1], "mm")), **more
    )


FREE = {"speed": 1e9, "travel": (-1e12, 1e12)}


@given(
    st.floats(0, 0.05), st.floats(0.01, 2), st.one_of(st.none(), st.floats(0.5, 40)), st.integers(0, 4),
    st.floats(0.1, 80),
)  # fmt: skip
@settings(max_examples=60)
def test_one_step_is_the_matrix_times_the_state(kp, ki, cutoff, delay, stiffness):
    loop = _loop(kp, ki, cutoff, delay=_q(10.0 * delay, "ms"))
    at = LinearLoop.of(loop)
    assert at.delay_periods == delay
    matrix = at.matrix(np.array(1e3 * stiffness))
    assume(np.abs(np.linalg.eigvals(matrix)).max() < 1.2)
    kick = np.zeros(12)
    kick[0] = 1e3 * stiffness * 1e-3
    depth = pressed_spring(_law(loop, **FREE), 1e3 * stiffness, np.zeros(12), kick)
    # A kick on the measured force enters like a depth of 1 mm at the first step, which is not there afterwards.
    first = np.zeros(3 + delay)
    first[0] = 1e-3
    state = matrix @ first
    state[0] -= at.lag_kept * 1e-3
    for n in range(1, 12):
        assert depth[n] == pytest.approx(state[0], abs=1e-12 * 1.2**12 * max(1.0, stiffness))
        state = matrix @ state


@given(
    st.floats(0, 0.5), st.floats(0.01, 20), st.one_of(st.none(), st.floats(0.5, 40)), st.floats(0, 60),
    st.floats(0, 30), st.sampled_from([10.0, 50.0, 100.0, 1000.0]),
)  # fmt: skip
@settings(max_examples=25)
def test_the_twins_loop_has_the_same_limit(kp, ki, cutoff, delay, lag, rate):
    loop = _loop(kp, ki, cutoff, rate, delay=_q(delay, "ms"), motor_lag=_q(lag, "ms"))
    twin = Dynamics.of(loop, 1 / rate).limit_n_per_mm()
    assume(math.isfinite(twin) and twin > 1e-2)
    # Both scan in steps of 2 %, from different starts.
    found = 1e-3 * LinearLoop.of(loop).largest_stiffness_n_m()
    assert found == pytest.approx(twin, rel=1e-5)


def test_entering_does_not_move_the_motor():
    law = _law(_loop(kp=0.02, ki=0.5))
    controller = ForceController(law, 0.7, 2e-3, 5.0)
    assert (controller.filtered_n, controller.target_m) == (0.7, 2e-3)
    assert controller.step(0.7, 2e-3, 5.01, 0.7) == pytest.approx(0, abs=1e-15)


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-20e-3, 20e-3), st.floats(0, 6)), min_size=1, max_size=40))
@settings(max_examples=60)
def test_every_target_keeps_the_limits(samples):
    law = _law(_loop(kp=0.05, ki=5.0), speed=2.0, travel=(-3.0, 4.0))
    controller, target = ForceController(law, 0.0, 0.0, 0.0), 0.0
    for n, (force, position, wanted) in enumerate(samples):
        increment = controller.step(force, position, (n + 1) * T, wanted)
        target += increment
        assert target == pytest.approx(controller.target_m, abs=1e-15)
        assert -3e-3 - 1e-15 <= target <= 4e-3 + 1e-15
        # The speed's limit gives way to a motor that is elsewhere, and to the travel.
        near = np.clip(position, -3e-3, 4e-3)
        assert abs(increment) <= 2e-3 * T * 1.000001 or abs(target - near) <= 2e-3 * 0.1 * 1.000001


@pytest.mark.parametrize("kp", [0.0, 0.02])
def test_a_stalled_motor_does_not_wind_the_loop_up(kp):
    controller = ForceController(_law(_loop(kp=kp)), 0.0, 0.0, 0.0)
    for n in range(1000):  # ten seconds at 5 N missing, and the motor stands
        controller.step(0.0, 0.0, (n + 1) * T, 5.0)
    assert controller.limited
    # The wind-up time at the loop's speed: 0.1 mm.
    assert controller.target_m == pytest.approx(0.1e-3)
    # It goes back at once, and not only after as long a time, when there is too much force.
    for n in range(1000, 1030):
        controller.step(5.5, 0.0, (n + 1) * T, 5.0)
    assert controller.target_m < 0.1e-3
    assert not controller.limited


def test_a_late_sample_moves_and_integrates_nothing():
    controller = ForceController(_law(), 0.0, 0.0, 0.0)
    first = controller.step(0.0, 0.0, T, 1.0)
    assert first > 0
    assert controller.step(0.0, 0.0, 3 * T, 1.0) == 0
    assert controller.late
    assert controller.step(0.0, 0.0, 4 * T, 1.0) == pytest.approx(first)
    assert not controller.late


def test_the_filter_takes_the_time_that_has_passed():
    one, two = (ForceController(_law(_loop(ki=0.0, kp=1e-6)), 0.0, 0.0, 0.0) for _ in range(2))
    one.step(1.0, 0.0, 2 * T, 0.0)
    two.step(1.0, 0.0, T, 0.0)
    two.step(1.0, 0.0, 2 * T, 0.0)
    assert one.filtered_n == pytest.approx(two.filtered_n) == 1 - math.exp(-2 * math.pi * 5 * 2 * T)


@pytest.mark.parametrize("k", [1.0, 20.0])
def test_feed_forward_takes_the_lag_of_a_ramp_away(k):
    slope = 5 / 60
    loop = _loop(ki=10 / k)
    wanted = slope * T * np.arange(1, 2001)
    plain = pressed_spring(_law(loop), 1e3 * k, wanted, np.zeros(2000))
    fed = pressed_spring(_law(loop, feed_forward=_q(k, "N/mm")), 1e3 * k, wanted, np.zeros(2000), slope_n_s=slope)
    lag = slope / (10 / k * k)
    assert 1e3 * k * plain[-1] - wanted[-1] == pytest.approx(ramp_error_n(loop, slope, 1e3 * k), abs=1e-6)
    assert 1e3 * k * fed[-1] - wanted[-1] == pytest.approx(ramp_error_n(loop, slope, 1e3 * k) + lag, abs=1e-6)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_an_unknown_force_is_refused(bad):
    controller = ForceController(_law(), 0.0, 0.0, 0.0)
    for numbers in ((bad, 0.0, T, 1.0), (0.0, bad, T, 1.0), (0.0, 0.0, bad, 1.0), (0.0, 0.0, T, bad)):
        with pytest.raises(RigError, match="unknown force"):
            controller.step(*numbers)
    assert controller.target_m == 0
    with pytest.raises(RigError):
        ForceController(_law(), bad, 0.0, 0.0)


def test_time_goes_forwards():
    controller = ForceController(_law(), 0.0, 0.0, 1.0)
    with pytest.raises(UsageError, match=r"stepped at 1\.0 s"):
        controller.step(0.0, 0.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"loop": ForceLoop()}, "rate is not stated"),
        ({"loop": _loop(ki=0.0)}, "gains"),
        ({"loop": _loop(ki=-1.0)}, "gains"),
        ({"speed": 0.0}, "speed"),
        ({"travel": (1.0, 1.0)}, "travel"),
        ({"feed_forward": _q(0.0, "N/mm")}, "feed_forward"),
    ],
)
def test_a_law_that_cannot_be_is_refused(changed, said):
    with pytest.raises(ValidationError, match=said):
        _law(**changed)


def test_gains_above_half_of_the_limit_are_refused():
    # With a delay of one period and no lag the limit is k ki T = 1, whatever the filter.
    loop = _loop(ki=1.0, motor_lag=_q(0.0, "s"))
    assert largest_gain_factor(loop, 20e3) == pytest.approx(5.0, rel=1e-6)
    assert check_gains(loop, 20e3) == pytest.approx(0.2, rel=1e-6)
    check_gains(loop, 49e3)
    with pytest.raises(UsageError, match=r"0\.80 of those .* at 80 N/mm.* Divide both gains by 1\.60"):
        check_gains(loop, 80e3)


@pytest.mark.parametrize("cutoff", [0.5, 5.0, 50.0])
def test_with_one_period_of_delay_the_filter_does_not_matter(cutoff):
    loop = _loop(ki=1.0, cutoff=cutoff, motor_lag=_q(0.0, "s"))
    assert LinearLoop.of(loop).largest_stiffness_n_m() == pytest.approx(100e3, rel=1e-4)


# The gain of increments at 1 N/mm with at most 5 % overshoot of a step, in mm/(N s).
USABLE = {
    (None, 10.0): 3.43, (None, 50.0): 15.6, (None, 100.0): 24.8, (None, 1000.0): 47.5,
    (5.0, 10.0): 3.34, (5.0, 50.0): 8.84, (5.0, 100.0): 10.2, (5.0, 1000.0): 11.3,
    (1.0, 10.0): 1.87, (1.0, 50.0): 2.59, (1.0, 100.0): 2.68, (1.0, 1000.0): 2.75,
}  # fmt: skip


@pytest.mark.parametrize(("cutoff", "rate"), USABLE)
def test_the_advised_gain_is_near_the_usable_one(cutoff, rate):
    loop = _loop(cutoff=cutoff, rate=rate, delay=_q(1.0 if rate == 1000 else 10.0, "ms"))
    assert 0.78 <= 1e3 * advised_integral_m_n_s(loop, 1e3) / USABLE[cutoff, rate] <= 1.07


def _overshoot(loop):
    depth = pressed_spring(_law(loop, **FREE), 1e3, np.ones(2000), np.zeros(2000))
    return (1e3 * depth).max() - 1


@pytest.mark.parametrize(("cutoff", "rate"), USABLE)
def test_a_usable_gain_overshoots_by_a_twentieth(cutoff, rate):
    delay = _q(1.0 if rate == 1000 else 10.0, "ms")
    usable = USABLE[cutoff, rate]
    # Stated with three digits.
    assert _overshoot(_loop(ki=0.99 * usable, cutoff=cutoff, rate=rate, delay=delay)) < 0.05
    assert _overshoot(_loop(ki=1.01 * usable, cutoff=cutoff, rate=rate, delay=delay)) > 0.05


@pytest.mark.parametrize(
    ("k", "v", "raw", "three", "quick"),
    [
        (5, 0.5, 0.15, 0.20, 0.11), (20, 0.5, 0.30, 0.50, 0.12), (20, 2, 0.93, 1.73, 0.22), (80, 0.5, 0.90, 1.70, 0.19),
        (80, 5, 9.0, 17.0, 1.89),
    ],
)  # fmt: skip
def test_the_largest_force_of_a_touch(k, v, raw, three, quick):
    given_ = (0.1, 1e3 * k, 1e-3 * v, 1.0)
    found = [first_touch_n(*given_, T, T), first_touch_n(*given_, T, T, 3), first_touch_n(*given_, 1e-3, 1e-3)]
    # Two digits, and a simulation's phases.
    assert found == pytest.approx([raw, three, quick], rel=0.02, abs=0.006)
    assert approach_speed_m_s(found[1], 0.1, 1e3 * k, 1.0, T, T, 3) == pytest.approx(1e-3 * v, rel=1e-12)


@pytest.mark.parametrize(
    ("k", "v", "slow", "fast"),
    [(20, 0.5, 0.37, 0.19), (80, 0.5, 1.48, 0.76), (80, 0.1, 0.29, 0.15), (80, 5, 15.7, 8.5)],
)
def test_the_largest_force_above_the_ceiling(k, v, slow, fast):
    found = [largest_force_n(6.0, 1e3 * k, 1e-3 * v, 1.0, Reaction(baud)) - 6 for baud in (9600, 115200)]
    # Two digits.
    assert found == pytest.approx([slow, fast], rel=0.006, abs=0.006)
    assert [1e3 * Reaction(baud).time_s for baud in (9600, 115200)] == pytest.approx([36.8, 18.6], abs=0.06)


def test_more_than_something_is_rated_for_is_refused():
    check_largest_force(8.0, 8.0, "the skin")
    for force in (8.1, math.nan):
        with pytest.raises(UsageError, match="the skin is rated for"):
            check_largest_force(force, 8.0, "the skin")
    with pytest.raises(UsageError, match="Lower the threshold"):
        approach_speed_m_s(0.1, 0.1, 1e3, 1.0, T, T)
