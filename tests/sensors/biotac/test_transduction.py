"""The BioTac's counts: laws first, then agreement with its own spec."""

import numpy as np
import pytest

from tactbench.plugin import RigError
from tactbench.sensors.biotac import SPEC
from tactbench.sensors.biotac.channels import ELECTRODES, NAMES
from tactbench.sensors.biotac.transduction import Electrodes, build
from tests.sensors.skin_states import dent, grid_of, state_of

REST = np.array([channel.rest.value for channel in SPEC.channels("taxel")])
GRID = grid_of(SPEC)


def reading(state, channels=NAMES):
    return build(SPEC, GRID, channels)(state)


def test_the_stated_rest_levels_are_the_models_own():
    # Stated with one decimal.
    assert reading(state_of(SPEC, GRID)) == pytest.approx(REST, abs=0.06)


@pytest.mark.parametrize("number", [2, 5, 12, 18])
def test_an_electrode_falls_where_the_film_thins_and_rises_where_it_thickens(number):
    electrode = ELECTRODES[number - 1]
    s = 7.8 * np.arctan2(electrode.y_mm, -electrode.z_mm)  # on the cylinder's outer surface
    for depth in (0.1, 0.9):
        hollow = dent(GRID, depth, electrode.x_mm, s, 1.5, keep_volume=False)
        falls, rises = (reading(state_of(SPEC, GRID, side * hollow), [f"E{number}"])[0] for side in (1, -1))
        assert falls < REST[number - 1] - 0.06 < REST[number - 1] + 0.06 < rises


def test_the_conduction_grid_converges():
    pressed = state_of(SPEC, GRID, dent(GRID, 1.1, -5.0, 1.0, 2.5))
    change = {}
    for refinement in (1, 2, 4):
        made = Electrodes(SPEC, GRID, refinement)
        change[refinement] = 4095 * np.subtract(*(made.shares(state) for state in (pressed, state_of(SPEC, GRID))))
    scale = np.sqrt(np.mean(change[4] ** 2))
    coarse, default = (np.sqrt(np.mean((change[r] - change[4]) ** 2)) / scale for r in (1, 2))
    # The default grid keeps 1.5 % of the signal, and halving the cell at least halves the error (order 1 or better).
    assert default < 0.015
    assert default < 0.5 * coarse


def test_wanted_channels_come_in_the_order_asked_for():
    state = state_of(SPEC, GRID, dent(GRID, 0.5, -5.0, 0.0), fluid_pressure_mpa=3.65e-3)
    every = reading(state)
    # 3650 Pa at 36.5 Pa per count are 100 counts above the rest of 2500.
    assert reading(state, ["PDC", "E18", "E3"]) == pytest.approx([2600.0, every[17], every[2]], abs=1e-9)


def test_pressure_alone_solves_no_film():
    # A film that no requested channel reads is not solved: this one would be refused.
    state = state_of(SPEC, GRID, np.full((64, 64), np.nan))
    assert reading(state, ["PDC"]) == pytest.approx([2500.0])
    with pytest.raises(RigError, match="thickness"):
        reading(state, ["E1"])


def test_what_this_rung_cannot_give_is_named():
    for name in ("TDC", "E20"):
        with pytest.raises(RigError, match=name):
            build(SPEC, GRID, ["E1", name])
