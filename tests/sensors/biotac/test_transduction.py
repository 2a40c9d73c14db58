"""The BioTac's counts: laws first, then agreement with its own spec."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.plugin import RigError
from tactbench.sensors.biotac.electrodes import ELECTRODES, MIRRORS, NAMES
from tactbench.sensors.biotac.spec import SPEC
from tactbench.sensors.biotac.transduction import build, prepared

REST = np.array([channel.rest.value for channel in SPEC.channels("taxel") if channel.rest is not None])


def with_parameters(**values: float):
    changed = {name: SPEC.parameters[name].model_copy(update={"value": value}) for name, value in values.items()}
    return SPEC.model_copy(update={"parameters": {**SPEC.parameters, **changed}})


def place_of(number: int) -> tuple[float, float]:
    """Axial place and arc on the outer surface, for electrodes on the cylinder."""
    electrode = ELECTRODES[number - 1]
    return electrode.x_mm, 7.8 * float(np.arctan2(electrode.y_mm, -electrode.z_mm))


@pytest.fixture
def grid(make_grid):
    return make_grid(SPEC)


def test_the_stated_rest_levels_are_the_models_own(grid, make_state):
    reading = build(SPEC, grid, NAMES)(make_state(SPEC, grid, np.zeros((64, 64))))
    # Stated with one decimal.
    assert reading == pytest.approx(REST, abs=0.06)


def test_the_rest_levels_have_the_measured_median():
    # Public recordings: R/R_ref 0.18-0.37 with median 0.26; median 3237 counts. The conductivity is set by it.
    assert np.median(REST) == pytest.approx(3237.0, abs=5.0)


def test_the_rest_levels_scatter_by_more_than_measured_but_not_by_much():
    # Public recordings: 0.23 in log R, from which nothing is set; the film's thin flanks give 0.295, a miss.
    assert np.log(4095.0 / REST - 1.0).std() == pytest.approx(0.295, abs=0.005)


def test_the_rest_levels_have_the_order_of_an_independent_solution():
    # Linear finite elements on the curved film, 64,000 nodes, electrodes read one at a time; low to high. Mirror images
    # are equal, so that either order of a pair will do.
    order = [1, 11, 16, 6, 14, 4, 7, 9, 8, 10, 15, 5, 17, 2, 12, 19, 13, 3, 18]
    sorted_levels = REST[np.array(order) - 1]
    assert np.all(np.diff(sorted_levels) >= -0.11)


def test_mirrored_electrodes_agree_for_a_mirrored_state(grid, make_state, make_dent):
    reading = dict(
        zip(NAMES, build(SPEC, grid, NAMES)(make_state(SPEC, grid, make_dent(grid, 0.9, -5.0, 0.0))), strict=True)
    )
    for left, right in MIRRORS:
        # Equal up to rounding.
        assert reading[left] == pytest.approx(reading[right], abs=1e-6)


@pytest.mark.parametrize("number", [2, 3, 5, 12, 15, 17, 18, 19])
def test_an_electrode_falls_where_the_film_thins_and_rises_where_it_thickens(grid, make_state, make_dent, number):
    x, s = place_of(number)
    transducer = build(SPEC, grid, [f"E{number}"])
    rest = transducer(make_state(SPEC, grid, np.zeros((64, 64))))[0]
    for depth in (0.1, 0.4, 0.9):
        hollow = make_dent(grid, depth, x, s, 1.5, keep_volume=False)
        assert transducer(make_state(SPEC, grid, hollow))[0] < rest
        assert transducer(make_state(SPEC, grid, -hollow))[0] > rest


@pytest.mark.parametrize("number", [4, 6, 14, 16])
def test_side_electrodes_rise_when_the_pad_is_pressed(grid, make_state, make_dent, number):
    # As on real recordings, where these four practically never fall.
    reading = build(SPEC, grid, [f"E{number}"])(make_state(SPEC, grid, make_dent(grid, 0.5, -4.0, 0.0, 2.0)))
    assert reading[0] > REST[number - 1]


def test_the_conduction_grid_converges(grid, make_state, make_dent):
    rest = make_state(SPEC, grid, np.zeros((64, 64)))
    pressed = make_state(SPEC, grid, make_dent(grid, 1.1, -5.0, 1.0, 2.5))
    change = {}
    for refinement in (1, 2, 4):
        made = prepared(SPEC, grid, refinement)
        change[refinement] = 4095 * np.subtract(*(made.shares(state) for state in (pressed, rest)))
    scale = np.sqrt(np.mean(change[4] ** 2))
    coarse, default = (np.sqrt(np.mean((change[r] - change[4]) ** 2)) / scale for r in (1, 2))
    # The default grid keeps 1.5 % of the signal, and halving the cell at least halves the error (order 1 or better).
    assert default < 0.015
    assert default < 0.5 * coarse


def test_electrodes_are_read_one_at_a_time(grid, make_state, make_dent):
    # A divider each over its own resistance to the excitations: an electrode left out changes no other.
    state = make_state(SPEC, grid, make_dent(grid, 0.6, -5.0, 0.5))
    found = prepared(SPEC, grid)
    resistances = np.diag(found.sheet.resistances(found.film_under(state)))
    ohm = 1e3 * resistances / SPEC.parameters["conductivity"].to("S/m")
    reading = build(SPEC, grid, NAMES)(state)
    # The maker's formula, turned round.
    np.testing.assert_allclose((4095.0 / reading - 1.0) * 10e3, ohm, rtol=1e-12)


def test_wanted_channels_come_in_the_order_asked_for(grid, make_state, make_dent):
    state = make_state(SPEC, grid, make_dent(grid, 0.5, -5.0, 0.0), fluid_pressure_mpa=3.65e-3)
    every = build(SPEC, grid, NAMES)(state)
    some = build(SPEC, grid, ["PDC", "E18", "E3"])(state)
    # 3650 Pa at 36.5 Pa per count are 100 counts above the rest of 2500.
    assert some == pytest.approx([2600.0, every[17], every[2]], abs=1e-9)


def test_pressure_alone_solves_no_film(grid, make_state):
    # A film nobody looks at is not solved: this one would be refused.
    state = make_state(SPEC, grid, np.zeros((64, 64)), thickness_mm=np.full((64, 64), np.nan))
    assert build(SPEC, grid, ["PDC"])(state) == pytest.approx([2500.0])
    with pytest.raises(RigError, match="not this sensor's film"):
        build(SPEC, grid, ["E1"])(state)


@pytest.mark.parametrize("name", ["TDC", "TAC", "PAC", "E20"])
def test_what_this_rung_cannot_give_is_named(grid, name):
    with pytest.raises(RigError, match=name):
        build(SPEC, grid, ["E1", name])


def test_preparing_twice_costs_once(make_grid):
    assert prepared(SPEC, make_grid(SPEC)) is prepared(SPEC, make_grid(SPEC))
    assert prepared(SPEC, make_grid(SPEC)) is not prepared(with_parameters(conductivity=2.0), make_grid(SPEC))
