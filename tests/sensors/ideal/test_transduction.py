"""The ideal grid against its closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.plugin.simulation import SkinGrid
from tactbench.sensors.ideal import SPEC
from tactbench.sensors.ideal.transduction import build

NAMES = [channel.name for channel in SPEC.channels("taxel")]
PLACES = np.array([channel.position_m for channel in SPEC.channels("taxel")])[:, :2] * 1e3
S, SIGMA = 1000.0, 1.5  # the spec's sensitivity [count/N] and influence [mm]


def test_uniform_pressure_gives_the_error_functions(make_grid, make_state):
    grid = make_grid(SPEC)
    pressure = 0.02
    reading = build(SPEC, grid, NAMES)(_pressed(make_state, grid, np.full((48, 48), pressure)))

    def over_sheet(at: float) -> float:
        root = math.sqrt(2.0) * SIGMA
        return SIGMA * math.sqrt(math.pi / 2) * (math.erf((8.0 - at) / root) - math.erf((-8.0 - at) / root))

    by_hand = [S * pressure * over_sheet(x) * over_sheet(s) for x, s in PLACES]
    # The same integral, telescoped: only rounding is left.
    assert reading == pytest.approx(by_hand, rel=1e-12)


@settings(max_examples=30)
@given(force=st.floats(0.1, 20.0), x=st.floats(-1.0, 1.0), s=st.floats(-1.0, 1.0))
def test_gaussian_pressure_widens_the_influence(force, x, s):
    width = 1.0
    grid = _fine()
    r2 = (grid.x_mm[:, None] - x) ** 2 + (grid.s_mm[None, :] - s) ** 2
    pressure = force / (2 * math.pi * width**2) * np.exp(-r2 / (2 * width**2))
    reading = build(SPEC, grid, NAMES)(_bare(grid, pressure))
    wide = SIGMA**2 + width**2
    away = ((PLACES - (x, s)) ** 2).sum(axis=1)
    by_hand = S * force * SIGMA**2 / wide * np.exp(-away / (2 * wide))
    # Cells of 0.083 mm hold a constant pressure: second order, (0.083)^2/24 per mm^2 of curvature of either Gaussian.
    assert reading == pytest.approx(by_hand, rel=5e-3, abs=S * force * 1e-5)


def test_a_point_load_draws_the_influence():
    grid = _fine()
    pressure = np.zeros((192, 192))
    i, j = 100, 80
    dx, ds = grid.cell_mm
    pressure[i, j] = 2.0 / (dx * ds)
    reading = build(SPEC, grid, NAMES)(_bare(grid, pressure))
    away = ((PLACES - (grid.x_mm[i], grid.s_mm[j])) ** 2).sum(axis=1)
    # The mean of the Gaussian over the one loaded cell differs by r^2 dx^2 / (24 sigma^4): 0.5 % at the far corner.
    assert reading == pytest.approx(S * 2.0 * np.exp(-away / (2 * SIGMA**2)), rel=1e-2)


def test_readings_add_and_scale_with_pressure(make_grid, make_state):
    grid = make_grid(SPEC)
    rng = np.random.default_rng(5)
    one, two = rng.random((2, 48, 48))
    transducer = build(SPEC, grid, NAMES)
    together = transducer(_pressed(make_state, grid, one + 3.0 * two))
    apart = transducer(_pressed(make_state, grid, one)) + 3.0 * transducer(_pressed(make_state, grid, two))
    assert together == pytest.approx(apart, rel=1e-12)


def test_only_the_wanted_taxels_come_in_the_order_asked_for(make_grid, make_state):
    grid = make_grid(SPEC)
    state = _pressed(make_state, grid, np.random.default_rng(1).random((48, 48)))
    every = build(SPEC, grid, NAMES)(state)
    assert build(SPEC, grid, ["T7", "T2"])(state) == pytest.approx([every[6], every[1]], rel=1e-12)


def test_unknown_taxels_and_other_grids_are_refused(make_grid, make_state):
    grid = make_grid(SPEC)
    with pytest.raises(RigError, match="T17"):
        build(SPEC, grid, ["T17"])
    with pytest.raises(RigError, match="cells"):
        build(SPEC, grid, NAMES)(_bare(_fine(), np.zeros((192, 192))))


def _pressed(make_state, grid, pressure):
    return make_state(SPEC, grid, np.zeros_like(pressure), pressure_mpa=pressure)


def _fine() -> SkinGrid:
    centres = -8.0 + (np.arange(192) + 0.5) * 16.0 / 192
    return SkinGrid(centres, centres)


def _bare(grid, pressure):
    from tactbench.plugin.simulation import SkinState

    return SkinState(grid, 1.0, 0 * pressure, pressure, 0 * pressure + 2.0, 0.0, 0.0, 0.0, 0.0)
