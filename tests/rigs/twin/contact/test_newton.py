"""The contact solver on the sensors' own skins; its laws at hard contacts are among the hard cases."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tactbench.plugin import RigError, assumed
from tactbench.rigs.twin.contact import newton, shell
from tactbench.rigs.twin.contact.newton import NewtonSolver
from tactbench.rigs.twin.contact.shell import with_core
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tests.rigs.twin.conftest import SPECS

FLAT = math.inf
PLACES = {"biotac": -5.0, "icub": 0.0}


def medium(name, *, core=True):
    skin = SPECS[name].skin
    made = medium_of(skin, skin_grid(skin.sheet))
    return with_core(made, skin) if made.has_core and core else made


def solver(name, radius, x, s=0.0, *, core=True):
    made, sheet = medium(name, core=core), SPECS[name].skin.sheet
    gap = gap_mm(made.grid, Contact(radius, x, s), sheet)
    return NewtonSolver(made, gap)


# delta [mm] at 0.1, 0.5, 1, 2, 5 N: printed with three decimals, so they hold to half a unit of the last.
ANCHORS = {
    ("biotac", 5.0): (0.216, 0.796, 1.348, 1.515, 1.777),
    ("biotac", 40.0): (0.157, 0.487, 0.729, 1.008, 1.322),
    ("biotac", FLAT): (0.027, 0.112, 0.202, 0.357, 0.694),
    ("icub", 5.0): (0.245, 0.614, 0.850, 1.117, 1.468),
    ("icub", 40.0): (0.139, 0.342, 0.484, 0.668, 0.975),
    ("icub", FLAT): (0.047, 0.185, 0.303, 0.471, 0.770),
}
# p_f [kPa], two decimals.
PRESSURES = {
    5.0: (0.54, 2.68, 5.18, 6.10, 7.72),
    40.0: (0.53, 2.46, 4.49, 7.75, 13.75),
    FLAT: (0.21, 0.96, 1.84, 3.47, 8.28),
}


@pytest.mark.parametrize(("case", "depths"), ANCHORS.items())
def test_reference_values(prototype, case, depths):
    name, radius = case
    made, skin = prototype(name)
    press = NewtonSolver(made, gap_mm(made.grid, Contact(radius, PLACES[name], 0.0), skin.sheet))
    vector = None
    for i, (force, depth) in enumerate(zip((0.1, 0.5, 1.0, 2.0, 5.0), depths, strict=True)):
        found = press.solve(force, vector)
        vector = found.vector
        # Half a unit of the last printed decimal, and 1e-5 for both solvers' own tolerance.
        assert found.depth_mm == pytest.approx(depth, abs=0.5e-3 + 1e-5)
        if name == "biotac":
            local, _ = press.medium.respond(found.deflection_mm, np.empty(press.gap_mm.shape))
            assert 1e3 * float(np.mean(found.pressure_mpa - local)) == pytest.approx(
                PRESSURES[radius][i], abs=0.5e-2 + 1e-4
            )


@pytest.mark.parametrize(("x", "s"), [(-5.0, 0.0), (6.0, 1.3), (9.0, 0.0)])
def test_a_finger_with_a_dome_is_half_of_a_sheet_that_is_sealed_at_both_ends(x, s):
    # Its other half is pressed alike. No seal is near the tip, nor comes near it round a period.
    half, skin = solver("biotac", 10.0, x, s, core=False), SPECS["biotac"].skin
    sheet, mid = skin.sheet, skin.sheet.x_max.to("mm")
    both = sheet.model_copy(update={
        "x_max": assumed(2 * mid - sheet.x_min.to("mm"), "mm", "test"), "dome": None, "cells": (128, 64),
    })  # fmt: skip
    made = shell.medium(skin.model_copy(update={"sheet": both}), skin_grid(both))
    whole = NewtonSolver(made, np.concatenate([half.gap_mm, half.gap_mm[::-1]]))
    for force in (0.1, 2.0):
        found, both_found = half.solve(force), whole.solve(2 * force)
        # Both within the tolerance of the one minimiser.
        np.testing.assert_allclose(found.deflection_mm, both_found.deflection_mm[:64], atol=5e-6)
        assert found.depth_mm == pytest.approx(both_found.depth_mm, abs=5e-6)


def test_what_did_not_converge_is_an_error_and_not_a_result(monkeypatch):
    monkeypatch.setattr(newton, "MAX_STEPS", 2)
    with pytest.raises(RigError, match="residual"):
        solver("biotac", 5.0, -5.0).solve(1.0)


@pytest.mark.parametrize(("name", "radius"), [("biotac", 5.0), ("icub", FLAT)])
def test_a_tolerance_below_rounding_gives_what_rounding_leaves_and_says_so(name, radius):
    best = solver(name, radius, PLACES[name]).solve(1.0, tolerance=1e-17)
    # Above what was asked for, and far below what is handed out by default.
    assert 1e-17 < best.residual < 1e-9
    usual = solver(name, radius, PLACES[name]).solve(1.0)
    # The residual is relative to the load: the energy's curvature makes of 1e-6 of it less than 1e-5 mm.
    np.testing.assert_allclose(best.deflection_mm, usual.deflection_mm, atol=1e-5)
