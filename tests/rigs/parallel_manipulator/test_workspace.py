"""Places and moves: what is refused, by which measure, where, and that what is accepted holds between samples."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from tactbench.plugin import UsageError, assumed
from tactbench.rigs.parallel_manipulator.geometry import example_linear, example_rotary
from tactbench.rigs.parallel_manipulator.kinematics import inverse
from tactbench.rigs.parallel_manipulator.singularity import PostureLimits, measures
from tactbench.rigs.parallel_manipulator.workspace import PlaceRefusedError, Workspace

VERTICAL, ARMS = example_linear(), example_rotary()
RAILS = Workspace(VERTICAL)
ROTARY = Workspace(ARMS)
side = st.floats(-0.08, 0.08)
place = st.tuples(side, side, st.floats(-0.23, -0.17)).map(np.array)
beyond = st.tuples(side, side, st.floats(-0.5, -0.4)).map(np.array)


def _refused(work, start, end):
    with pytest.raises(PlaceRefusedError) as caught:
        work.check_move(np.array(start), np.array(end))
    return caught.value


@given(st.sampled_from([RAILS, ROTARY]), place, place, st.lists(st.floats(0, 1), min_size=20, max_size=20))
@settings(max_examples=100)
def test_what_is_accepted_keeps_its_limits_between_samples(work, start, end, fractions):
    assume(work.permits(np.array([start, end])).all())
    try:
        work.check_move(start, end)
    except PlaceRefusedError:
        return
    p = start + np.array(fractions)[:, None] * (end - start)
    q = inverse(work.delta, p)
    found = measures(work.delta, p, q)
    # The slack of the finest piece.
    assert min(found.serial.min(), found.parallel.min(), found.constraint.min()) >= 0.15 - 1e-3
    assert found.sideways_rad.max() <= np.radians(30) + 1e-12
    low, high = work.delta.joint_range
    assert (q >= low - 1e-4).all()
    assert (q <= high + 1e-4).all()
    assert (found.det * work.delta.mode > 0).all()


@given(st.sampled_from([RAILS, ROTARY]), place, beyond)
@settings(max_examples=50)
def test_a_move_is_refused_at_its_first_place_that_is_not_permitted(work, start, end):
    assume(work.permits(start[None])[0])
    error = _refused(work, start, end)
    before = start + (1 - 1e-6) * (np.array(error.place_m) - start)
    assert work.permits(before[None])[0]
    work.check_move(start, before)


@pytest.mark.parametrize(
    ("work", "to", "measure"),
    [
        (RAILS, (0.0, 0.0, 0.1), "highest joint value"),
        (RAILS, (0.0, 0.0, -0.3), "lowest joint value"),
        (RAILS, (0.15, 0.0, -0.02), "sideways angle"),
        (ROTARY, (0.0, 0.0, -0.312), "highest joint value"),
        (ROTARY, (0.0, 0.0, -0.05), "s"),
    ],
)
def test_each_limit_refuses_by_its_name(work, to, measure):
    start = (0.0, 0.0, -0.15 if work is RAILS else -0.2)
    error = _refused(work, start, to)
    assert error.measure == measure
    assert error.leg in (1, 2, 3)
    assert "Nothing was moved" in str(error)
    assert (error.value - error.limit) * (1 if measure in ("highest joint value", "sideways angle") else -1) > 0


def test_a_place_out_of_reach_is_refused_with_what_is_missing():
    with pytest.raises(PlaceRefusedError, match=r"leg 1 misses it by up to 30 mm") as caught:
        RAILS.check_place(np.array([-0.16, 0.0, -0.15]))
    assert (caught.value.measure, caught.value.leg) == ("reach", 1)
    assert caught.value.value == pytest.approx(0.03)
    RAILS.check_place(np.array([0.0, 0.0, -0.15]))


def test_the_other_way_of_assembly_is_refused():
    # Links upwards: the joints are in range, and a singularity lies between.
    up = Workspace(VERTICAL.model_copy(update={"branch": -1, "mode": 1, "joint_lowest_mm": -300.0}))
    up.check_place(np.array([0, 0, 0.15]))
    wrong = Workspace(VERTICAL.model_copy(update={"branch": -1, "joint_lowest_mm": -300.0}))
    with pytest.raises(PlaceRefusedError, match="other side of a singularity"):
        wrong.check_place(np.array([0, 0, 0.15]))


def test_out_of_a_joints_forbidden_range_is_accepted_and_into_it_is_not():
    low = np.array([0, 0, -0.28])  # carriages 60 mm below zero, 50 are permitted
    assert not RAILS.permits(low[None])[0]
    RAILS.check_move(low, np.array([0, 0, -0.15]))
    RAILS.check_move(low, np.array([0, 0, -0.275]))
    assert _refused(RAILS, low, (0, 0, -0.281)).measure == "lowest joint value"
    # Neither nearer nor farther: not a way out.
    assert _refused(RAILS, low, low).measure == "lowest joint value"


def test_a_way_out_does_not_excuse_another_limit():
    assert _refused(RAILS, (0, 0, -0.28), (0, 0, 0.1)).measure == "highest joint value"


def test_a_way_through_the_whole_forbidden_range_is_refused():
    # From beyond one limit, out, and beyond it again on the other side.
    low = VERTICAL.model_copy(update={"joint_highest_mm": 90.0})
    work = Workspace(low)
    start, end = (0.09, 0.0, -0.13), (-0.09, 0.0, -0.13)
    assert not work.permits(np.array([start, end])).any()
    assert _refused(work, start, end).measure == "highest joint value"


def test_standing_still_where_it_is_permitted_is_a_move():
    RAILS.check_move(np.array([0.01, 0, -0.15]), np.array([0.01, 0, -0.15]))


def test_from_out_of_reach_there_is_no_way():
    assert _refused(RAILS, (-0.2, 0, -0.15), (0, 0, -0.15)).measure == "reach"


def test_a_place_that_is_no_number_is_refused():
    with pytest.raises(UsageError):
        RAILS.check_move(np.array([np.nan, 0, 0]), np.zeros(3))


@pytest.mark.parametrize("limit", [0.0, -0.1, 1.0, float("nan")])
def test_limits_that_limit_nothing_are_refused(limit):
    with pytest.raises(ValidationError):
        PostureLimits(serial=assumed(limit, "1", "test"))
    with pytest.raises(ValidationError):
        PostureLimits(sideways=assumed(90 * limit, "deg", "test"))


def test_limits_are_assumed_unless_stated():
    limits = PostureLimits()
    assert {getattr(limits, name).source.tag for name in type(limits).model_fields} == {"assumed"}
    stricter = Workspace(VERTICAL, PostureLimits(parallel=assumed(0.7, "1", "test")))
    with pytest.raises(PlaceRefusedError, match=r"sigma_U comes to 0\.588, its limit is 0\.700"):
        stricter.check_place(np.array([0, 0, -0.15]))
