from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import assumed
from tactbench.rigs.twin.contact.press import at_rest
from tactbench.rigs.twin.contact.pressing import medium_of
from tactbench.rigs.twin.effects.heat import through_divider
from tactbench.rigs.twin.geometry import skin_grid
from tactbench.sensors.biotac.transduction import build


@given(st.floats(1, 4094), st.floats(0.2, 5))
def test_the_divider_is_undone_by_the_inverse_factor(reading, gained):
    there = through_divider(np.array([reading]), np.array([gained]), 4095.0)
    back = through_divider(there, np.array([1 / gained]), 4095.0)
    assert back[0] == pytest.approx(reading, rel=1e-9)
    assert np.sign(there[0] - reading) == np.sign(gained - 1.0) or abs(gained - 1) < 1e-9


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
