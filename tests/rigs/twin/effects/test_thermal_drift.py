from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import ForceRamp, Indenter, Scene, assumed
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin.contact.press import at_rest
from tactbench.rigs.twin.contact.pressing import medium_of
from tactbench.rigs.twin.effects.heat import largest_stretch, through_divider
from tactbench.rigs.twin.effects.heated_core import HeatedCore, relative_conductivity
from tactbench.rigs.twin.geometry import skin_grid
from tactbench.rigs.twin.preparation import prepare
from tactbench.sensors.biotac.transduction import build
from tests.rigs.twin.conftest import TWIN, q, unrounded


@given(st.floats(1, 4094), st.floats(0.2, 5))
def test_the_divider_is_undone_by_the_inverse_factor(reading, gained):
    there = through_divider(np.array([reading]), np.array([gained]), 4095.0)
    back = through_divider(there, np.array([1 / gained]), 4095.0)
    assert back[0] == pytest.approx(reading, rel=1e-9)
    assert np.sign(there[0] - reading) == np.sign(gained - 1.0) or abs(gained - 1) < 1e-9


@given(st.floats(0, 4095), st.floats(0, 4095), st.floats(0.2, 5))
def test_no_difference_grows_by_more_than_the_factor_or_its_inverse(one, other, gained):
    there = through_divider(np.array([one, other]), np.full(2, gained), 4095.0)
    # Rounding of readings of thousands.
    assert abs(there[1] - there[0]) <= max(gained, 1 / gained) * abs(other - one) * (1 + 1e-9) + 1e-9


@pytest.mark.parametrize(("degc", "since"), [(-10.0, 0.0), (57.0, 3600.0), (90.0, 0.0), (90.0, 3600.0)])
def test_the_largest_stretch_bounds_what_the_conductivity_does(sensors, degc, since):
    scene = Scene(
        name="warm",
        indenter=Indenter(radius=q(20.0)),
        environment=Environment(indenter_temperature=q(degc, "degC"), since_power_on=q(since, "s")),
        profile=ForceRamp(duration=q(3000.0, "s"), samples=100),
        simulation=Simulation(effects=("+contact-heat", "+thermal-drift")),
    )
    run = unrounded(sensors["biotac"], scene)
    core = HeatedCore.of(scene, sensors["biotac"].spec)
    alone = core.untouched(scene, run.t_s)
    per_k = sensors["biotac"].spec.parameters["conductivity_coefficient"].to("1/K")
    gained = relative_conductivity(alone + run.tracks[0].warmth_k, per_k) / relative_conductivity(alone, per_k)
    largest = max(gained.max(), 1 / gained.min())
    assert 1.0 < largest <= largest_stretch(run)
    cold = scene.model_copy(update={"environment": Environment()})
    assert largest_stretch(prepare(sensors["biotac"], cold, 1, TWIN.plan(sensors["biotac"], cold))) == 1.0


def test_ends_of_the_range_stay():
    ends = np.array([0.0, 4095.0, -3.0, 5000.0])
    np.testing.assert_array_equal(through_divider(ends, np.full(4, 1.1), 4095.0), ends)


def test_one_divider_per_electrode_is_what_a_warmer_fluid_gives(specs):
    biotac = specs["biotac"]
    sigma = biotac.parameters["conductivity"].to("S/m")

    def warmed(factor):
        changed = {**biotac.parameters, "conductivity": assumed(factor * sigma, "S/m", "test")}
        spec = biotac.model_copy(update={"parameters": changed})
        grid = skin_grid(biotac.skin.sheet)
        names = [channel.name for channel in spec.channels("taxel")]
        return build(spec, grid, names, refinement=1)(at_rest(medium_of(spec.skin, grid)))

    rest, warmer = warmed(1.0), warmed(1.05)
    one_by_one = through_divider(rest, np.full(19, 1.05), 4095.0)
    # Electrodes read one at a time share nothing.
    np.testing.assert_allclose(one_by_one, warmer, rtol=1e-12)
