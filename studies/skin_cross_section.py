"""The BioTac's skin in cross-section: plane finite elements against the shell, pressed by a flat plate over its fluid.

A ring of 1.6 mm about 5.51 mm, 1.1 mm below the core's axis, its inner face held from an angle on; the fluid's area is
kept and a frictionless plate pressed on (scikit-fem, quadratic, plane strain; active set on the outer face). Beside it
the shell with kx = 0 and what holds it. Printed: the fluid's pressure in counts at two deflections of the midline.

Usage: python studies/skin_cross_section.py
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import skfem as fem
from scipy.optimize import brentq
from scipy.sparse.linalg import splu
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

BELOW, INNER, SKIN, YOUNG, POISSON, SHEET = 1.1, 5.51, 1.6, 0.8, 0.48, 7.8
CONTACT, TENSION, PASCAL_PER_COUNT = 1.299, 0.02, 36.5
DEFLECTIONS = (0.58, 0.98)


def elements(held_deg: float, approach: float) -> tuple[float, float]:
    """Return the midline's deflection [mm] and the fluid's pressure [counts] at an approach of the plate [mm]."""
    mesh = fem.MeshQuad2.from_mesh(
        fem.MeshQuad.init_tensor(np.linspace(0, 1, 5), np.linspace(0, math.radians(150), 101))
    )
    radius, psi = INNER + SKIN * mesh.doflocs[0], mesh.doflocs[1]
    mesh = fem.MeshQuad2(np.array([radius * np.sin(psi), -(BELOW + radius * np.cos(psi))]), mesh.t)
    basis = fem.Basis(mesh, fem.ElementVector(fem.ElementQuad2()), intorder=5)
    matrix = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis)

    def off_axis(x: np.ndarray) -> np.ndarray:
        return np.hypot(x[0], x[1] + BELOW)

    inner = mesh.facets_satisfying(lambda x: np.abs(off_axis(x) - INNER) < 0.02)
    middle = mesh.p[:, mesh.facets[:, inner]].mean(axis=1)
    held = np.degrees(np.arctan2(middle[0], -middle[1])) >= held_deg
    wet = fem.FacetBasis(mesh, basis.elem, facets=inner[~held], intorder=5)
    area = fem.LinearForm(lambda v, w: dot(v, w.n)).assemble(wet)
    symmetric = basis.get_dofs(lambda x: np.abs(x[0]) < 1e-6).all("u^1")
    fixed = np.union1d(basis.get_dofs(inner[held]).flatten(), symmetric)
    free = np.setdiff1d(np.arange(matrix.shape[0]), fixed)
    outer = np.setdiff1d(basis.get_dofs(lambda x: np.abs(off_axis(x) - INNER - SKIN) < 0.02).all("u^2"), fixed)
    outer = outer[basis.doflocs[1, outer] < -(BELOW + INNER + SKIN) + 4]
    needed = -(BELOW + INNER + SKIN) + approach - basis.doflocs[1, outer]
    kept = area[free]
    factor = splu(sp.bmat([[matrix[free][:, free], kept[:, None]], [kept[None, :], None]], format="csc"))
    unit = np.zeros((free.size + 1, outer.size))
    rows = np.searchsorted(free, outer)
    unit[rows, np.arange(outer.size)] = 1.0
    answer = factor.solve(unit)
    compliance, active = answer[rows], needed > 0
    force = np.zeros(outer.size)
    for _ in range(60):
        force[:] = 0.0
        force[active] = np.linalg.solve(compliance[np.ix_(active, active)], needed[active])
        now = np.where(active, force >= 0, compliance @ force < needed - 1e-9)
        if np.array_equal(now, active):
            break
        active = now
    solved = answer @ force
    moved = np.zeros(matrix.shape[0])
    moved[free] = solved[:-1]
    at = np.flatnonzero(np.hypot(basis.doflocs[0], basis.doflocs[1] + BELOW + INNER) < 1e-6)
    below = np.setdiff1d(at, symmetric)
    return float(moved[below[0]]), abs(float(solved[-1])) * 1e6 / PASCAL_PER_COUNT


def shell(hold: Callable[[np.ndarray], np.ndarray], length: float, approach: float) -> tuple[float, float]:
    """Return the same by the shell, periodic over `length` [mm]."""
    n = 128
    s = (np.arange(n) + 0.5) * length / n - length / 2
    k = 2 * np.pi * np.fft.fftfreq(n, length / n)
    bending = YOUNG * SKIN**3 / (12 * (1 - POISSON**2))
    stiffness = np.fft.ifft((bending * k**4 + TENSION * k**2)[:, None] * np.fft.fft(np.eye(n), axis=0), axis=0).real
    angle, outer = s / SHEET, INNER + SKIN
    reach = BELOW * np.cos(angle) + np.sqrt(outer**2 - (BELOW * np.sin(angle)) ** 2)
    gap = BELOW + outer - reach * np.cos(angle)
    touched = approach > gap
    for _ in range(100):
        system = np.ones((n + 1, n + 1))
        system[:n, :n] = stiffness + np.diag(hold(s) + CONTACT * touched)
        system[n, n] = 0.0
        found = np.linalg.solve(system, np.append(CONTACT * touched * (approach - gap), 0.0))
        now = approach - gap - found[:n] > 0
        if np.array_equal(now, touched):
            break
        touched = now
    return float(found[np.abs(s).argmin()]), float(found[n]) * 1e6 / PASCAL_PER_COUNT


def main() -> None:
    """Print the table."""
    half = math.pi * SHEET
    beyond = 2 * SHEET * math.radians(120)
    ways = {
        "elements, held from 95 degrees": lambda d: elements(95.0, d),
        "elements, held from 90 degrees": lambda d: elements(90.0, d),
        "shell, 4.39 MPa/mm from 95 degrees": lambda d: shell(
            lambda s: 4.39 * (abs(s) > SHEET * math.radians(95)), beyond, d
        ),
        "shell, 4.39 MPa/mm from 90 degrees": lambda d: shell(
            lambda s: 4.39 * (abs(s) > SHEET * math.radians(90)), beyond, d
        ),
        "shell, .5 MPa/mm fading over 1 mm": lambda d: shell(lambda s: 0.5 * np.exp(-(half / 2 - abs(s))), half, d),
        "shell, 4.39 MPa/mm fading over 1 mm": lambda d: shell(lambda s: 4.39 * np.exp(-(half / 2 - abs(s))), half, d),
    }
    print("pressure [counts] at a deflection of", " and ".join(f"{w:g} mm" for w in DEFLECTIONS))
    for label, press in ways.items():
        counts = []
        for wanted in DEFLECTIONS:
            approach = brentq(lambda d, press=press, wanted=wanted: press(d)[0] - wanted, 0.1, 3.5, xtol=1e-3)
            counts.append(press(approach)[1])
        print(f"  {label:<38} {counts[0]:5.0f} {counts[1]:5.0f}")


if __name__ == "__main__":
    main()
