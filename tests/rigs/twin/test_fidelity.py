from __future__ import annotations

import dataclasses

import numpy as np

from tactbench.plugin import ForceRamp, Indenter, Scene, SensorDescriptor
from tactbench.rigs.twin.planner import carried_out
from tactbench.rigs.twin.synthesis import DEFAULT, FINE, Fidelity
from tests.rigs.twin.conftest import TWIN, q

SCENE = Scene(name="cap", indenter=Indenter(radius=q(10.0)), profile=ForceRamp(samples=50))


def test_the_default_leaves_the_sheets_own_cells(specs):
    assert DEFAULT.cells(specs["biotac"].skin.sheet) == (64, 64)
    assert FINE.cells(specs["biotac"].skin.sheet) == (192, 192)
    # 46 and 50 times 1.3 are 59.8 and 65: the nearest even numbers.
    assert Fidelity(cells_factor=1.3).cells(specs["icub"].skin.sheet) == (60, 64)


GRIDS = []


def plain_factory(sensor, grid, wanted):
    """A third party's transducer that knows nothing of fidelity."""
    GRIDS.append((grid.x_mm.size, grid.s_mm.size))
    return lambda state: np.full(len(wanted), float(state.depth_mm))


def _deepest(sensor: SensorDescriptor, fidelity: Fidelity) -> float:
    return float(carried_out(sensor, SCENE, 3, TWIN.plan(sensor, SCENE), fidelity).drawn["depth_mm"])


def test_a_contact_is_resolved_as_finely_as_asked_and_tables_are_kept_apart(specs):
    sensor = SensorDescriptor(spec=specs["icub"], transducer=f"{__name__}:plain_factory")
    GRIDS.clear()
    coarse = dataclasses.replace(DEFAULT, cells_factor=0.5)
    depths = [_deepest(sensor, fidelity) for fidelity in (DEFAULT, coarse, DEFAULT)]
    assert GRIDS == [(46, 50), (24, 24)]  # the third recording found its table
    assert depths[0] == depths[2]
    # Half as many cells change the depth, but not by more than a cell's sag, 0.84² / (2 R).
    assert 0 < abs(depths[1] - depths[0]) < 0.84**2 / 20
