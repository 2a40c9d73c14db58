"""The force loop: its step and limits, and the eigenvalues that say on a linear spring what it must do."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tactbench.core.spec.scene import ForceLoop
from tactbench.devices.force_loop import ForceController
from tactbench.plugin import RigError, UsageError, assumed
from tactbench.plugin.devices import ForceLaw, LoopModel

T = 0.01


def _q(value, unit):
    return assumed(value, unit, "test")


def _loop(kp=0.0, ki=0.5, cutoff=5.0, limited=False, **more):
    free = {"speed": _q(1e20, "mm/s"), "acceleration": _q(1e30, "mm/s/s")}
    return ForceLoop(
        proportional=_q(kp, "mm/N"),
        integral=_q(ki, "mm/N/s"),
        cutoff=None if cutoff is None else _q(cutoff, "Hz"),
        **{"resolution": _q(0.0, "N"), **({} if limited else free), **more},
    )


def _model(*args, **more):
    """Return a loop in mm."""
    return LoopModel.of(_loop(*args, **more), T)


def _kicked(model, stiffness, steps=4000, kick=1.0):
    """The depths of a loop about a point of a spring that also pulls, begun beside that point."""
    noise = np.zeros(steps)
    noise[0] = stiffness * kick
    return model.simulate(lambda x: stiffness * x, np.zeros(steps), noise)


# Stability ------------------------------------------------------------------------------------------------------------


@given(
    st.floats(0, 1), st.floats(0.01, 5), st.one_of(st.none(), st.floats(0.1, 40)), st.integers(0, 6), st.floats(0.1, 50)
)
@settings(max_examples=60)
def test_one_step_is_the_matrix_times_the_state(kp, ki, cutoff, delay, stiffness):
    model = _model(kp, ki, cutoff, delay=_q(10.0 * delay, "ms"))
    assert model.delay_steps == delay
    assume(model.growth(stiffness) < 1.2)
    found = _kicked(model, stiffness, steps=12)
    # A kick on the measured force enters like a depth of 1 at the first step, which is not there afterwards.
    matrix = model.matrix(stiffness)
    first = np.zeros(3 + delay)
    first[0] = 1.0
    state = matrix @ first
    state[0] -= model.lag_kept
    for n in range(1, 12):
        assert found[n] == pytest.approx(state[0], abs=1e-9 * 1.2**12 * max(1.0, stiffness))
        state = matrix @ state


@pytest.mark.parametrize("d", [0, 1, 5])
def test_the_limit_of_increments_without_filter_and_lag_is_the_closed_one(d):
    model = _model(0.0, 1.0, None, delay=_q(10.0 * d, "ms"), motor_lag=_q(0.0, "s"))
    assert model.largest_stiffness() * T == pytest.approx(2 * math.sin(math.pi / (2 * (2 * d + 1))), rel=1e-5)


# The motor ------------------------------------------------------------------------------------------------------------


@given(st.floats(0.1, 1e3), st.floats(1.0, 1e4), st.integers(0, 3))
@settings(max_examples=30)
def test_the_motor_keeps_its_limits(speed, acceleration, seed):
    limits = {"speed": _q(speed, "mm/s"), "acceleration": _q(acceleration, "mm/s/s")}
    model = LoopModel.of(_loop(0.15, 1.0, None, **limits), T, travel=(-1.0, 1.5))
    noise = np.random.default_rng(seed).standard_normal(600)
    depths = model.simulate(lambda x: 5.0 * max(x, 0.0), np.full(600, 3.0), noise)
    velocity = np.diff(depths) / T
    assert np.abs(velocity).max() <= speed * (1 + 1e-9)
    assert np.abs(np.diff(velocity, prepend=0.0)).max() <= acceleration * T * (1 + 1e-9) + 1e-9


def test_a_move_by_a_limited_motor_does_not_overshoot():
    # No force, so that the command stays: wanted 1 N times 1 mm/N.
    model = _model(1.0, 0.0, None, acceleration=_q(40.0, "mm/s/s"), motor_lag=_q(0, "s"))
    depths = model.simulate(lambda x: 0.0, np.ones(400), np.zeros(400))
    # Whole steps of velocity end within an eighth of what one step of acceleration moves.
    assert depths.max() <= 1.0 + 40.0 * T**2 / 8 + 1e-9
    assert depths[-1] == pytest.approx(1.0, abs=1e-6)


# The controller -------------------------------------------------------------------------------------------------------


def _law(kp=0.0, ki=0.5e-3, **more):
    return ForceLaw(T, kp, ki, 5.0, **{"speed": 1e-3, "windup_s": 0.1, "travel": (-10e-3, 10e-3), **more})


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-20e-3, 20e-3), st.floats(0, 6)), min_size=1, max_size=40))
@settings(max_examples=60)
def test_every_target_keeps_the_limits(samples):
    controller, before = ForceController(_law(0.05e-3, 5e-3, speed=2e-3, travel=(-3e-3, 4e-3)), 0.0, 0.0), 0.0
    for force, position, wanted in samples:
        target = controller.step(force, position, T, wanted)
        assert -3e-3 <= target <= 4e-3
        # The speed's limit gives way to a motor that is elsewhere, and to the travel.
        near = np.clip(position, -3e-3, 4e-3)
        assert abs(target - before) <= 2e-3 * T * 1.000001 or abs(target - near) <= 2e-3 * 0.1 * 1.000001
        before = target


@pytest.mark.parametrize("kp", [0.0, 0.02e-3])
def test_a_stalled_motor_does_not_wind_the_loop_up(kp):
    controller = ForceController(_law(kp), 0.0, 0.0)
    for _ in range(1000):  # ten seconds at 5 N missing, and the motor stands
        controller.step(0.0, 0.0, T, 5.0)
    # The wind-up time at the loop's speed: 0.1 mm.
    assert controller.target == pytest.approx(0.1e-3)
    # It goes back at once, and not only after as long a time, when there is too much force.
    for _ in range(30):
        controller.step(5.5, 0.0, T, 5.0)
    assert controller.target < 0.1e-3


def test_a_late_sample_moves_and_integrates_nothing():
    controller = ForceController(_law(), 0.0, 0.0)
    first = controller.step(0.0, 0.0, T, 1.0)
    assert first > 0
    assert controller.step(0.0, 0.0, 2 * T, 1.0) == first
    assert controller.step(0.0, 0.0, T, 1.0) == pytest.approx(2 * first)


def test_feed_forward_takes_the_lag_of_a_ramp_away():
    slope, k, n = 5 / 60, 20e3, 2000
    wanted = slope * T * np.arange(1, n + 1)
    errors = []
    for feed_forward in (math.inf, k):
        controller, x = ForceController(_law(ki=10 / k, feed_forward=feed_forward), 0.0, 0.0), 0.0
        for setpoint in wanted:
            force = k * x
            x = controller.step(force, x, T, setpoint, slope)
        errors.append(force - wanted[-1])
    # r/(k ki) of the integral (derived): 8.3 mN.
    assert errors[1] - errors[0] == pytest.approx(slope / 10, rel=1e-6)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_an_unknown_force_is_refused(bad):
    controller = ForceController(_law(), 0.0, 0.0)
    for numbers in ((bad, 0.0, T, 1.0), (0.0, bad, T, 1.0), (0.0, 0.0, T, bad)):
        with pytest.raises(RigError, match="unknown force"):
            controller.step(*numbers)
    assert controller.target == 0
    with pytest.raises(RigError):
        ForceController(_law(), bad, 0.0)
    with pytest.raises(UsageError, match=r"0\.0 s"):
        controller.step(0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    "changed",
    [
        {"period_s": 0.0}, {"integral": 0.0}, {"proportional": math.nan}, {"travel": (1.0, 1.0)},
    ],
)  # fmt: skip
def test_a_law_that_cannot_be_is_refused(changed):
    with pytest.raises(UsageError):
        ForceLaw(**{"period_s": T, "proportional": 0.0, "integral": 1.0, **changed})
