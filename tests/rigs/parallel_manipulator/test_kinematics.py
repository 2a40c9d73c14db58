"""The linear delta against poses computed elsewhere, against itself, and what it refuses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from tactbench.plugin import Source, UsageError
from tactbench.rigs.parallel_manipulator.kinematics import (
    ClosureError,
    LinearDelta,
    UnreachableError,
    forward,
    inverse,
    measures,
    solve_inverse,
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
    q = inverse(delta, p)
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


def test_a_place_out_of_reach_names_leg_and_shortfall():
    with pytest.raises(UnreachableError, match=r"Leg 2 .*\(200\.000,"):
        inverse(LV, np.array([0.2, 0.0, -0.15]))


def test_joint_values_without_a_place_are_refused():
    with pytest.raises(ClosureError, match="meet"):
        forward(LV, np.array([0.0, 0.0, 0.6]))
    coincident = LV.model_copy(update={"base_radius_mm": (30.0,) * 3})
    with pytest.raises(ClosureError, match="line"):
        forward(LinearDelta.model_validate(coincident.model_dump()), np.zeros(3))


@pytest.mark.parametrize("bad", [np.full(3, np.nan), np.zeros(2)])
def test_what_is_not_a_place_is_refused(bad):
    for ask in (inverse, forward):
        with pytest.raises(UsageError):
            ask(LV, bad)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"azimuth_deg": (0.0, 0.5, 240.0)}, "same azimuth"),
        ({"joint_lowest_mm": 300.0}, "lowest"),
        ({"link_mm": 0.0}, "link_mm"),
        ({"arm_mm": 1.0}, "arm_mm"),
    ],
)
def test_a_geometry_that_cannot_be_is_refused(changed, said):
    with pytest.raises(ValidationError, match=said):
        LinearDelta.model_validate(LV.model_dump() | changed)
