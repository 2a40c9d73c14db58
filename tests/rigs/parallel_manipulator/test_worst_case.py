"""The largest forces of a touch and above the ceiling."""

import math

import pytest

from tactbench.plugin import UsageError
from tactbench.rigs.parallel_manipulator.worst_case import (
    Reaction,
    approach_speed_m_s,
    check_largest_force,
    first_touch_n,
    largest_force_n,
)

T = 0.01


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
