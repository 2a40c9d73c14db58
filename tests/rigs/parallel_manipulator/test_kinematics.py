"""Laws of the kinematics: there and back, symmetry, direction, and every refusal by name."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from tactbench.plugin import UsageError
from tactbench.rigs.parallel_manipulator.geometry import (
    Geometry,
    LinearDelta,
    RotaryDelta,
    example_linear,
    example_rotary,
)
from tactbench.rigs.parallel_manipulator.jacobian import joint_effort, links
from tactbench.rigs.parallel_manipulator.kinematics import (
    NoClosureError,
    SingularError,
    UnreachableError,
    forward,
    inverse,
    mode_of,
    solve_forward,
    solve_inverse,
)
from tactbench.rigs.parallel_manipulator.singularity import measures, place_error_m

VERTICAL = example_linear()
INCLINED = VERTICAL.model_copy(
    update={"base_radius_mm": 130.0, "link_mm": 220.0, "inclination_deg": 60.0, "joint_lowest_mm": -250.0}
)
ARMS = example_rotary()
UNEQUAL = ARMS.model_copy(
    update={
        "azimuth_deg": (1.0, 118.0, 243.0),
        "base_radius_mm": (90.0, 95.0, 88.0),
        "link_mm": (220.0, 222.0, 219.0),
        "offset_mm": ((0.3, -0.2, 1.0), (0.0, 0.1, -0.4), 0.0),
    }
)
MACHINES = {"vertical": VERTICAL, "inclined": INCLINED, "arms": ARMS, "unequal": UNEQUAL}
some_machine = st.sampled_from(list(MACHINES.values()))
side = st.floats(-0.1, 0.1)
height = st.floats(-0.22, -0.12)


def _posture(delta, p):
    """Joint values of a place that is not near a singularity."""
    solved = solve_inverse(delta, p)
    assume((solved.shortfall_m < 0).all())
    found = measures(delta, p, solved.q)
    assume(found.serial.min() > 0.1 and found.parallel > 0.1)
    return solved.q


@given(some_machine, side, side, height, st.sampled_from([-1, 1]))
@settings(max_examples=150)
def test_forward_undoes_inverse(delta, x, y, z, branch):
    delta = delta.model_copy(update={"branch": branch})
    p = np.array([x, y, z])
    q = _posture(delta, p)
    mode = int(mode_of(delta, p, q))
    length = delta.link_m.max()
    again = forward(delta, q, mode)
    assert np.abs(again - p).max() <= 1e-12 * length
    assert (np.abs(inverse(delta, again) - q) * delta.gear_m).max() <= 1e-12 * length


@given(some_machine, side, side, height)
@settings(max_examples=100)
def test_the_other_mode_is_the_mirror_image_on_the_joint_centres(delta, x, y, z):
    p = np.array([x, y, z])
    q = _posture(delta, p)
    two = [solve_forward(delta, q, mode).p_m for mode in (-1, 1)]
    c = delta.centre_m(q)
    assert np.linalg.norm(two - c[:, None], axis=2) == pytest.approx(np.stack([delta.link_m] * 2, axis=1), rel=1e-12)
    assert solve_forward(delta, q, 1).det == -solve_forward(delta, q, -1).det


@given(st.sampled_from([VERTICAL, INCLINED, ARMS]), side, side, height)
@settings(max_examples=100)
def test_a_third_of_a_turn_passes_the_joints_on(delta, x, y, z):
    p = np.array([x, y, z])
    q = _posture(delta, p)
    c, s = -0.5, math.sqrt(0.75)
    turned = np.array([c * x - s * y, s * x + c * y, z])
    # s of 0.1 multiplies rounding by ten, and by more in sums.
    assert inverse(delta, turned) == pytest.approx(np.roll(q, 1), abs=1e-13)


@given(side, side, height, st.floats(-0.2, 0.2))
@settings(max_examples=50)
def test_vertical_rails_rise_with_the_platform(x, y, z, rise):
    q = _posture(VERTICAL, np.array([x, y, z]))
    assert inverse(VERTICAL, np.array([x, y, z + rise])) == pytest.approx(q + rise, abs=1e-14)


@given(st.floats(-0.06, 0.06), st.floats(-0.06, 0.06), height, st.floats(1e-4, 1e-2))
@settings(max_examples=50)
def test_arms_go_down_with_the_platform(x, y, z, fall):
    p = np.array([x, y, z])
    q = _posture(ARMS, p)
    assume((links(ARMS, p, q).unit[:, 2] < 0).all())  # the links hang
    lower = solve_inverse(ARMS, p - [0, 0, fall])
    assume((lower.shortfall_m < 0).all())
    assert (lower.q > q).all()


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), some_machine, st.sampled_from([-1, 1]))
@settings(max_examples=200)
def test_whatever_is_asked_nothing_is_nan(a, b, c, delta, branch):
    delta = delta.model_copy(update={"branch": branch})
    solved, placed = solve_inverse(delta, np.array([a, b, c])), solve_forward(delta, np.array([a, b, c]))
    for found in (solved.q, solved.shortfall_m, placed.p_m, placed.det, placed.gap_m):
        assert np.isfinite(found).all()


def test_a_place_out_of_reach_names_leg_and_shortfall():
    with pytest.raises(
        UnreachableError, match=r"Leg 1 .* misses the place \(-200\.000, 0\.000, -150\.000\) mm"
    ) as caught:
        inverse(VERTICAL, np.array([[0, 0, -0.15], [-0.2, 0, -0.15]]))
    # From (120, 0) to (-200, 0) are 320 mm, and the link has 250.
    assert caught.value.leg == 1
    assert caught.value.shortfall_m == pytest.approx(0.07, abs=1e-15)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_arms_miss_places_too_far_too_near_and_too_far_sideways():
    far, near = np.array([0.06 + 0.33, 0, 0]), np.array([0.06, 0, -0.1])
    beside = np.array([0.06, 0.23, -0.1])
    for place, shortfall in ((far, 0.01), (near, 0.02), (beside, 0.01)):
        assert solve_inverse(ARMS, place).shortfall_m[0] == pytest.approx(shortfall, abs=1e-15)


def test_a_place_at_the_shaft_is_out_of_reach():
    with pytest.raises(UnreachableError):
        inverse(ARMS, np.array([0.06, 0, 0]))


def test_a_link_just_long_enough_is_reached():
    # 250 mm from the rail's foot, to rounding.
    q = inverse(VERTICAL, np.array([0.12 - 0.25, 0, -0.15]))
    assert q[0] == pytest.approx(-0.15, abs=1e-6)


def test_links_that_do_not_meet_are_not_closed():
    with pytest.raises(NoClosureError, match="do not meet") as caught:
        forward(VERTICAL, np.array([0.0, 0.0, 0.45]))
    assert caught.value.gap_m > 0


def test_carriages_in_one_place_fix_nothing():
    # Rails at 60 deg, 100 mm from the axis, meet on it 200 mm behind.
    with pytest.raises(SingularError, match="one line"):
        forward(INCLINED, np.full(3, -0.2))


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e7])
def test_what_is_not_a_place_is_refused(bad):
    for ask in (inverse, forward):
        with pytest.raises(UsageError, match="finite"):
            ask(VERTICAL, np.array([bad, 0, 0]))
    with pytest.raises(UsageError, match="shape"):
        inverse(VERTICAL, np.zeros(2))


def test_efforts_that_hold_ten_newtons():
    down = np.array([0, 0, -10.0])
    for delta, place, wanted in (
        (VERTICAL, (0, 0, -0.15), (3.33,) * 3),
        (INCLINED, (0, 0, -0.12), (4.14,) * 3),
        (ARMS, (0, 0, -0.2), (0.433,) * 3),
        (VERTICAL, (0.0625, -0.04125, -0.180125), (7.04, -0.27, 3.23)),
    ):
        p = np.array(place)
        found = np.abs(joint_effort(delta, p, inverse(delta, p), down) * np.sign(wanted))
        assert found == pytest.approx(np.abs(wanted), abs=0.005)


def test_the_work_of_joints_and_platform_is_the_same():
    p, force, v = np.array([0.03, -0.02, -0.2]), np.array([1.0, -2.0, 3.0]), np.array([0.3, 0.1, -0.2])
    q = inverse(UNEQUAL, p)
    h = 1e-6
    rate = (inverse(UNEQUAL, p + h * v) - inverse(UNEQUAL, p - h * v)) / (2 * h)
    assert joint_effort(UNEQUAL, p, q, force) @ rate == pytest.approx(force @ v, rel=1e-8)


def test_an_error_of_the_carriages_moves_the_platform_at_most_so_far():
    p = np.array([0, 0, -0.15])
    q = inverse(VERTICAL, p)
    assert place_error_m(VERTICAL, p, q, 1e-6) == pytest.approx(2.6e-6, rel=0.01)
    errors = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) * 1e-6
    moved = np.linalg.norm(forward(VERTICAL, q + errors) - p, axis=1).max()
    assert moved <= 2.6e-6


def test_a_geometry_is_read_from_a_file_by_its_kind():
    read = TypeAdapter(Geometry)
    for example in (VERTICAL, ARMS):
        assert read.validate_json(read.dump_json(example)) == example
        assert "example" in example.title
        assert example.source.tag == "assumed"
    stated = VERTICAL.model_dump() | {"azimuth_deg": (0, 120, 240), "link_mm": 260}
    assert read.validate_python(stated).link_m == pytest.approx([0.26] * 3)


@pytest.mark.parametrize(
    ("kind", "changed", "said"),
    [
        (LinearDelta, {"link_mm": -1.0}, "greater than 0"),
        (LinearDelta, {"link_mm": math.nan}, "finite"),
        (LinearDelta, {"joint_lowest_mm": 300.0}, "not below its highest"),
        (LinearDelta, {"azimuth_deg": (0, 360, 120)}, "same azimuth"),
        (RotaryDelta, {"arm_mm": 0.0}, "greater than 0"),
        (RotaryDelta, {"inclination_deg": 60.0}, "Extra inputs"),
        (RotaryDelta, {"branch": 0}, "Input should be -1 or 1"),
    ],
)
def test_a_geometry_that_cannot_be_is_refused(kind, changed, said):
    example = VERTICAL if kind is LinearDelta else ARMS
    with pytest.raises(ValidationError, match=said):
        kind.model_validate(example.model_dump() | changed)


def test_a_changed_copy_computes_its_arrays_anew():
    assert VERTICAL.link_m[0] == 0.25
    longer = VERTICAL.model_copy(update={"link_mm": 300.0})
    assert longer.link_m[0] == pytest.approx(0.3)
    with pytest.raises(ValidationError):
        VERTICAL.model_copy(update={"link_mm": 0.0})
