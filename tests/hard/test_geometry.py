"""Properties of the gap over random indenters."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import RigError, assumed
from tactbench.plugin.simulation import SkinSheet
from tactbench.rigs.twin.geometry import STEEPEST, Contact, check_contact, gap_mm, skin_grid
from tactbench.rigs.twin.shapes import BEYOND_MM

SHEET = SkinSheet(
    x_min=assumed(-10, "mm", "t"), x_max=assumed(10, "mm", "t"), arc=assumed(20, "mm", "t"), cells=(40, 50)
)
GRID = skin_grid(SHEET)
INF = st.just(math.inf)
FINGERS = st.one_of(INF, st.floats(4, 100)).map(
    lambda radius: SHEET.model_copy(update={"outer_radius": assumed(radius, "mm", "t")})
)
CAPS, PLACES = st.floats(1, 1e9), st.floats(-9, 9)


@given(
    st.builds(
        Contact, st.one_of(INF, st.floats(-4, 15).map(lambda exponent: 10.0**exponent)), st.floats(-30, 30),
        st.floats(-30, 30), st.floats(-2, 2), st.floats(-2, 2),
    ),
    FINGERS,
)  # fmt: skip
def test_a_contact_is_refused_or_has_a_finite_gap_of_at_least_zero(contact, finger):
    on_the_sheet = abs(contact.x_mm) <= 10 and abs(contact.s_mm) <= 10
    if contact.radius_mm < 0.5 or not on_the_sheet or math.hypot(contact.tilt_x, contact.tilt_s) > STEEPEST:
        with pytest.raises(RigError) as refused:
            check_contact(GRID, contact)
        assert refused.value.hint
        return
    check_contact(GRID, contact)
    gap = gap_mm(GRID, contact, finger)
    assert np.isfinite(gap).all()
    assert gap.min() >= 0


@given(CAPS, CAPS, PLACES, PLACES, FINGERS)
def test_a_larger_cap_is_nowhere_further_away(first, second, x, s, finger):
    small, large = sorted((first, second))
    near, far = (gap_mm(GRID, Contact(radius, x, s), finger) for radius in (large, small))
    # Where the smaller cap has ended, its gap is a number that stands for "never".
    there = far < small + BEYOND_MM
    # Rounding of gaps of up to a few finger radii.
    assert np.all(near[there] <= far[there] + 1e-12)
