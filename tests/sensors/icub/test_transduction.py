"""The iCub's capacitance: uniform compression, direction, averages."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.sensors.biotac import SPEC as BIOTAC
from tactbench.sensors.icub import SPEC
from tactbench.sensors.icub.transduction import build, taxel_weight
from tests.sensors.skin_states import dent, grid_of, state_of

CHANNELS = SPEC.channels("taxel")
NAMES = [channel.name for channel in CHANNELS]
REST = np.array([channel.rest.value for channel in CHANNELS])
GRID = grid_of(SPEC)
FOAM_MM = 2.0


def uniform(strain):
    return state_of(SPEC, GRID, np.full((GRID.x_mm.size, GRID.s_mm.size), strain * FOAM_MM))


TRANSDUCER = build(SPEC, GRID, NAMES)


@given(strain=st.floats(0.0, 1.3))
def test_uniform_compression_gives_the_plate_capacitor_whose_plates_never_meet(strain):
    apart = max(1.0 - strain, 0.05)
    assert TRANSDUCER(uniform(strain)) == pytest.approx(REST - 60.0 * (1.0 / apart - 1.0), rel=1e-9)


def test_pressing_on_a_taxel_lowers_it_most():
    transducer = build(SPEC, GRID, NAMES)
    for row, channel in enumerate(CHANNELS):
        x, y, z = (1e3 * c for c in channel.position_m)
        hollow = dent(GRID, 0.8, x, 6.5 * np.arctan2(y, -z), 1.0, keep_volume=False)
        change = transducer(state_of(SPEC, GRID, hollow)) - REST
        assert np.argmin(change) == row
        assert (change <= 1e-9).all()


def test_the_average_over_a_taxel_converges_with_the_square_of_the_cell():
    readings = {}
    for factor in (1, 2, 8):
        grid = grid_of(SPEC, factor)
        readings[factor] = build(SPEC, grid, NAMES)(state_of(SPEC, grid, dent(grid, 0.8, 0.5, 0.7, 1.5))) - REST
    default, finer = (np.abs(readings[factor] - readings[8]).max() for factor in (1, 2))
    # Only what varies inside a cell is lost: cell^2/24 times the curvature of 1/(h-u), 0.5 % for a dent of 3.5 cells.
    assert default < 5e-3 * np.abs(readings[8]).max()
    assert finer < default / 3.5  # 4, less the error of the finest grid itself


def test_the_weight_is_flat_over_the_taxel():
    grid = grid_of(SPEC, 4)
    density = taxel_weight(grid, (0.0, 0.0), 1.25) / np.prod(grid.cell_mm)
    # The integral of exp(-(r^2/a^2)^4) over the plane is pi a^2 Gamma(5/4); at r = a the weight has fallen to 1/e.
    top = 1.0 / (np.pi * 1.25**2 * math.gamma(1.25))
    assert density.max() == pytest.approx(top, rel=1e-4)
    r = np.hypot(grid.x_mm[:, None], grid.s_mm[None, :])
    # Within 0.02 mm of the rim the weight changes by 8 * 0.02 / 1.25 of itself.
    assert density[np.abs(r - 1.25) < 0.02] == pytest.approx(top / math.e, rel=0.15)


def test_what_cannot_be_given_is_refused_by_name():
    with pytest.raises(RigError, match="T13"):
        build(SPEC, GRID, ["T1", "T13"])
    with pytest.raises(RigError, match="foam pad"):
        build(BIOTAC, grid_of(BIOTAC), ["E1"])
    with pytest.raises(RigError, match="outside"):
        taxel_weight(GRID, (40.0, 0.0), 1.25)
