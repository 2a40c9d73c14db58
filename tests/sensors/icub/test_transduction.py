"""The iCub's capacitance: uniform compression, direction, averages."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.sensors.biotac.spec import SPEC as BIOTAC
from tactbench.sensors.icub.spec import SPEC
from tactbench.sensors.icub.transduction import build, taxel_weight

NAMES = [channel.name for channel in SPEC.channels("taxel")]
REST = np.array([channel.rest.value for channel in SPEC.channels("taxel") if channel.rest is not None])
FOAM_MM = 2.0


def test_nothing_touching_reads_the_rest_level(make_grid, make_state):
    grid = make_grid(SPEC)
    reading = build(SPEC, grid, NAMES)(make_state(SPEC, grid, np.zeros((len(grid.x_mm), len(grid.s_mm)))))
    # Weights add to 1 up to rounding of 2000 terms.
    assert reading == pytest.approx(REST, abs=1e-9)


@given(strain=st.floats(0.0, 0.94))
def test_uniform_compression_gives_the_plate_capacitor(strain):
    grid, state = _uniform(strain)
    transducer = build(SPEC, grid, NAMES)
    assert transducer.capacitance(state) == pytest.approx(1.0 / (1.0 - strain), rel=1e-9)
    assert transducer(state) == pytest.approx(REST - 60.0 * strain / (1.0 - strain), rel=1e-9)


def test_the_plates_never_meet():
    grid, state = _uniform(1.3)
    assert build(SPEC, grid, NAMES).capacitance(state) == pytest.approx(20.0, rel=1e-9)  # 1 / least_gap


def test_pressing_on_a_taxel_lowers_it_most(make_grid, make_state, make_dent):
    grid = make_grid(SPEC)
    transducer = build(SPEC, grid, NAMES)
    for row, channel in enumerate(SPEC.channels("taxel")):
        assert channel.position_m is not None
        x, y, z = (1e3 * c for c in channel.position_m)
        hollow = make_dent(grid, 0.8, x, 6.5 * np.arctan2(y, -z), 1.0, keep_volume=False)
        change = transducer(make_state(SPEC, grid, hollow)) - REST
        assert np.argmin(change) == row
        assert (change <= 1e-9).all()


def test_mirrored_taxels_read_the_same_for_a_mirrored_dent(make_grid, make_state, make_dent):
    grid = make_grid(SPEC)
    transducer = build(SPEC, grid, NAMES)
    left = transducer(make_state(SPEC, grid, make_dent(grid, 0.7, 1.0, 2.0)))
    right = transducer(make_state(SPEC, grid, make_dent(grid, 0.7, 1.0, -2.0)))
    for first, second in (("T2", "T3"), ("T5", "T6"), ("T7", "T8"), ("T9", "T10"), ("T11", "T12")):
        assert left[NAMES.index(first)] == pytest.approx(right[NAMES.index(second)], abs=1e-9)


def test_the_average_over_a_taxel_converges_with_the_square_of_the_cell(make_grid, make_state, make_dent):
    readings = {}
    for factor in (1, 2, 8):
        grid = make_grid(SPEC, factor)
        state = make_state(SPEC, grid, make_dent(grid, 0.8, 0.5, 0.7, 1.5))
        readings[factor] = build(SPEC, grid, NAMES)(state) - REST
    default, finer = (np.abs(readings[factor] - readings[8]).max() for factor in (1, 2))
    # Only what varies inside a cell is lost: cell^2/24 times the curvature of 1/(h-u), 0.5 % for a dent of 3.5 cells.
    assert default < 5e-3 * np.abs(readings[8]).max()
    assert finer < default / 3.5  # 4, less the error of the finest grid itself


def test_a_taxel_weight_adds_to_one_wherever_it_falls(make_grid):
    grid = make_grid(SPEC)
    for shift in (0.0, 0.1, 0.21):
        weight = taxel_weight(grid, (1.0 + shift, -2.0 + shift), 1.25)
        assert weight.sum() == pytest.approx(1.0, abs=1e-12)
        centre = (weight.sum(axis=1) @ grid.x_mm, weight.sum(axis=0) @ grid.s_mm)
        # Sub-sampling is symmetric to a sixteenth of a cell.
        assert centre == pytest.approx((1.0 + shift, -2.0 + shift), abs=0.42 / 16)


def test_the_weight_is_flat_over_the_taxel(make_grid):
    grid = make_grid(SPEC, 4)
    density = taxel_weight(grid, (0.0, 0.0), 1.25) / np.prod(grid.cell_mm)
    # The integral of exp(-(r^2/a^2)^4) over the plane is pi a^2 Gamma(5/4); at r = a the weight has fallen to 1/e.
    top = 1.0 / (np.pi * 1.25**2 * math.gamma(1.25))
    assert density.max() == pytest.approx(top, rel=1e-4)
    r = np.hypot(grid.x_mm[:, None], grid.s_mm[None, :])
    rim = np.abs(r - 1.25) < 0.02
    # Within 0.02 mm of the rim the weight changes by 8 * 0.02 / 1.25 of itself.
    assert density[rim] == pytest.approx(top / math.e, rel=0.15)


def test_what_cannot_be_given_is_refused_by_name(make_grid):
    grid = make_grid(SPEC)
    with pytest.raises(RigError, match="T13"):
        build(SPEC, grid, ["T1", "T13"])
    with pytest.raises(RigError, match="foam pad"):
        build(BIOTAC, make_grid(BIOTAC), ["E1"])
    with pytest.raises(RigError, match="outside"):
        taxel_weight(grid, (40.0, 0.0), 1.25)


def test_a_state_of_another_grid_is_refused(make_grid, make_state):
    other = make_grid(SPEC, 2.0)
    with pytest.raises(RigError, match="cells"):
        build(SPEC, make_grid(SPEC), NAMES)(make_state(SPEC, other, np.zeros((88, 96))))


def _uniform(strain):
    from tactbench.plugin.simulation import SkinGrid, SkinState

    grid = SkinGrid(-9.25 + (np.arange(44) + 0.5) * 18.5 / 44, -10.21 + (np.arange(48) + 0.5) * 20.42 / 48)
    field = np.full((44, 48), strain * FOAM_MM)
    return grid, SkinState(grid, 1.0, field, 0 * field, FOAM_MM - field, 0.0, 0.0, 0.0, 0.0)
