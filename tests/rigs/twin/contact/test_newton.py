"""Laws of the contact solver, then its reference values."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import Quantity, RigError, assumed
from tactbench.rigs.twin.contact import newton, shell
from tactbench.rigs.twin.contact.newton import NewtonSolver
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid

FLAT = math.inf
PLACES = {"biotac": -5.0, "icub": 0.0}


def _energy(press, vector, force_n):
    """Return energy over cell area [N mm / mm²] and its gradient."""
    return press._evaluate(vector, force_n / press.medium.spectrum.area_mm2)


def _hessian_product(press, vector, direction, force_n):
    _energy(press, vector, force_n)
    press._coupling = float(press._contact.sum())
    return press._multiply(direction, press._tangent + press._contact).copy()


def _scaled(quantity: Quantity, factor: float) -> Quantity:
    return quantity.model_copy(update={"value": quantity.value * factor})


@pytest.mark.parametrize("name", ["biotac", "icub"])
@pytest.mark.parametrize("radius", [5.0, 40.0, FLAT])
def test_pressure_balances_the_force_and_the_fluid_keeps_its_volume(solver, name, radius):
    press = solver(name, radius, PLACES[name], 0.13)
    cell = press.medium.spectrum.area_mm2
    vector = None
    for force in (1e-9, 0.02, 0.7, 5.0):
        found = press.solve(force, vector)
        vector = found.vector
        # The solver's own tolerance, checked from outside it.
        assert found.pressure_mpa.sum() * cell == pytest.approx(force, rel=1e-6)
        assert found.residual < 1e-6
        assert np.all(found.pressure_mpa >= 0)
        if press.medium.zero_mean:
            # Rounding of a sum over 3072 cells of up to 1 mm.
            assert abs(found.deflection_mm.mean()) < 1e-14


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
    outer = skin.sheet.outer_radius.to("mm")
    press = NewtonSolver(made, gap_mm(made.grid, Contact(radius, PLACES[name], 0.0), outer))
    vector = None
    for i, (force, depth) in enumerate(zip((0.1, 0.5, 1.0, 2.0, 5.0), depths, strict=True)):
        found = press.solve(force, vector)
        vector = found.vector
        # Half a unit of the last printed decimal, and 1e-5 for both solvers' own tolerance.
        assert found.depth_mm == pytest.approx(depth, abs=0.5e-3 + 1e-5)
        if name == "biotac":
            local, _ = press.medium.respond(found.deflection_mm, np.empty(press.gap_mm.shape))
            fluid = 1e3 * float(np.mean(found.pressure_mpa - local))
            assert fluid == pytest.approx(PRESSURES[radius][i], abs=0.5e-2 + 1e-4)


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_the_gradient_is_the_energys(solver, name):
    press = solver(name, 10.0, PLACES[name])
    state = press.solve(3.0).vector * 0.9
    rng = np.random.default_rng(0)
    for _ in range(3):
        direction = np.zeros_like(state)
        field = rng.standard_normal(press.gap_mm.shape) * 1e-2
        direction[:-1] = press.medium.spectrum.of(field - field.mean())
        direction[-1] = rng.standard_normal() * 1e-2
        _, gradient = _energy(press, state, 3.0)
        step = 1e-4
        up, _ = _energy(press, state + step * direction, 3.0)
        down, _ = _energy(press, state - step * direction, 3.0)
        # Central differences: error of order step², and rounding of the energy (about 1e2) over the step.
        assert (up - down) / (2 * step) == pytest.approx(gradient @ direction, rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_the_hessian_is_the_gradients_and_symmetric_and_positive(solver, name):
    press = solver(name, 10.0, PLACES[name])
    state = press.solve(3.0).vector
    # Pressed further: where the penetration has been taken back, every cell is at the edge of contact.
    state[-1] += 0.05
    rng = np.random.default_rng(1)
    directions = []
    for _ in range(2):
        direction = np.zeros_like(state)
        # Smooth fields: a few cells change sides under them, but none in a step of 1e-7.
        field = (
            rng.standard_normal()
            * np.cos(press.medium.grid.x_mm[:, None] * 0.7)
            * np.sin(press.medium.grid.s_mm[None, :] * 0.5 + rng.standard_normal())
        )
        direction[:-1] = press.medium.spectrum.of(field - field.mean())
        direction[-1] = rng.standard_normal()
        directions.append(direction)
    products = [_hessian_product(press, state, direction, 3.0) for direction in directions]
    for direction, product in zip(directions, products, strict=True):
        step = 1e-7
        _, up = _energy(press, state + step * direction, 3.0)
        _, down = _energy(press, state - step * direction, 3.0)
        difference = (up - down) / (2 * step)
        # Rounding of the gradient (1e-16 x 1e3) over 1e-7.
        np.testing.assert_allclose(product, difference, atol=2e-6 * np.abs(product).max())
        assert direction @ product > 0
    a = directions[0] @ products[1]
    assert a == pytest.approx(directions[1] @ products[0], rel=1e-10)


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_a_huge_cap_presses_like_a_flat(solver, name):
    flat = solver(name, FLAT, PLACES[name]).solve(5.0)
    huge = solver(name, 1e9, PLACES[name]).solve(5.0)
    # The gaps differ by at most 2e-7 mm; the solutions by as much and the solver's tolerance.
    assert huge.depth_mm == pytest.approx(flat.depth_mm, abs=2e-6)
    np.testing.assert_allclose(huge.deflection_mm, flat.deflection_mm, atol=5e-6)


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_a_contact_on_the_midline_is_mirror_symmetric(solver, name):
    found = solver(name, 7.5, PLACES[name]).solve(2.0)
    # The grid is symmetric; what remains is the solver's tolerance.
    np.testing.assert_allclose(found.deflection_mm, found.deflection_mm[:, ::-1], atol=5e-6)


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_force_scales_with_the_moduli(solver, specs, name):
    skin = specs[name].skin
    moduli = {
        "biotac": ("young", "tension", "contact_stiffness", "core_stiffness", "clamp_stiffness"),
        "icub": ("young", "shear", "cover_tension", "cover_bending", "contact_stiffness"),
    }[name]
    stiffer = skin.model_copy(update={modulus: _scaled(getattr(skin, modulus), 3.0) for modulus in moduli})
    soft = solver(name, 10.0, PLACES[name]).solve(1.5)
    stiff = solver(name, 10.0, PLACES[name], skin=stiffer).solve(4.5)
    # Equal up to the solver's tolerance on each.
    assert stiff.depth_mm == pytest.approx(soft.depth_mm, rel=1e-5)
    np.testing.assert_allclose(stiff.deflection_mm, soft.deflection_mm, atol=1e-5)


@pytest.mark.parametrize(("x", "s"), [(-5.0, 0.0), (6.0, 1.3), (9.0, 0.0)])
def test_a_finger_with_a_dome_is_half_of_a_sheet_that_is_sealed_at_both_ends(solver, specs, x, s):
    # Its other half is pressed alike. No seal is near the tip, nor comes near it round a period.
    half, skin = solver("biotac", 10.0, x, s, core=False), specs["biotac"].skin
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


@pytest.mark.parametrize("x", [6.0, 9.0])
def test_the_tip_does_not_feel_the_seal(solver, medium, specs, x):
    plain, free = medium("biotac", core=False), solver("biotac", 10.0, x, core=False)

    def sealed(deflection, tangent):
        pressure, energy = plain.respond(deflection, tangent)
        tangent[0] += 300.0
        pressure[0] += 300.0 * deflection[0]
        return pressure, energy + 150.0 * float((deflection[0] ** 2).sum())

    held = NewtonSolver(dataclasses.replace(plain, respond=sealed), free.gap_mm)
    found, other = free.solve(1.0).deflection_mm, held.solve(1.0).deflection_mm
    # The rearmost row a hundred times as stiff: 4e-5 of the dent were found. Round a period it was 1 to 60 %.
    tip = plain.grid.x_mm > 5.0
    assert np.abs(found - other)[tip].max() < 1e-4 * found.max()


def test_the_tip_gives_way_as_the_pad_does(solver):
    # With a clamp at the tip a newton raises the fluid's pressure there by a seventh of what it does under the pad.
    pad, tip = (_fluid_mpa(solver("biotac", 10.0, x), 1.0) for x in (-5.0, 6.0))
    assert 0.5 * pad < tip < 2 * pad


def _fluid_mpa(press, force):
    found = press.solve(force)
    local, _ = press.medium.respond(found.deflection_mm, np.empty(press.gap_mm.shape))
    return float(np.mean(found.pressure_mpa - local))


@settings(max_examples=12, deadline=None)
@given(st.floats(1e-3, 20), st.floats(1.05, 3))
@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_more_force_is_more_depth(solver, name, force, factor):
    press = solver(name, 10.0, PLACES[name], 0.2)
    low, high = press.solve(force), press.solve(force * factor)
    assert high.depth_mm > low.depth_mm


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_absurd_loads_stay_finite_and_monotone(solver, name):
    press = solver(name, 10.0, PLACES[name])
    depths, deepest = [], []
    for force in (5.0, 50.0, 500.0):
        found = press.solve(force)
        assert np.all(np.isfinite(found.deflection_mm))
        depths.append(found.depth_mm)
        deepest.append(found.deflection_mm.max())
    assert depths == sorted(depths)
    assert deepest == sorted(deepest)


def test_warm_and_cold_starts_meet(solver):
    press = solver("biotac", 5.0, -5.0)
    warm = press.solve(3.0, press.solve(2.0).vector)
    cold = press.solve(3.0)
    # Both within the tolerance of the one minimiser.
    np.testing.assert_allclose(warm.deflection_mm, cold.deflection_mm, atol=1e-5)


@pytest.mark.parametrize("force", [0.0, -1.0, math.nan, math.inf])
def test_what_is_no_load_is_refused(solver, force):
    with pytest.raises(RigError, match="finite force above zero"):
        solver("icub", 5.0, 0.0).solve(force)


def test_what_did_not_converge_is_an_error_and_not_a_result(solver, monkeypatch):
    monkeypatch.setattr(newton, "MAX_STEPS", 2)
    with pytest.raises(RigError, match="residual"):
        solver("biotac", 5.0, -5.0).solve(1.0)


@pytest.mark.parametrize(("name", "radius"), [("biotac", 5.0), ("icub", FLAT)])
def test_a_tolerance_below_rounding_gives_what_rounding_leaves_and_says_so(solver, name, radius):
    best = solver(name, radius, PLACES[name]).solve(1.0, tolerance=1e-17)
    # Above what was asked for, and far below what is handed out by default.
    assert 1e-17 < best.residual < 1e-9
    usual = solver(name, radius, PLACES[name]).solve(1.0)
    # The residual is relative to the load: the energy's curvature makes of 1e-6 of it less than 1e-5 mm.
    np.testing.assert_allclose(best.deflection_mm, usual.deflection_mm, atol=1e-5)


@given(
    st.sampled_from(["biotac", "icub"]),
    st.sampled_from([1.0, 3.0, 10.0, 100.0, 1e9, FLAT]),
    st.floats(-3, 3),
    st.floats(-14, 2),
)
@settings(max_examples=25)
def test_force_balances_to_rounding_from_a_cold_start_at_any_load(solver, name, radius, offset, exponent):
    press = solver(name, radius, PLACES[name] + offset)
    press.gap_mm -= press.gap_mm.min()
    found = press.solve(10**exponent)
    # Rounding of a sum over 3072 cells; the solver's own tolerance is 1e-6.
    assert found.pressure_mpa.sum() * press.medium.spectrum.area_mm2 == pytest.approx(10**exponent, rel=1e-8)
    assert found.residual < 1e-6


def test_a_shell_of_impossible_poisson_ratio_is_refused(medium, specs):
    skin = specs["biotac"].skin
    for ratio in (1.0, 0.51, -0.1, math.nan):
        with pytest.raises(RigError, match=r"(?i)poisson"):
            medium("biotac", skin=skin.model_copy(update={"poisson": skin.poisson.model_copy(update={"value": ratio})}))


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_a_load_far_below_its_neighbours_is_solved_all_the_same(medium, specs, name):
    # The states of a millinewton tell nothing about 20 femtonewtons.
    made = medium(name)
    outer = specs[name].skin.sheet.outer_radius.to("mm")
    contact = Contact(5.0, 0.03, 0.02)
    press = Press(made, gap_mm(made.grid, contact, outer), contact)
    cell = float(np.prod(made.grid.cell_mm))
    for force in (1e-3, 2e-14):
        # Rounding of the balance, as for every load.
        assert float(press(force).pressure_mpa.sum()) * cell == pytest.approx(force, rel=1e-8)
