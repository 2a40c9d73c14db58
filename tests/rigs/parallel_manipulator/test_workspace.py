"""Which places and moves are permitted, and the way to a place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.rigs.parallel_manipulator.kinematics import (
    LinearDelta,
    PlaceRefusedError,
    check_move,
    forward,
    margins,
    way,
    way_points,
)
from tests.rigs.parallel_manipulator.test_kinematics import LI, LV

HOME = np.array([0.0, 0.0, -0.15])
some = st.floats(-0.15, 0.15)
place = st.tuples(some, some, st.floats(-0.3, 0.0)).map(np.array)


@given(place, place, st.lists(st.floats(0, 1), min_size=20, max_size=20))
@settings(max_examples=80, deadline=None)
def test_what_is_accepted_keeps_its_limits_between_samples(start, end, fractions):
    if min(left.min() for left in margins(LV, start[None]).values()) < 0:
        return  # a way out, which may begin beyond a limit
    try:
        check_move(LV, start, end)
    except PlaceRefusedError:
        return
    between = start + np.array(fractions)[:, None] * (end - start)
    for name, left in margins(LV, between).items():
        # What may be lost between two samples (derived, in the module's text).
        assert left.min() >= (-7e-6 if "joint" in name else -0.005 if "s" in name else 0)


@pytest.mark.parametrize(
    ("to", "measure"),
    [
        ((0.3, 0, -0.15), "reach"),
        ((0, 0, -0.35), "lowest"),
        ((0, 0, 0.05), "highest"),
        ((0.0, 0.13, -0.1), "sideways"),
    ],
)
def test_each_limit_refuses_by_its_name(to, measure):
    with pytest.raises(PlaceRefusedError, match=measure):
        check_move(LV, np.array(to), np.array(to))


def test_a_singularity_on_the_way_is_refused():
    # The link of the first leg is nearly perpendicular to its rail far on the other side.
    wide = LV.model_copy(update={"sideways_deg": 89.0})
    with pytest.raises(PlaceRefusedError, match=" s of"):
        check_move(wide, HOME, np.array([-0.1276, 0.0, -0.05]))


def test_the_other_way_of_assembly_is_refused():
    wide = LinearDelta.model_validate(LI.model_dump() | {"sideways_deg": 89.0, "joint_highest_mm": 500.0})
    above = np.array([-0.018, 0.013, 0.223])
    with pytest.raises(PlaceRefusedError, match="assembly mode"):
        check_move(wide, above, above)


def test_out_of_a_joints_forbidden_range_is_refused_where_the_next_place_is_forbidden():
    outside, inside = np.array([0, 0, -0.28]), np.array([0, 0, -0.2])
    for move in ((outside, outside), (outside, inside), (inside, outside)):
        with pytest.raises(PlaceRefusedError, match="lowest"):
            check_move(LV, *move)
    # Where it stands is not looked at: by a drive's corridor it may be beyond a limit.
    at_limit_m = forward(LV, np.full(3, -0.05 - 1e-5))
    check_move(LV, at_limit_m, inside)


# The way to a place ---------------------------------------------------------------------------------------------------


def test_a_place_is_gone_to_by_rising_crossing_and_lowering():
    places = way(LV, (0.01, 0.0, -0.15), (0.02, 0.01), -0.142, -0.150)
    assert places == [(0.01, 0.0, -0.15), (0.01, 0.0, -0.142), (0.02, 0.01, -0.142), (0.02, 0.01, -0.150)]
    points = forward(LV, np.array(list(way_points(LV, places))))
    assert points[-1] == pytest.approx(places[-1], abs=1e-12)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= 1e-3 + 1e-12


def test_a_way_with_a_place_out_of_the_workspace_is_refused_before_it_begins():
    with pytest.raises(PlaceRefusedError):
        way(LV, (0.0, 0.0, -0.15), (0.2, 0.0), -0.142, -0.150)
