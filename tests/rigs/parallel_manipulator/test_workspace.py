"""Which places and moves are permitted, and the way to a place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin.devices import RigFile
from tactbench.rigs.parallel_manipulator.kinematics import example_linear, forward
from tactbench.rigs.parallel_manipulator.platform import Platform
from tactbench.rigs.parallel_manipulator.settings import JOINTS, settings_of
from tactbench.rigs.parallel_manipulator.workspace import PlaceRefusedError, Postures, Workspace
from tests.rigs.parallel_manipulator.spring import with_joints

WORK = Workspace(example_linear())
HOME = np.array([0.0, 0.0, -0.15])
some = st.floats(-0.15, 0.15)
place = st.tuples(some, some, st.floats(-0.3, 0.0)).map(np.array)


@given(place, place, st.lists(st.floats(0, 1), min_size=20, max_size=20))
@settings(max_examples=80, deadline=None)
def test_what_is_accepted_keeps_its_limits_between_samples(start, end, fractions):
    if (WORK.margins(start[None]) < 0).any():
        return  # a way out, which may begin beyond a limit
    try:
        WORK.check_move(start, end)
    except PlaceRefusedError:
        return
    assert WORK.margins(start + np.array(fractions)[:, None] * (end - start)).min() >= 0


@pytest.mark.parametrize(
    ("to", "measure"),
    [
        ((0.3, 0, -0.15), "reach of leg 2"),
        ((0, 0, -0.35), "lowest joint value of leg 1"),
        ((0, 0, 0.05), "highest joint value of leg 1"),
        ((0.0, 0.13, -0.1), "sideways angle of leg 1"),
    ],
)
def test_each_limit_refuses_by_its_name(to, measure):
    with pytest.raises(PlaceRefusedError, match=measure):
        WORK.check_place(np.array(to))


def test_a_singularity_on_the_way_is_refused():
    strict = Workspace(example_linear(), Postures(serial=0.85))
    strict.check_place(HOME)
    with pytest.raises(PlaceRefusedError, match="s of leg"):
        strict.check_move(HOME, np.array([0.05, 0.0, -0.15]))


def test_the_other_way_of_assembly_is_refused():
    flipped = Workspace(example_linear().model_copy(update={"mode": 1}))
    with pytest.raises(PlaceRefusedError, match="assembly mode"):
        flipped.check_place(HOME)


def test_out_of_a_joints_forbidden_range_is_accepted_and_into_it_is_not():
    outside, inside = np.array([0, 0, -0.28]), np.array([0, 0, -0.2])
    with pytest.raises(PlaceRefusedError, match="lowest joint value"):
        WORK.check_place(outside)
    WORK.check_move(outside, inside)
    with pytest.raises(PlaceRefusedError):
        WORK.check_move(inside, outside)
    with pytest.raises(PlaceRefusedError):
        WORK.check_move(outside, np.array([0, 0, -0.29]))
    # It does not excuse another limit.
    with pytest.raises(PlaceRefusedError):
        WORK.check_move(outside, np.array([0.3, 0, -0.2]))


# The way to a place ---------------------------------------------------------------------------------------------------


def platform(**changes):
    found = Platform.of(settings_of(RigFile.model_validate(with_joints(**changes))))
    assert found is not None
    return found


def test_a_place_is_gone_to_by_rising_crossing_and_lowering():
    here, up, across, down = platform().way((0.01, 0.0, -0.15), (0.02, 0.01))
    assert here == (0.01, 0.0, -0.15)
    # The surface is at -152 mm, the clearance 10 mm, the stand-off 2 mm.
    assert up == pytest.approx((0.01, 0.0, -0.142))
    assert across == pytest.approx((0.02, 0.01, -0.142))
    assert down == pytest.approx((0.02, 0.01, -0.150))


def test_way_points_follow_the_line_and_end_on_it():
    found = platform()
    way = found.way((0.01, 0.0, -0.15), (0.02, 0.01))
    q = np.array([[target[name] for name in JOINTS] for target in found.targets(way)])
    places = forward(found.workspace.delta, q)
    assert places[-1] == pytest.approx(way[-1], abs=1e-12)
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() <= 1e-3 + 1e-12


def test_a_way_with_a_place_out_of_the_workspace_is_refused_before_it_begins():
    with pytest.raises(PlaceRefusedError):
        platform().way((0.0, 0.0, -0.15), (0.2, 0.0))
    with pytest.raises(PlaceRefusedError):
        platform(settings__places__reach_x_mm=[-200.0, 200.0]).check()
