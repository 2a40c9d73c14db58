from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.plugin.simulation import Surface
from tactbench.rigs.twin.effects.channels import band_noise
from tactbench.rigs.twin.effects.skin_vibration import Profile, patch_mean, within_band
from tests.rigs.twin.conftest import q

RATE_HZ = 2200.0


def _density(values):
    """Mean periodogram of 60 stretches: frequencies and power per hertz."""
    stretches = values.reshape(60, -1)
    window = np.hanning(stretches.shape[1])
    power = np.abs(np.fft.rfft(stretches * window, axis=1)) ** 2
    return np.fft.rfftfreq(stretches.shape[1], 1 / RATE_HZ), 2 * power.mean(axis=0) / (RATE_HZ * np.sum(window**2))


@pytest.mark.parametrize(("low", "high"), [(30.0, 200.0), (5.0, 500.0)])
def test_noise_within_a_band_has_its_size_and_its_spectrum(low, high):
    t = np.arange(132000) / RATE_HZ
    noise = band_noise(t, 3.0, low, high, np.random.default_rng(1))
    # 60 s of a band of B hertz hold about 120 B independent numbers; four of their standard errors.
    assert noise.std() == pytest.approx(3.0, rel=4 / math.sqrt(240 * (high - low)))
    assert abs(noise.mean()) < 0.05
    f, density = _density(noise)
    corner = np.roots([1.0, -(high - low), high * low]).real
    model = f**2 / ((f**2 + corner[0] ** 2) * (f**2 + corner[1] ** 2))
    middle = math.sqrt(low * high)
    peak = middle**2 / ((middle**2 + corner[0] ** 2) * (middle**2 + corner[1] ** 2))
    for end in (low, high):
        assert np.interp(end, f, model) / peak == pytest.approx(0.5, abs=0.01)
    inside = (f > low) & (f < min(high, 300.0))
    ratio = density[inside] / model[inside]
    # 60 stretches, and at least 100 frequencies averaged: 2 % (four standard errors 0.06).
    halves = np.array_split(ratio, 2)
    assert halves[0].mean() / halves[1].mean() == pytest.approx(1.0, abs=0.06)


@given(st.lists(st.one_of(st.just(0.0), st.floats(1e-6, 10.0)), min_size=1, max_size=30))
def test_a_hum_takes_any_steps(steps):
    t = np.concatenate([[0.0], np.cumsum(steps)])
    noise = band_noise(t, 1.0, 30.0, 200.0, np.random.default_rng(2))
    assert np.all(np.isfinite(noise))
    still = np.diff(t) == 0
    np.testing.assert_allclose(np.diff(noise)[still], 0.0, atol=1e-12)


def test_a_band_too_narrow_for_its_filter_is_refused():
    with pytest.raises(RigError, match=r"5\.9 times"):
        band_noise(np.arange(3.0), 1.0, 30.0, 60.0, np.random.default_rng(0))


@given(st.floats(0.0, 40.0))
def test_a_patch_feels_the_mean_under_it(turn):
    # Hertz's pressure sqrt(1 - r^2) integrated across leaves 1 - s^2 along the way.
    s = (np.arange(4000) + 0.5) / 2000 - 1
    mean = np.sum((1 - s**2) * np.cos(turn * s)) / np.sum(1 - s**2)
    assert patch_mean(np.array([turn]))[0] == pytest.approx(mean, abs=2e-5)


@pytest.mark.parametrize("hurst", [0.5, 0.8])
def test_a_profile_has_its_roughness_and_is_self_affine_below_its_roll_off(hurst):
    surface = Surface(roughness=q(20.0, "um"), roll_off=q(1.0), hurst=q(hurst, "1"))
    step_mm = 0.008
    place = step_mm * np.arange(50000)
    profiles = [Profile(surface, np.random.default_rng(seed)) for seed in range(12)]
    heights = np.stack([profile.felt_mm(place, np.zeros(1)) for profile in profiles])
    # 400 mm hold four of the longest waves.
    np.testing.assert_allclose(heights.std(axis=1), 0.02, rtol=0.03)
    power = (np.abs(np.fft.rfft(heights * np.hanning(place.size), axis=1)) ** 2).mean(axis=0)
    per_mm = np.fft.rfftfreq(place.size, step_mm)

    def slope(longest_mm, shortest_mm):
        edges = np.geomspace(1 / longest_mm, 1 / shortest_mm, 9)
        density = [power[(per_mm >= low) & (per_mm < high)].mean() for low, high in itertools.pairwise(edges)]
        return np.polyfit(np.log(np.sqrt(edges[:-1] * edges[1:])), np.log(density), 1)[0]

    # Twelve profiles have some thirty waves in each of eight bands: a fifth of its density, 0.1 of a slope over e^3.
    assert slope(40.0, 1.2) == pytest.approx(0.0, abs=0.2)
    assert slope(0.8, 0.04) == pytest.approx(-1 - 2 * hurst, abs=0.2)


@pytest.mark.parametrize("frequency", [2.0, 60.0, 200.0])
def test_a_band_lets_through_what_two_first_order_filters_do(specs, frequency):
    (channel,) = specs["biotac"].channels("ac_pressure")
    t = np.arange(13200) / RATE_HZ
    passed = within_band(t, np.sin(2 * math.pi * frequency * t), channel)[6600:]
    gain = math.sqrt(2 * np.mean(passed**2))
    f = frequency
    expected = f / math.hypot(f, 10.0) / math.hypot(1.0, f / 1040.0)
    # Straight between samples: sinc^2 of f/2200 is 2.7 % at 200 Hz, 0.25 % at 60.
    assert gain == pytest.approx(expected, rel=2e-3 + (math.pi * f / RATE_HZ) ** 2 / 3)
