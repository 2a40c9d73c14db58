"""The linear delta against poses computed elsewhere and against itself; permitted and refused moves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from tactbench.plugin import Source, UsageError
from tactbench.rigs.parallel_manipulator.kinematics import (
    ClosureError,
    LinearDelta,
    PlaceRefusedError,
    check_move,
    forward,
    margins,
    measures,
    solve_inverse,
    way,
    way_points,
)

FREE = Source(tag="assumed", reference="to compute with")
LV = LinearDelta(
    title="vertical rails", source=FREE, base_radius_mm=150.0, platform_radius_mm=30.0, link_mm=250.0,
    joint_lowest_mm=-50.0, joint_highest_mm=250.0,
)  # fmt: skip
LI = LinearDelta(
    title="rails at 60 deg", source=FREE, base_radius_mm=130.0, platform_radius_mm=30.0, link_mm=220.0,
    inclination_deg=60.0, joint_lowest_mm=-190.0, joint_highest_mm=200.0,
)  # fmt: skip
# Place and joint values in mm; s, sigma_U, sigma_W, largest |u.t|. By the closed form and by Newton's method with 60
# digits on the unfolded chains.
POSES = [
    (LV, (0, 0, -150), (69.317121994613,) * 3, (0.8773, 0.587878, 0.831384, 0)),
    (LV, (40, 0, -150), (86.854385646540, 54.205778566621, 54.205778566621), (0.8168, 0.587878, 0.828229, 0.1386)),
    (LV, (-30, 55, -120), (72.288845230294, 123.32393086163, 70.639619885388), (0.7626, 0.587877, 0.825822, 0.2200)),
    (LV, (62.5, -41.25, -180.125), (59.650285423665, -17.587201311406, 28.599313383626),
     (0.6502, 0.587762, 0.800675, 0.2990)),
    (LI, (0, 0, -120), (64.462630667492,) * 3, (0.9927, 0.736135, 0.978829, 0)),
    (LI, (50, 20, -140), (71.212594973168, 37.091777163092, 18.440029052610), (0.9584, 0.635157, 0.897311, 0.2423)),
    (LI, (-45, -60, -100.5), (38.268245408593, 47.771800418441, 118.20450045294), (0.8991, 0.676924, 0.766588, 0.3135)),
    (LI, (10.25, -70.5, -60), (106.02303291624, 51.302048924952, 141.37780511233),
     (0.8471, 0.785097, 0.702353, 0.3205)),
]  # fmt: skip


@pytest.mark.parametrize(("delta", "place", "joints", "wanted"), POSES)
def test_a_pose_computed_elsewhere(delta, place, joints, wanted):
    p = 1e-3 * np.array(place)
    q, _ = solve_inverse(delta, p)
    assert np.abs(1e3 * q - joints).max() <= 1e-11
    # To places that are an ulp or two apart: both are rounded to double.
    assert np.abs(forward(delta, q) - p).max() <= 1e-15
    found = measures(delta, p, q)
    assert np.sign(found.det) == -1
    # Half a unit of the last of four decimals.
    shown = (found.serial.min(), np.sin(found.sideways_rad.max()))
    assert shown == pytest.approx((wanted[0], wanted[3]), abs=5.1e-5)
    assert (found.parallel, found.constraint) == pytest.approx(wanted[1:3], abs=1e-6)


@pytest.mark.parametrize("delta", [LV, LI])
def test_forward_undoes_inverse_within_the_limits(delta):
    at = np.linspace(-0.12, 0.12, 13)
    p = np.stack(np.meshgrid(at, at, at - 0.15), axis=-1).reshape(-1, 3)
    q, shortfall = solve_inverse(delta, p)
    found = measures(delta, p, q)
    sound = (shortfall < 0).all(axis=1) & (found.serial.min(axis=1) >= 0.1) & (found.parallel >= 0.1)
    sound &= found.det < 0
    assert sound.sum() > 500
    # 1e-12 of a link: eight times what sixty thousand poses lost at most.
    assert np.abs(forward(delta, q[sound]) - p[sound]).max() <= 1e-12 * delta.link_m.max()


some = st.floats(-5, 5)


@given(some, some, some, st.sampled_from([LV, LI]))
@settings(max_examples=100)
def test_whatever_is_asked_nothing_is_nan_and_links_keep_their_length(a, b, c, delta):
    q, shortfall = solve_inverse(delta, np.array([a, b, c]))
    assert np.isfinite(q).all()
    if (shortfall < 0).all():
        away = np.linalg.norm(np.array([a, b, c]) - delta.centre_m(q), axis=-1)
        assert np.abs(away - delta.link_m).max() <= 1e-14 * max(1.0, abs(a), abs(b), abs(c))
    try:
        p = forward(delta, np.array([a, b, c]))
    except ClosureError:
        return
    away = np.linalg.norm(p - delta.centre_m(np.array([a, b, c])), axis=-1)
    assert np.abs(away - delta.link_m).max() <= 2e-14


def test_joint_values_without_a_place_are_refused():
    with pytest.raises(ClosureError, match="meet"):
        forward(LV, np.array([0.0, 0.0, 0.6]))
    coincident = LV.model_copy(update={"base_radius_mm": (30.0,) * 3})
    with pytest.raises(ClosureError, match="line"):
        forward(LinearDelta.model_validate(coincident.model_dump()), np.zeros(3))


def test_what_is_no_number_is_refused():
    for ask in (solve_inverse, forward):
        with pytest.raises(UsageError):
            ask(LV, np.full(3, np.nan))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"joint_lowest_mm": 300.0}, "lowest"),
        ({"link_mm": 0.0}, "link_mm"),
        ({"arm_mm": 1.0}, "arm_mm"),
    ],
)
def test_a_geometry_that_cannot_be_is_refused(changed, said):
    with pytest.raises(ValidationError, match=said):
        LinearDelta.model_validate(LV.model_dump() | changed)


# Permitted moves ------------------------------------------------------------------------------------------------------

HOME = np.array([0.0, 0.0, -0.15])
near = st.floats(-0.15, 0.15)
place = st.tuples(near, near, st.floats(-0.3, 0.0)).map(np.array)


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


def test_two_legs_in_one_direction_permit_no_place():
    folded = LinearDelta.model_validate(LV.model_dump() | {"azimuth_deg": (0.0, 0.5, 240.0)})
    with pytest.raises(PlaceRefusedError, match="sigma_U"):
        check_move(folded, HOME, HOME)


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
