"""Skin states without a contact solver: smooth dents whose volume is pushed elsewhere."""

import numpy as np

from tactbench.plugin.simulation import FluidBackedShell, SkinGrid, SkinState


def grid_of(spec, factor=1.0):
    """Return the grid of a sensor's sheet, with `factor` times its cells along each axis."""
    sheet = spec.skin.sheet
    nx, ns = (round(n * factor) for n in sheet.cells)
    low, high, arc = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm")
    return SkinGrid(low + (np.arange(nx) + 0.5) * (high - low) / nx, -arc / 2 + (np.arange(ns) + 0.5) * arc / ns)


def state_of(spec, grid, deflection=None, **facts):
    """Return the state of a sensor's skin under a deflection [mm], at rest without one."""
    skin = spec.skin
    if deflection is None:
        deflection = np.zeros((grid.x_mm.size, grid.s_mm.size))
    if isinstance(skin, FluidBackedShell):
        least = skin.residual_film.to("mm")
        rest = np.maximum(skin.film.at(grid.x_mm, grid.s_mm / skin.sheet.outer_radius.to("mm")), least)
        left = np.maximum(rest - deflection, least)
    else:
        left = skin.thickness.to("mm") - deflection
    return SkinState(**{
        "grid": grid, "force_n": 1.0, "deflection_mm": deflection, "pressure_mpa": np.zeros_like(deflection),
        "thickness_mm": left, "depth_mm": 0.0, "fluid_pressure_mpa": 0.0, "contact_radius_mm": 0.0, "residual": 0.0,
        **facts,
    })  # fmt: skip


def dent(grid, depth, x, s, width=2.0, *, keep_volume=True):
    """Return a Gaussian hollow [mm]; what is kept of its volume rises everywhere."""
    r2 = (grid.x_mm[:, None] - x) ** 2 + (grid.s_mm[None, :] - s) ** 2
    hollow = depth * np.exp(-r2 / (2 * width**2))
    return hollow - hollow.mean() if keep_volume else hollow
