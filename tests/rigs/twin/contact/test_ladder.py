"""One interface, several rungs, and the cheapest that keeps a tolerance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import ForceRamp, Indenter, RigError, Scene
from tactbench.rigs.twin.contact.press import LocalPress
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tests.oracles.layers import bonded_layer
from tests.rigs.twin.conftest import SILENT, TWIN, q


def _recorded(sensor, simulation, radius=10.0):
    scene = Scene(
        name="a", indenter=Indenter(radius=q(radius)), profile=ForceRamp(samples=400), environment=SILENT,
        simulation=simulation,
    )  # fmt: skip
    with TWIN.open(sensor, scene, seed=1) as acquisition:
        data = acquisition.samples[acquisition.streams[0].name].data.astype(float)
        return acquisition, data


def local(skin):
    grid, contact = skin_grid(skin.sheet), Contact(10.0, 0.0, 0.0)
    return LocalPress(skin, medium_of(skin, grid), gap_mm(grid, contact, skin.sheet), contact)


def thin(poisson):
    return bonded_layer(poisson, thickness_mm=0.2, penalty=1e6, cells=192)


def test_springs_obey_the_law_of_a_thin_layer():
    # F = pi E_oed R d² / h and a = sqrt(2 R d): Johnson 1985, section 5.8, for a >> h and a compressible layer.
    press, nu = local(thin(0.2)), 0.2
    oedometric = (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    for force in (1.0, 30.0):
        state = press(force)
        depth = math.sqrt(force * 0.2 / (math.pi * oedometric * 10.0))
        # Cells of 0.125 mm on a contact of 1 mm radius: a hundredth; and it shrinks with the contact's growth.
        assert state.depth_mm == pytest.approx(depth, rel=2e-2)
        # Pressure falls as 1 - r²/a²: <r²> = a²/3, and the reported radius is sqrt(5/2 <r²>).
        assert state.contact_radius_mm == pytest.approx(math.sqrt(2.5 / 3 * 20.0 * depth), rel=2e-2)


def test_springs_refuse_what_they_are_wrong_for(specs):
    with pytest.raises(RigError, match="fluid") as refused:
        local(specs["biotac"].skin)
    assert "default" in refused.value.hint
    with pytest.raises(RigError, match=r"0\.45"):
        local(thin(0.45))
    local(thin(0.4))


def test_a_tolerance_takes_the_cheapest_rung_that_keeps_it(sensors):
    for tolerance, cheapest in ((40.0, "closed-form"), (1.0, "default"), (0.1, "fine")):
        acquisition, _ = _recorded(sensors["icub"], Simulation(tolerance=tolerance))
        assert acquisition.drawn["error_estimate_count"] <= tolerance
        assert acquisition.assumptions["tolerance_count"] == tolerance
        assert acquisition.drawn["rung"] == cheapest


def test_the_estimate_covers_the_true_error(sensors):
    # Against the finest rung, which a tolerance of 1 count does not take.
    acquisition, said = _recorded(sensors["icub"], Simulation(tolerance=1.0), radius=5.0)
    _, finest = _recorded(sensors["icub"], Simulation(rung="reference"), radius=5.0)
    # Both are rounded to whole counts.
    assert np.abs(said - finest).max() <= acquisition.drawn["error_estimate_count"] + 1.0


def test_a_tolerance_nobody_can_keep_is_refused_with_the_best_there_is(sensors):
    with pytest.raises(RigError, match="1e-09") as refused:
        _recorded(sensors["icub"], Simulation(tolerance=1e-9))
    assert "larger tolerance" in refused.value.hint
