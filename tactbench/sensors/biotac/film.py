"""The fluid film: its thickness at rest, and the finer grid on which it conducts."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray, SheetTable, SkinGrid, Source
from tactbench.sensors.biotac.surface import MESHES, RAYS_FROM_MM, core_mm, ray_length, ray_on_sheet

REFINEMENT = 2
"""Steps of refinement from the skin's grid to the conduction's."""
_CELLS_PER_STEP = 0.75, 0.515
"""Conduction cells along and across, for one of the skin's and one step: about square on the film, whose arc is shorter
than the outer surface's. At two steps, 96 x 66 cells, changes are off by 0.6 % of their rms; at three, by 0.5 %."""

ANGLES_DEG = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0)
AT_X_MM: dict[float, tuple[float, ...]] = {
    -17.2: (0.10,) * 11,
    -17: (0.19, 0.20, 0.16, 0.18, 0.16, 0.15, 0.12, 0.15, 0.15, 0.14, 0.10),
    -16: (0.34, 0.39, 0.36, 0.36, 0.32, 0.29, 0.23, 0.20, 0.16, 0.15, 0.11),
    -15: (0.59, 0.63, 0.60, 0.58, 0.52, 0.44, 0.38, 0.31, 0.22, 0.16, 0.12),
    -14: (0.80, 0.84, 0.79, 0.75, 0.68, 0.59, 0.49, 0.38, 0.26, 0.16, 0.07),
    -13: (0.96, 1.00, 0.95, 0.88, 0.80, 0.69, 0.58, 0.43, 0.28, 0.15, 0),
    -12: (1.08, 1.11, 1.06, 0.99, 0.89, 0.76, 0.61, 0.46, 0.28, 0.15, 0.04),
    -10: (1.23, 1.26, 1.19, 1.10, 0.99, 0.84, 0.65, 0.49, 0.29, 0.15, 0.01),
    -8: (1.31, 1.33, 1.25, 1.15, 1.02, 0.86, 0.66, 0.48, 0.28, 0.14, 0.06),
    -6: (1.32, 1.35, 1.28, 1.17, 1.04, 0.86, 0.66, 0.47, 0.27, 0.14, 0.03),
    -4: (1.33, 1.35, 1.27, 1.16, 1.03, 0.86, 0.65, 0.48, 0.28, 0.14, 0.01),
    -2: (1.29, 1.32, 1.24, 1.13, 1.00, 0.84, 0.64, 0.47, 0.27, 0.13, 0.03),
    0: (1.24, 1.24, 1.15, 1.05, 0.93, 0.78, 0.61, 0.45, 0.26, 0.14, 0.04),
    1: (1.53, 1.44, 1.23, 1.05, 0.88, 0.73, 0.56, 0.41, 0.24, 0.13, 0.01),
}  # fmt: skip
"""Millimetres by axial place and angle, inner skin less core, left and right averaged (they differ by .011 mm on
average); the meshes' edges of .6-.8 mm leave about .03 mm. -17.2 mm, the seal, is the law's: see SOURCE."""
AT_RAY_DEG: dict[float, tuple[float, ...]] = {
    5: (2.04, 1.96, 1.69, 1.27, 0.92, 0.67, 0.53, 0.38, 0.23, 0.11, 0),
    15: (2.32, 2.24, 2.01, 1.61, 1.12, 0.70, 0.52, 0.39, 0.26, 0.15, 0.03),
    25: (2.45, 2.37, 2.15, 1.77, 1.27, 0.81, 0.54, 0.41, 0.31, 0.18, 0.07),
    35: (2.38, 2.32, 2.12, 1.80, 1.34, 0.88, 0.59, 0.42, 0.32, 0.22, 0.10),
    45: (2.17, 2.12, 1.95, 1.67, 1.28, 0.87, 0.61, 0.45, 0.37, 0.28, 0.17),
    55: (1.79, 1.74, 1.60, 1.37, 1.06, 0.81, 0.59, 0.47, 0.40, 0.32, 0.21),
    65: (1.25, 1.21, 1.12, 0.98, 0.80, 0.60, 0.55, 0.48, 0.40, 0.34, 0.24),
    75: (0.73, 0.73, 0.70, 0.65, 0.60, 0.52, 0.48, 0.45, 0.41, 0.38, 0.33),
    85: (0.45, 0.46, 0.47, 0.46, 0.45, 0.44, 0.43, 0.44, 0.44, 0.42, 0.41),
}  # fmt: skip
"""The same at the tip, by the ray's angle from straight down towards the tip."""
SOURCE = Source(
    tag="derived",
    reference=f"inner skin less core, {MESHES}; at the seal the law max(min(.13, g), .05 + (g - .05) cos(angle)) "
    "through x <= 0 (rms .026 mm), g = .10 mm",
)


_ANGLES_DEG = tuple(angle for angle in ANGLES_DEG if angle <= 90)
"""Of the pad's half of the finger, the sheet's."""


def film_table(outer_mm: float, dome_mm: float) -> SheetTable:
    """Return the meshes' film on the sheet.

    Parameters
    ----------
    outer_mm, dome_mm
        Radius of the sheet's cylinder, and where its dome begins.
    """
    return SheetTable(x_mm=_places(outer_mm, dome_mm), angle_deg=_ANGLES_DEG, value_mm=tuple(_rows()), source=SOURCE)


def relief_table(outer_mm: float, dome_mm: float, skin_mm: float) -> SheetTable:
    """Return how far the outer surface lies inside cylinder and dome: core, film and a skin of one thickness.

    Parameters
    ----------
    outer_mm, dome_mm
        Radius of the sheet's cylinder, and where its dome begins.
    skin_mm
        Thickness of the skin.
    """
    angle = np.radians(_ANGLES_DEG)
    reach = [(x, 0.0, outer_mm) for x in AT_X_MM]
    for degrees in AT_RAY_DEG:
        ray = float(np.radians(degrees))
        reach.append((RAYS_FROM_MM, ray, ray_length(ray, outer_mm, dome_mm)))
    rows = [
        way - (core_mm(np.array(begin), np.array(ray), angle) + np.array(film) + skin_mm)
        for (begin, ray, way), film in zip(reach, _rows(), strict=True)
    ]
    return SheetTable(
        x_mm=_places(outer_mm, dome_mm),
        angle_deg=_ANGLES_DEG,
        value_mm=tuple(tuple(np.round(row, 3).tolist()) for row in rows),
        source=Source(
            tag="derived",
            reference=f"core, film and a skin of one thickness, {MESHES}: a circle of 7.11 mm about 1.1 mm below the "
            "core's axis (rms .02 mm); such a skin has 1660 mm^3, the mesh 1631",
        ),
    )


def _rows() -> list[tuple[float, ...]]:
    return [row[: len(_ANGLES_DEG)] for row in (*AT_X_MM.values(), *AT_RAY_DEG.values())]


def _places(outer_mm: float, dome_mm: float) -> tuple[float, ...]:
    """Return the sheet's axial coordinates of the rows."""
    rays = (ray_on_sheet(float(np.radians(angle)), outer_mm, dome_mm) for angle in AT_RAY_DEG)
    return (*AT_X_MM, *rays)


def refined(grid: SkinGrid, factor: int = REFINEMENT) -> SkinGrid:
    """Return the same sheet in the conduction's cells; centres of cells, not nodes."""
    along, across = (
        max(2, round(axis.size * factor * cells))
        for axis, cells in zip((grid.x_mm, grid.s_mm), _CELLS_PER_STEP, strict=True)
    )
    return SkinGrid(x_mm=_divided_axis(grid.x_mm, along), s_mm=_divided_axis(grid.s_mm, across))


def edges(centres: FloatArray) -> FloatArray:
    """Return the (n+1,) edges of cells of equal length."""
    half = float(centres[1] - centres[0]) / 2
    return np.concatenate([centres - half, centres[-1:] + half])


def _divided_axis(centres: FloatArray, cells: int) -> FloatArray:
    step = float(centres[1] - centres[0])
    edge = float(centres[0]) - step / 2
    return np.asarray(edge + (np.arange(cells) + 0.5) * (step * len(centres) / cells))


def spectral_interpolation(n: int, cells: int) -> FloatArray:
    """Return the matrix that takes n periodic cell-centred samples to `cells` cells on the same length.

    It is the Dirichlet kernel, that is a zero-padded Fourier transform with the shift between the cells' centres
    (which do not coincide), written as a matrix: two small products do both axes.

    Parameters
    ----------
    n
        Number of samples, even.
    cells
        Number of cells wanted.

    Returns
    -------
    (cells, n); rows sum to 1; exact for every wave below the Nyquist one.
    """
    fine = (np.arange(cells) + 0.5) * (n / cells)
    coarse = np.arange(n) + 0.5
    distance = fine[:, None] - coarse[None, :]  # in coarse cells
    turn = np.pi * distance / n
    at_node = np.abs(np.sin(turn)) < 1e-12
    kernel = np.sin(n * turn) / (n * np.tan(np.where(at_node, 0.5, turn)))
    return np.asarray(np.where(at_node, 1.0, kernel))
