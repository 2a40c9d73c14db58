"""Checks of laws that any linear elastic surface obeys, whatever its numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import Verdict
from tactbench.rigs.twin.boundary_elements.kernels import HalfSpace, Kernel, Layer
from tactbench.rigs.twin.boundary_elements.operator import operator
from tactbench.rigs.twin.verification.pressing import paraboloid_mm, pressed, within

_KERNELS: dict[str, Kernel] = {
    "half-space": HalfSpace(1.3),
    "layer": Layer(1.3, 0.3, 2.0),
    "rubber layer": Layer(1.3, 0.5, 2.0),
}
_CELLS, _SIDE_MM = 48, 24.0
_ROUNDING = "linear elasticity; bound: rounding of the transforms, some hundred units in the last place"


def laws() -> Sequence[Verdict]:
    """Superpose, exchange, shift and mirror random pressures on every kernel."""
    cells, cell = (_CELLS, _CELLS), (_SIDE_MM / _CELLS, _SIDE_MM / _CELLS)
    verdicts = []
    for name, kernel in _KERNELS.items():
        rng = np.random.default_rng(7)
        apply = operator(kernel, cells, cell, cells).displacement
        p, q = rng.random(cells), rng.standard_normal(cells)
        sunk_p, sunk_q = apply(p), apply(q)
        both = apply(2 * p - 3 * q) - (2 * sunk_p - 3 * sunk_q)
        exchanged = float(np.vdot(q, sunk_p) - np.vdot(p, sunk_q))
        inner = np.zeros(cells)
        inner[5:20, 8:20] = rng.random((15, 12))
        small = operator(kernel, cells, cell, (15, 12)).displacement(np.ascontiguousarray(inner[5:20, 8:20]))
        size = float(np.abs(sunk_p).max())
        energy = float(np.vdot(q, sunk_q)) / float(np.vdot(q, q))
        verdicts += [
            within(f"{name}: superposition", float(np.abs(both).max()) / size, 1e-12, source=_ROUNDING),
            within(f"{name}: reciprocity", exchanged / (size * np.abs(q).sum()), 1e-12, source=f"Betti; {_ROUNDING}"),
            within(
                f"{name}: window against whole domain",
                _largest(small - apply(inner)[5:20, 8:20]) / _largest(small),
                1e-12,
                source=_ROUNDING,
            ),
            within(
                f"{name}: mirrored pressure, mirrored sinking",
                _largest(apply(p[::-1]) - sunk_p[::-1]) / size,
                1e-12,
                source=_ROUNDING,
            ),
            Verdict(
                name=f"{name}: energy of random pressures",
                found=energy,
                low=0.0,
                high=math.inf,
                unit="mm/MPa",
                source="the elastic energy of any pressure is positive",
            ),
        ]
    return verdicts


def scaling() -> Sequence[Verdict]:
    """Scale modulus and force together, and everything with length: the depth must follow."""
    gap = paraboloid_mm(_CELLS, _SIDE_MM, 0.3, -0.2)
    source = "dimensions; bound: the solver's tolerance squared, and rounding"
    verdicts = []
    for name, one, stiffer, larger in (
        ("half-space", HalfSpace(1.3), HalfSpace(13.0), HalfSpace(1.3)),
        ("layer", Layer(1.3, 0.3, 2.0), Layer(13.0, 0.3, 2.0), Layer(1.3, 0.3, 6.0)),
        ("rubber layer", Layer(1.3, 0.5, 2.0), Layer(13.0, 0.5, 2.0), Layer(1.3, 0.5, 6.0)),
    ):
        depth = pressed(one, gap, _SIDE_MM, 3.0).depth_mm
        by_modulus = pressed(stiffer, gap, _SIDE_MM, 30.0).depth_mm / depth - 1
        by_length = pressed(larger, 3 * gap, 3 * _SIDE_MM, 27.0).depth_mm / (3 * depth) - 1
        mirrored = pressed(one, gap[::-1], _SIDE_MM, 3.0).depth_mm / depth - 1
        verdicts += [
            within(f"{name}: ten times the modulus and the force", by_modulus, 1e-10, source=source),
            within(f"{name}: three times every length, nine times the force", by_length, 1e-10, source=source),
            within(f"{name}: mirrored indenter", mirrored, 1e-10, source="symmetry; bound: as above"),
        ]
    return verdicts


def _largest(field: FloatArray) -> float:
    return float(np.abs(field).max())
