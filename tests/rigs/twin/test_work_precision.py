"""The work-precision diagram of every sensor there is: what one cannot have is a row with its reason."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from tactbench.core.cost.knobs import Skipped, measured
from tactbench.core.progress import Progress
from tactbench.core.spec.scene import Simulation
from tactbench.plugin import Indenter, Placement, Scene, SensorDescriptor
from tactbench.rigs.twin import work_precision
from tactbench.rigs.twin.contact.stages import skin_under_load
from tactbench.rigs.twin.planner import prepare
from tactbench.rigs.twin.synthesis import RUNGS
from tests.conftest import THIRD_PARTY
from tests.rigs.twin.conftest import TWIN, q


@pytest.fixture
def bonded(monkeypatch) -> SensorDescriptor:
    """A third party's pad: E 0.5 MPa, nu 0.45, 4 mm thick, contact stiffness 10 MPa/mm."""
    monkeypatch.syspath_prepend(str(THIRD_PARTY / "good"))
    import acme_tactile

    yield acme_tactile.tactbench_sensors()[0]
    for name in [name for name in sys.modules if name.partition(".")[0] == "acme_tactile"]:
        del sys.modules[name]


@pytest.fixture
def _little(monkeypatch):
    """The same diagram with one contact, two loads and few ways: its rows are judged here, not its numbers."""
    monkeypatch.setattr(work_precision, "RADII_MM", (10.0,))
    monkeypatch.setattr(work_precision, "LOADS", 2)
    monkeypatch.setattr(work_precision, "_REFERENCE", RUNGS["default"])


@pytest.mark.usefixtures("_little")
@pytest.mark.parametrize(("name", "has_it"), [("biotac", False), ("icub", True)])
def test_it_runs_for_a_skin_and_says_what_it_cannot_have(sensors, name, has_it):
    found = list(measured(work_precision.study(sensors[name], rounds=1), name, Progress()))
    skipped = [one for one in found if isinstance(one, Skipped)]
    points = [one for one in found if one not in skipped]
    assert "default" in {point.label for point in points}
    assert all(one.label == "closed-form" and one.reason for one in skipped)
    assert ("closed-form" in {one.label for one in skipped}) is not has_it
    assert ("closed-form" in {point.label for point in points}) is has_it


@pytest.mark.parametrize("radius", [None, 2.0])
def test_a_third_partys_thick_soft_pad_is_solved_without_a_warning_as_the_reference_rung_does(bonded, radius):
    # Warnings are errors here. Flat, a guess from neighbouring loads leaves the contact altogether.
    tables = [_table(bonded, radius, rung) for rung in ("default", "reference")]
    assert all(table.residual < 2e-6 for table in tables)
    own, reference = (table(np.linspace(0.0, 5.0, 23)) for table in tables)
    # The pad's declared contact stiffness is part of the default rung only: 1 % of the signal is what it gives way.
    # Flat, it is not even that but, of 25 counts, the tolerance of the solver.
    share = 0.0 if radius is None else 0.01
    assert np.abs(own - reference).max() < share * np.ptp(reference) + 1e-3


def _table(sensor, radius, rung):
    scene = Scene(
        name="pressed",
        indenter=Indenter(radius=None if radius is None else q(radius)),
        placement=Placement(x=q(0.1), scatter=q(0.0)),
        simulation=Simulation(rung=rung),
    )
    return skin_under_load(prepare(sensor, scene, 1, TWIN.plan(sensor, scene)))
