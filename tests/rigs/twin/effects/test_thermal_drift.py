from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import assumed
from tactbench.rigs.twin.effects.thermal_drift import through_divider


@given(st.floats(1, 4094), st.floats(0.2, 5))
def test_the_divider_is_undone_by_the_inverse_factor(reading, gained):
    there = through_divider(np.array([reading]), np.array([gained]), 4095.0)
    back = through_divider(there, np.array([1 / gained]), 4095.0)
    assert back[0] == pytest.approx(reading, rel=1e-9)
    assert np.sign(there[0] - reading) == np.sign(gained - 1.0) or abs(gained - 1) < 1e-9


def test_ends_of_the_range_stay():
    ends = np.array([0.0, 4095.0, -3.0, 5000.0])
    np.testing.assert_array_equal(through_divider(ends, np.full(4, 1.1), 4095.0), ends)


def test_one_divider_per_electrode_is_nearly_the_whole_network(specs):
    from tactbench.rigs.twin.geometry import skin_grid
    from tactbench.sensors.biotac.transduction import Preparation

    biotac = specs["biotac"]
    sigma = biotac.parameters["conductivity"].to("S/m")

    def at_rest(factor):
        changed = {**biotac.parameters, "conductivity": assumed(factor * sigma, "S/m", "test")}
        spec = biotac.model_copy(update={"parameters": changed})
        return 4095.0 * Preparation(spec, skin_grid(biotac.skin.sheet), 1).rest.electrodes

    rest, warmer = at_rest(1.0), at_rest(1.05)
    one_by_one = through_divider(rest, np.full(19, 1.05), 4095.0)
    # The electrodes share the film's currents, which a divider each does not know: 4 to 5 % of the change.
    np.testing.assert_allclose(one_by_one - rest, warmer - rest, rtol=0.08)
