"""The default grids against finer ones: skin, conduction and load table together."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from tactbench.plugin import load_object
from tactbench.rigs.twin.contact.load_table import build_table
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.shell import with_core
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tactbench.rigs.twin.synthesis import DEFAULT
from tactbench.sensors.biotac import SPEC as BIOTAC
from tactbench.sensors.icub import SPEC as ICUB

LOADS = np.array([0.25, 0.8, 1.6, 3.0, 5.0])


def _changes(spec, radius, factor=1.0, conduction=2, *, table=False):
    skin = spec.skin
    grid = skin_grid(skin.sheet, dataclasses.replace(DEFAULT, cells_factor=factor).cells(skin.sheet))
    medium = medium_of(skin, grid)
    contact = Contact(radius, spec.parameters["contact_x"].to("mm") + 0.07, 0.11)
    core = (lambda below: with_core(below, skin)) if medium.has_core else None
    press = Press(
        medium,
        gap_mm(grid, contact, skin.sheet),
        contact,
        core=core,
    )
    factory = load_object(f"tactbench.sensors.{spec.name}.transduction:build")
    names = [channel.name for channel in spec.channels("taxel")]
    read = factory(spec, grid, names, **({"refinement": conduction} if spec is BIOTAC else {}))
    if table:
        made = build_table(press, read, largest_n=5.0, tolerance=np.full(len(names), 0.45))
        return made(LOADS) - made.readings[0]
    rest = read(press(0.0))
    return np.stack([read(press(float(load))) - rest for load in LOADS])


def _error(change, reference):
    return float(np.sqrt(np.mean((change - reference) ** 2) / np.mean(reference**2)))


# The promised errors against a converged grid. The reference is itself off by a quarter of the default's error.
@pytest.mark.parametrize(("spec", "promise"), [(BIOTAC, 0.01), (ICUB, 0.003)], ids=["biotac", "icub"])
@pytest.mark.parametrize("radius", [5.0, math.inf])
def test_the_default_is_near_the_converged_grid_and_refining_brings_it_nearer(spec, promise, radius):
    reference = _changes(spec, radius, 2.0)
    grids = [(0.5, 2), (1.0, 2)] if spec is ICUB else [(1.0, 1), (1.0, 2)]
    coarse, default = (_error(_changes(spec, radius, *grid), reference) for grid in grids)
    assert default < promise
    # Twice as fine: at least twice as near.
    assert default < 0.5 * coarse
    assert _error(_changes(spec, radius, table=True), reference) < promise
