"""The fluid film: its thickness at rest, and its deflection on the finer grid on which it conducts."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray, FluidBackedShell, SkinGrid, UsageError

REFINEMENT = 2
"""Conduction cells per skin cell and axis: the mechanics converges at 48 x 64 cells, the conduction does not."""

# Fitted by eye to the public meshes of core and skin: the film is even within 0.6 rad of the midline and has
# narrowed to its side value one radian further out.
_EVEN_WITHIN_RAD = 0.6
_NARROWS_OVER_RAD = 1.0


def film_at_rest(skin: FluidBackedShell, s_mm: FloatArray) -> FloatArray:
    """Return the film's thickness with nothing touching.

    Parameters
    ----------
    skin
        The shell; its sheet must have an outer radius.
    s_mm
        (n,) arc length on the outer surface, 0 on the midline.

    Returns
    -------
    (n,) millimetres: ``max(gap (1 - f c^2), gap_side)`` with ``c = clip((|s|/Ro - 0.6) / 1.0, 0, 1)``.

    Raises
    ------
    UsageError
        If the sheet is flat.
    """
    radius = skin.sheet.outer_radius
    if radius is None:
        raise UsageError(
            "The film of a fluid-backed shell needs the finger's outer radius; the sheet states none.",
            hint="Give SkinSheet.outer_radius.",
        )
    angle = np.abs(s_mm) / radius.to("mm")
    narrowing = np.clip((angle - _EVEN_WITHIN_RAD) / _NARROWS_OVER_RAD, 0.0, 1.0)
    film = skin.gap.to("mm") * (1.0 - skin.gap_side_fraction.value * narrowing**2)
    return np.maximum(film, skin.gap_side.to("mm"))


def refined(grid: SkinGrid, factor: int = REFINEMENT, shrink_s: float = 1.0) -> SkinGrid:
    """Return the same sheet with `factor` cells per cell and axis; centres of cells, not nodes.

    Along the arc there are `shrink_s` times as many, rounded: cells about as square on a film whose arc is that much
    shorter than the outer surface's.
    """
    across = max(2, round(grid.s_mm.size * factor * shrink_s))
    return SkinGrid(
        x_mm=_divided_axis(grid.x_mm, grid.x_mm.size * factor),
        s_mm=_divided_axis(grid.s_mm, across),
    )


def with_tail(grid: SkinGrid, tail_mm: float) -> tuple[SkinGrid, int]:
    """Return the grid with cells added before its first, and how many: the least that cover `tail_mm`."""
    dx, _ = grid.cell_mm
    added = int(np.ceil(tail_mm / dx - 1e-9))
    before = grid.x_mm[0] - dx * np.arange(added, 0, -1)
    return SkinGrid(x_mm=np.concatenate([before, grid.x_mm]), s_mm=grid.s_mm), added


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
