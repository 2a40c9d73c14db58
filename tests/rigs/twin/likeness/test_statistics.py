"""Laws of the statistics, on arrays whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.rigs.twin.likeness.statistics import (
    allan_deviation,
    component_shares,
    noise_correlation,
    offsets,
    participation,
    warming,
    white_noise,
    zero_crossing,
)

sizes = st.floats(0.1, 1e3)


@given(st.integers(1, 30), sizes)
def test_equal_changes_all_take_part_and_a_single_one_alone(n, size):
    # Sums of n equal numbers: rounding only.
    assert participation(np.full((1, n), -size)) == pytest.approx(n, rel=1e-12)
    assert participation(np.eye(n) * size) == pytest.approx(1.0, rel=1e-12)


@given(st.lists(sizes, min_size=2, max_size=20), sizes)
def test_participation_lies_between_and_does_not_depend_on_scale_or_sign(changes, factor):
    row = np.array([changes])
    found = participation(row)[0]
    assert 1.0 - 1e-12 <= found <= row.size + 1e-9
    assert participation(-factor * row)[0] == pytest.approx(found, rel=1e-9)


def test_changes_below_the_least_do_not_take_part():
    assert participation(np.array([[10.0, 10.0, 2.9]]), least=3.0)[0] == pytest.approx(2.0)
    assert np.isnan(participation(np.array([[1.0, 1.0]]), least=3.0)[0])


def test_white_noise_is_found_under_any_level_and_drift():
    rng = np.random.default_rng(1)
    t = np.arange(40000.0)[:, None]
    noise = 0.7 * rng.standard_normal((40000, 2))
    drifting = noise + np.array([[0.3, -2.0]]) * t + 3000.0
    # Standard error of a variance from second differences: about 1.3 sqrt(2/40000), halved for the root: 0.5 %.
    assert white_noise(drifting) == pytest.approx(0.7, rel=0.02)
    # A straight line is no noise at all; rounding of numbers up to 1e5.
    assert white_noise(drifting) == pytest.approx(white_noise(noise), rel=1e-6)


def test_noise_of_two_channels_is_correlated_as_it_is():
    rng = np.random.default_rng(2)
    own = rng.standard_normal((20000, 2))
    # Standard error 1.4/sqrt(20000) = 0.01.
    assert noise_correlation(own) == pytest.approx(0.0, abs=0.04)
    assert noise_correlation(own + rng.standard_normal((20000, 1))) == pytest.approx(0.5, abs=0.04)
    assert np.isnan(noise_correlation(np.zeros((10, 3))))


def test_allan_deviation_of_white_noise_falls_with_the_root_of_the_time():
    counts = 0.5 * np.random.default_rng(3).standard_normal((200000, 4))
    taus = np.array([0.01, 0.04, 0.16, 0.64])
    found = np.array([allan_deviation(counts, 0.01, tau).mean() for tau in taus])
    # 3000 averages of four channels at the longest: 1 %.
    assert found * np.sqrt(taus / 0.01) == pytest.approx(0.5, rel=0.03)


def test_allan_deviation_of_a_ramp_rises_with_the_time():
    ramp = 0.2 * np.arange(10000.0)[:, None] * 0.01
    for tau in (0.1, 1.0, 5.0):
        # Exact but for rounding.
        assert allan_deviation(ramp, 0.01, tau)[0] == pytest.approx(0.2 * tau / np.sqrt(2.0), rel=1e-9)


def test_allan_deviation_needs_two_averages():
    assert np.isnan(allan_deviation(np.zeros((10, 2)), 0.01, 0.1)).all()


def test_components_are_as_many_as_causes():
    rng = np.random.default_rng(4)
    causes = rng.standard_normal((500, 3)) @ rng.standard_normal((3, 12)) + 100.0
    shares = component_shares(causes)
    assert shares.sum() == pytest.approx(1.0)
    assert np.all(np.diff(shares) <= 0)
    # Three causes and a constant: the rest is rounding.
    assert shares[3:].sum() < 1e-20


@given(st.floats(20.0, 300.0), st.floats(10.0, 500.0), st.floats(100.0, 1200.0))
def test_a_warm_up_is_found_as_it_was_made(rise, level, tau):
    t = np.arange(0.0, 720.0, 5.0)
    found_rise, found_tau = warming(t, level - rise * np.exp(-t / tau))
    # The golden section ends at the root of rounding of a flat minimum.
    assert found_tau == pytest.approx(tau, rel=1e-3)
    assert found_rise == pytest.approx(rise, rel=2e-3)


def test_offsets_are_told_apart():
    rng = np.random.default_rng(5)
    levels = 3000.0 + 15.0 * rng.standard_normal((4000, 1)) + 4.0 * rng.standard_normal((4000, 19))
    shared, own = offsets(levels)
    # The mean over 19 channels keeps 16/19 of their own variance; standard error 1/sqrt(8000).
    assert shared == pytest.approx(np.sqrt(225.0 + 16.0 / 19.0), rel=0.05)
    assert own == pytest.approx(4.0, rel=0.05)


def test_the_crossing_is_where_falling_turns_into_rising():
    angle = np.linspace(0.0, 180.0, 3601)
    edges = tuple(range(0, 181, 10))
    # Linear in the angle: exact up to the fill of the bins.
    assert zero_crossing(angle, angle - 37.0, edges) == pytest.approx(37.0, abs=0.1)
    assert np.isnan(zero_crossing(angle, angle + 1.0, edges))
