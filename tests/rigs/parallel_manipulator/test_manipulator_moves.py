"""Profiles, straight moves and the moves of a press."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from tactbench.plugin import UsageError, assumed
from tactbench.rigs.parallel_manipulator.geometry import example_linear, example_rotary
from tactbench.rigs.parallel_manipulator.kinematics import forward
from tactbench.rigs.parallel_manipulator.motion_profile import MotionLimits, MotionProfile
from tactbench.rigs.parallel_manipulator.press_moves import (
    ManipulatorMoves,
    MotorRetracts,
    MoveOrderError,
    PressHeights,
    check_moves,
    moves_to,
    plan_presses,
)
from tactbench.rigs.parallel_manipulator.trajectory import line_motion, straight_move
from tactbench.rigs.parallel_manipulator.workspace import PlaceRefusedError, Workspace

RAILS, ARMS = Workspace(example_linear()), Workspace(example_rotary())
some_rate = st.floats(1e-3, 10)


@given(st.floats(1e-6, 1), some_rate, some_rate, some_rate, st.floats(1, 10))
@settings(max_examples=100)
def test_a_profile_keeps_its_limits_and_ends_at_rest_on_its_place(distance, v, a, j, stretch):
    move = MotionProfile(distance, v, a, j, stretch)
    times = np.linspace(0, move.duration_s, 5001)
    way, speed, acceleration = move.at(times)
    assert (way[0], way[-1], speed[0], speed[-1]) == (0, distance, 0, 0)
    assert (np.diff(way) >= -1e-12 * distance).all()
    assert speed.max() <= v / stretch * (1 + 1e-9)
    assert np.abs(acceleration).max() <= a / stretch**2 * (1 + 1e-9)
    dt = times[1]
    assert np.abs(np.diff(acceleration)[:-1]).max() <= j / stretch**3 * dt * (1 + 1e-6)
    # Ways are sums of speeds: the trapezoidal rule is off by dt^2/8 of all changes of the acceleration, 4 a, at most.
    rule = np.cumsum(0.5 * (speed[1:] + speed[:-1]) * dt)
    assert np.abs(rule - way[1:]).max() <= 0.5 * dt**2 * a / stretch**2 + 1e-12 * distance
    # As much way before the middle as after it.
    assert way[2500] == pytest.approx(0.5 * distance, rel=1e-9)


@pytest.mark.parametrize(("distance", "duration"), [(0.1, 2.1), (0.001, 2 * math.sqrt(0.001 / 0.5))])
def test_without_a_limit_of_jerk_it_is_the_trapezoid(distance, duration):
    move = MotionProfile(distance, 0.05, 0.5, math.inf)
    assert move.duration_s == pytest.approx(duration, rel=1e-12)
    assert move.at(np.array([duration, 9.0]))[0] == pytest.approx([distance, distance])


def test_no_way_takes_no_time():
    move = MotionProfile(0.0, 1.0, 1.0, 1.0)
    assert move.duration_s == 0
    assert [float(x[0]) for x in move.at(np.zeros(1))] == [0, 0, 0]


@pytest.mark.parametrize(
    "numbers", [(-1, 1, 1, 1), (1, 0, 1, 1), (1, 1, math.nan, 1), (1, 1, math.inf, 1), (1, 1, 1, 1, 0.5)]
)
def test_a_move_that_cannot_be_is_refused(numbers):
    with pytest.raises(UsageError):
        MotionProfile(*numbers)
    with pytest.raises(ValidationError):
        MotionLimits(speed=assumed(math.nan, "mm/s", "test"))


@pytest.mark.parametrize("work", [RAILS, ARMS])
def test_targets_follow_the_straight_line(work):
    start, end = np.array([-0.05, 0.02, -0.2]), np.array([0.06, -0.03, -0.17])
    found = straight_move(work, start, end, MotionLimits(), 100.0)
    assert found.time_s[1] == pytest.approx(0.01)
    assert 0 <= found.time_s[-1] - found.duration_s < 0.01
    assert (found.p_m[0] == start).all()
    assert (found.p_m[-1] == end).all()
    reached = forward(work.delta, found.q)
    along = (end - start) / np.linalg.norm(end - start)
    beside = (reached - start) - ((reached - start) @ along)[:, None] * along
    # 1e-12 of a link.
    assert np.linalg.norm(beside, axis=1).max() <= 0.25e-12
    # Joints in proportion would leave the line by so much that samples between are needed.
    joints = found.q[0] + np.linspace(0, 1, 99)[:, None] * (found.q[-1] - found.q[0])
    bent = forward(work.delta, joints)
    assert np.linalg.norm((bent - start) - ((bent - start) @ along)[:, None] * along, axis=1).max() > 1e-3


def test_a_move_is_slowed_by_its_joints_and_keeps_its_line():
    slow = example_linear().model_copy(update={"joint_speed_mm_s": 10.0, "joint_acceleration_mm_s2": 1000.0})
    start, end = np.array([-0.05, 0.02, -0.2]), np.array([0.06, -0.03, -0.17])
    plain = straight_move(RAILS, start, end, MotionLimits(), 100.0)
    found = straight_move(Workspace(slow), start, end, MotionLimits(), 100.0)
    assert plain.profile.stretch == 1
    assert found.duration_s == found.profile.stretch * plain.duration_s
    _, _, rate, _ = line_motion(slow, start, end, found.profile, np.linspace(0, found.duration_s, 9999))
    # No slower than it must be, but for the reserve.
    assert 0.998 <= np.abs(rate).max() / 0.01 <= 1


def test_a_refused_move_has_no_targets():
    with pytest.raises(PlaceRefusedError):
        straight_move(RAILS, np.array([0, 0, -0.15]), np.array([0.3, 0, -0.15]), MotionLimits(), 100.0)
    with pytest.raises(UsageError, match="0 Hz"):
        straight_move(RAILS, np.array([0, 0, -0.15]), np.array([0.01, 0, -0.15]), MotionLimits(), 0)


def test_standing_still_is_one_target():
    place = np.array([0, 0, -0.15])
    found = straight_move(RAILS, place, place, MotionLimits(), 100.0)
    assert found.p_m.tolist() == [place.tolist()]


HEIGHTS = PressHeights(surface=assumed(-180.0, "mm", "test"))
TRAVEL = (-0.005, 0.005)
HOME = (0.0, 0.0, -0.16)


def test_a_press_is_gone_to_by_retracting_rising_crossing_and_lowering():
    retract, rise, cross, lower = moves_to((0.01, 0.0, -0.178), (0.02, 0.01), HEIGHTS)
    assert isinstance(retract, MotorRetracts)
    assert (rise.to, cross.to, lower.to) == ("clearance", "above the place", "stand-off")
    assert rise.end_m == cross.start_m == pytest.approx((0.01, 0.0, -0.17))
    assert cross.end_m == lower.start_m == pytest.approx((0.02, 0.01, -0.17))
    assert lower.end_m == pytest.approx((0.02, 0.01, -0.178))
    check_moves(RAILS, HEIGHTS, TRAVEL, [retract, rise, cross, lower])


def test_a_plan_is_refused_before_its_first_move():
    grid = np.stack(np.meshgrid([-0.02, 0.0, 0.02], [-0.02, 0.0, 0.02]), axis=-1).reshape(-1, 2)
    plan = plan_presses(RAILS, HEIGHTS, TRAVEL, HOME, grid)
    assert len(plan) == 9
    assert all(len(moves) == 4 for moves in plan)
    assert plan[1][1].start_m == plan[0][3].end_m
    with pytest.raises(PlaceRefusedError, match="Move 39, to above the place, is refused") as caught:
        plan_presses(RAILS, HEIGHTS, TRAVEL, HOME, [*grid, (0.2, 0.0)])
    assert caught.value.place_m[0] < 0.2


@pytest.mark.parametrize(
    ("moves", "said"),
    [
        ([ManipulatorMoves(to="clearance", start_m=HOME, end_m=(0, 0, -0.15))], "not retracted"),
        (
            [
                MotorRetracts(),
                ManipulatorMoves(to="above the place", start_m=(0, 0, -0.178), end_m=(0.01, 0, -0.178)),
            ],
            "sideways 8.00 mm below the clearance",
        ),
        (
            [
                MotorRetracts(),
                ManipulatorMoves(to="clearance", start_m=(0, 0, -0.178), end_m=(0, 0, -0.16)),
                ManipulatorMoves(to="above the place", start_m=(0, 0, -0.17), end_m=(0.01, 0, -0.17)),
            ],
            "starts at",
        ),
        (
            [MotorRetracts(), ManipulatorMoves(to="stand-off", start_m=(0, 0, -0.17), end_m=(0, 0, -0.179))],
            "1.00 mm below the stand-off",
        ),
    ],
)
def test_moves_in_a_dangerous_order_are_refused(moves, said):
    with pytest.raises(MoveOrderError, match=said):
        check_moves(RAILS, HEIGHTS, TRAVEL, moves)


def test_the_motors_travel_holds_stand_off_and_depth():
    with pytest.raises(MoveOrderError, match=r"5\.00 mm is shorter .* 6\.00 mm"):
        check_moves(RAILS, HEIGHTS, (0.0, 0.005), moves_to(HOME, (0, 0), HEIGHTS))


@pytest.mark.parametrize(
    "changed", [{"stand_off": 0.6}, {"clearance": 1.9}, {"depth": 0.0}, {"surface_spread": math.nan}]
)
def test_heights_that_do_not_keep_apart_are_refused(changed):
    with pytest.raises(ValidationError):
        PressHeights(surface=assumed(-180.0, "mm", "test"), **{k: assumed(v, "mm", "test") for k, v in changed.items()})
