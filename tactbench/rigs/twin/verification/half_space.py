"""Checks of the reference solver on an elastic half-space."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tactbench.plugin.simulation import Verdict
from tactbench.rigs.twin.boundary_elements.kernels import HalfSpace
from tactbench.rigs.twin.closed_forms.half_space import FlatPunch, Hertz, point_load_mm
from tactbench.rigs.twin.verification.pressing import (
    RADIUS_MM,
    centres_mm,
    order,
    paraboloid_mm,
    pressed,
    rms,
    within,
)

_SIDE_MM, _FORCE_N = 8.0, 1.0
_BODY = HalfSpace(1.0)
_COLLOCATION = "Johnson 1985, section 4.2; bound: the error of point collocation with Love's kernel on this grid"


def hertz() -> Sequence[Verdict]:
    """Hold depth, largest pressure and radius under a paraboloid against Hertz, and how fast the depth converges."""
    law = Hertz(RADIUS_MM, 1.0)
    a = law.contact_radius_mm(_FORCE_N)
    verdicts = []
    for cells, depth, peak, radius in (
        (64, 1.6e-4, 8.3e-4, 3.4e-4),
        (128, 4e-5, 2.1e-4, 1.1e-4),
        (256, 1.2e-5, 5e-5, 2.4e-5),
    ):
        found = pressed(_BODY, paraboloid_mm(cells, _SIDE_MM), _SIDE_MM, _FORCE_N)
        # The four cells in the middle: their mean of Hertz's pressure, by its series to fourth order.
        h2 = (_SIDE_MM / cells / a) ** 2
        mean = 1 - h2 / 3 - 7 * h2**2 / 90
        top = law.largest_pressure_mpa(_FORCE_N) * mean
        verdicts += [
            within(
                f"depth at {cells} x {cells}",
                found.depth_mm / law.depth_mm(_FORCE_N) - 1,
                depth,
                source=_COLLOCATION,
            ),
            within(
                f"largest pressure at {cells} x {cells}",
                float(found.pressure_mpa.max()) / top - 1,
                peak,
                source=_COLLOCATION,
            ),
            within(
                f"contact radius at {cells} x {cells}", found.contact_radius_mm / a - 1, radius, source=_COLLOCATION
            ),
        ]
    verdicts.append(
        Verdict(
            name="order of the depth",
            found=_order_of_depth(),
            low=2.3,
            high=3.7,
            source="theory: 3, what piecewise constants miss in energy of a pressure with a square-root rim; "
            "root mean square over nine contacts on 32, 64 and 128 cells, which scatter because the rim moves in cells",
        )
    )
    return verdicts


def _order_of_depth() -> float:
    grids, errors = [32, 64, 128], []
    for cells in grids:
        errors.append(
            rms(
                [
                    pressed(_BODY, paraboloid_mm(cells, _SIDE_MM, x0, 0.37 * x0, radius), _SIDE_MM, _FORCE_N).depth_mm
                    / Hertz(radius, 1.0).depth_mm(_FORCE_N)
                    - 1
                    for x0 in (0.0, 0.013, 0.05)
                    for radius in (8.0, 10.0, 12.0)
                ]
            )
        )
    return order(grids, errors)


def flat_punch() -> Sequence[Verdict]:
    """Hold depth and pressure under flat punches against theory: sharp edges, pressure without bound at the rim."""
    source = "Johnson 1985, section 3.8"
    grids, errors, verdicts = [64, 128, 256], [], []
    for cells in grids:
        x = centres_mm(cells, _SIDE_MM)
        r = np.hypot(x[:, None], x[None, :])
        depths, pressures = [], []
        for radius in (1.77, 1.83, 1.91, 2.0, 2.07, 2.13):
            punch = FlatPunch(radius, 1.0)
            found = pressed(_BODY, np.where(r <= radius, 0.0, math.inf), _SIDE_MM, _FORCE_N)
            inner = r < 0.7 * radius
            depths.append(found.depth_mm / punch.depth_mm(_FORCE_N) - 1)
            pressures.append(rms(list(found.pressure_mpa[inner] / punch.pressure_mpa(_FORCE_N, r[inner]) - 1)))
        errors.append(rms(depths))
        tenth = 0.1 * _SIDE_MM / cells / 2.0
        verdicts += [
            within(
                f"depth at {cells} x {cells}",
                errors[-1],
                tenth,
                source=f"{source}; bound: a tenth of a cell over the radius, which is all a rim of whole cells knows",
            ),
            within(
                f"pressure inside 0.7 a at {cells} x {cells}",
                rms(pressures),
                3 * tenth,
                source=f"{source}; bound: an error of the radius counts 1 + 1/(1 - r²/a²) times, up to 3",
            ),
        ]
    verdicts.append(
        Verdict(
            name="order of the depth",
            found=order(grids, errors),
            low=0.7,
            high=1.8,
            source="theory: 1 from the singular rim, 3/2 from the area of a circle of whole cells; six radii",
        )
    )
    return verdicts


def point_load() -> Sequence[Verdict]:
    """Hold the sinking around a single pressed cell against Boussinesq's."""
    cell = 0.1
    influence = _BODY.influence((128, 128), (cell, cell))
    verdicts = []
    for away in (5, 20, 100):
        r = away * cell
        verdicts.append(
            within(
                f"sinking {away} cells away",
                float(influence[away, 0]) / float(point_load_mm(cell**2, np.array([r]), 1.0)[0]) - 1,
                0.2 / away**2,
                source="Johnson 1985, eq. 3.22; bound: the second moment of two cells, (h/r)²/12 along an axis, "
                "doubled",
            )
        )
    diagonal = float(influence[70, 71]) / float(point_load_mm(cell**2, np.array([cell * math.hypot(70, 71)]), 1.0)[0])
    verdicts.append(
        within("sinking 100 cells away on the diagonal", diagonal - 1, 2e-5, source="as along the axis, at 99.7 cells")
    )
    return verdicts
