"""The ideal grid against its closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.sensors.ideal import SPEC, build
from tests.sensors.skin_states import dent, grid_of, state_of

NAMES = [channel.name for channel in SPEC.channels("taxel")]
PLACES = np.array([channel.position_m for channel in SPEC.channels("taxel")])[:, :2] * 1e3
S, SIGMA = 1000.0, 1.5  # the spec's sensitivity [count/N] and influence [mm]
GRID, FINE = grid_of(SPEC), grid_of(SPEC, 4.0)


def reading(grid, pressure, channels=NAMES):
    return build(SPEC, grid, channels)(state_of(SPEC, grid, pressure_mpa=pressure))


def away2(x, s):
    return ((PLACES - (x, s)) ** 2).sum(axis=1)


def test_uniform_pressure_gives_the_error_functions():
    def over_sheet(at):
        root = math.sqrt(2.0) * SIGMA
        return SIGMA * math.sqrt(math.pi / 2) * (math.erf((8.0 - at) / root) - math.erf((-8.0 - at) / root))

    by_hand = [S * 0.02 * over_sheet(x) * over_sheet(s) for x, s in PLACES]
    # The same integral, telescoped: only rounding is left.
    assert reading(GRID, np.full((48, 48), 0.02)) == pytest.approx(by_hand, rel=1e-12)


@settings(max_examples=30)
@given(force=st.floats(0.1, 20.0), x=st.floats(-1.0, 1.0), s=st.floats(-1.0, 1.0))
def test_gaussian_pressure_widens_the_influence(force, x, s):
    width = 1.0
    pressure = dent(FINE, force / (2 * math.pi * width**2), x, s, width, keep_volume=False)
    wide = SIGMA**2 + width**2
    by_hand = S * force * SIGMA**2 / wide * np.exp(-away2(x, s) / (2 * wide))
    # Cells of 0.083 mm hold a constant pressure: second order, (0.083)^2/24 per mm^2 of curvature of either Gaussian.
    assert reading(FINE, pressure) == pytest.approx(by_hand, rel=5e-3, abs=S * force * 1e-5)


def test_readings_add_and_scale_with_pressure_and_come_in_the_order_asked_for():
    one, two = np.random.default_rng(5).random((2, 48, 48))
    together = reading(GRID, one + 3.0 * two)
    assert together == pytest.approx(reading(GRID, one) + 3.0 * reading(GRID, two), rel=1e-12)
    assert reading(GRID, one + 3.0 * two, ["T7", "T2"]) == pytest.approx(together[[6, 1]], rel=1e-12)


def test_unknown_taxels_and_other_grids_are_refused():
    with pytest.raises(RigError, match="T17"):
        build(SPEC, GRID, ["T17"])
