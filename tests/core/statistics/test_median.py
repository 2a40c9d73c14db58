"""The interval of a median over replicates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.statistics.replicates import FEWEST, median_interval

VALUES = st.lists(st.floats(-1e6, 1e6), min_size=FEWEST, max_size=30)


@pytest.mark.parametrize("n", range(FEWEST))
def test_fewer_than_five_have_none(n):
    assert median_interval([0.0] * n) is None


def test_five_have_their_range_and_say_how_little_it_covers():
    found = median_interval([3.0, 1.0, 5.0, 2.0, 4.0])
    assert (found.low, found.high) == (1.0, 5.0)
    assert found.level == 1 - 2 / 2**5


def test_ends_of_eight_are_those_of_the_published_formula():
    # Hettmansperger and Sheather 1986, n = 8, k = 1: 0.9922 and 0.9297 enclose 0.95.
    share = (127 / 128 - 0.95) / (127 / 128 - 119 / 128)
    weight = 7 * share / (1 + 6 * share)
    found = median_interval([float(place) for place in range(8)])
    assert found.low == pytest.approx(weight, rel=1e-12)
    assert found.high == pytest.approx(7 - weight, rel=1e-12)


@given(VALUES)
def test_the_sample_median_lies_in_it_and_order_does_not_matter(values):
    found = median_interval(values)
    assert found.low <= np.median(values) <= found.high
    assert median_interval(values[::-1]) == found


@given(VALUES)
def test_turned_round_it_is_turned_round(values):
    found, turned = median_interval(values), median_interval([-value for value in values])
    assert (turned.low, turned.high) == pytest.approx((-found.high, -found.low), rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("draw", ["standard_normal", "standard_exponential", "standard_cauchy"])
@pytest.mark.parametrize("n", [5, 8, 20])
def test_it_covers_what_it_says_whatever_the_distribution(draw, n):
    rng = np.random.default_rng([n, len(draw)])
    centre = np.log(2) if draw == "standard_exponential" else 0.0
    trials = 4000
    found = [median_interval(values) for values in getattr(rng, draw)((trials, n))]
    covered = np.mean([one.low <= centre <= one.high for one in found])
    # Four standard errors of a share, and 0.015 by which interpolation of skewed values may be off.
    assert abs(covered - found[0].level) < 4 * np.sqrt(0.05 * 0.95 / trials) + 0.015
