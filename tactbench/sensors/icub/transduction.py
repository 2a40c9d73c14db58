"""Conversion of skin states to the iCub's counts: plate capacitors whose foam gets thinner under pressure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactbench.plugin import ChannelSpec, FloatArray, RigError, SensorSpec
from tactbench.plugin.simulation import FoamPad, SkinGrid, SkinState, Transducer

SUBSAMPLES = 4
"""Number of points, per cell and axis, over which a taxel's weight is averaged."""
_MIDDLE = 0.5
"""Share of a cell's width over which a taxel's weight is averaged. A mean over the whole cell has an error of 1/24 of
the cell squared times the field's curvature, 0.34 % of the readings on the spec's grid; the weight at the cell's centre
alone misses the taxel's edge, 0.16 % there but 4.7 % with cells twice as wide. Half the width gives 0.17 % and 2.5 %,
and weights that are never negative."""


def taxel_weight(grid: SkinGrid, centre_mm: tuple[float, float], radius_mm: float) -> FloatArray:
    """Return the (nx, ns) share of each cell in a taxel's reading, at least zero, sum 1.

    `centre_mm` is axial place and arc length of the taxel; the weight ``exp(-(r^2/a^2)^4)`` falls at a = `radius_mm`.

    Raises
    ------
    RigError
        If the taxel lies outside the grid.
    """
    dx, ds = grid.cell_mm
    within = _MIDDLE * ((np.arange(SUBSAMPLES) + 0.5) / SUBSAMPLES - 0.5)
    x = (grid.x_mm[:, None] + within * dx).ravel() - centre_mm[0]
    s = (grid.s_mm[:, None] + within * ds).ravel() - centre_mm[1]
    flat_top = np.exp(-(((x[:, None] ** 2 + s[None, :] ** 2) / radius_mm**2) ** 4))
    cells = flat_top.reshape(len(grid.x_mm), SUBSAMPLES, len(grid.s_mm), SUBSAMPLES).sum(axis=(1, 3))
    total = cells.sum()
    if total == 0.0:
        raise RigError(
            f"A taxel at x {centre_mm[0]:.2f}, s {centre_mm[1]:.2f} mm lies outside the skin's grid.",
            hint="Correct the taxel's position or the SkinSheet.",
        )
    return np.asarray(cells / total)


def build(sensor: SensorSpec, grid: SkinGrid, channel_names: Sequence[str]) -> Transducer:
    """Return the fingertip's transducer: ``rest - gain (C/C0 - 1)`` in counts, before noise, rounding and clipping.

    C/C0 is ``sum W_i h / (h - u)`` over a taxel's cells, with the plates never nearer than `least_gap` of h.

    Raises
    ------
    RigError
        If a channel is not a taxel with a place and a rest level, or the skin is not a foam pad.
    """
    skin = sensor.skin
    if not isinstance(skin, FoamPad) or skin.sheet.outer_radius is None:
        raise RigError(
            f"{sensor.name} has no foam pad around a finger, which this transduction needs.",
            hint="Declare the skin as FoamPad with an outer radius, or name another transducer.",
        )
    taxels = {channel.name: channel for channel in sensor.channels("taxel")}
    unknown = [name for name in channel_names if name not in taxels]
    if unknown:
        raise RigError(f"{sensor.name} has no taxel {', '.join(unknown)}.", hint=f"Taxels: {', '.join(taxels)}.")
    radius = sensor.parameters["taxel_radius"].to("mm")
    outer = skin.sheet.outer_radius.to("mm")
    weights = np.array([taxel_weight(grid, _place_mm(taxels[name], outer), radius).ravel() for name in channel_names])
    rest = np.array([_rest(taxels[name]) for name in channel_names])
    gain, foam_mm = sensor.parameters["gain"].to("count"), skin.thickness.to("mm")
    least_mm = sensor.parameters["least_gap"].value * foam_mm

    def read(state: SkinState) -> FloatArray:
        closeness = foam_mm / np.maximum(state.thickness_mm, least_mm)
        return rest - gain * (weights @ closeness.ravel() - 1.0)

    return read


def _place_mm(taxel: ChannelSpec, outer_radius_mm: float) -> tuple[float, float]:
    """Return a taxel's axial place and arc length [mm] on the outer surface."""
    if taxel.position_m is None:
        raise RigError(f"{taxel.name} has no position.", hint="State ChannelSpec.position_m.")
    x, y, z = taxel.position_m
    return 1e3 * x, outer_radius_mm * float(np.arctan2(y, -z))


def _rest(taxel: ChannelSpec) -> float:
    if taxel.rest is None:
        raise RigError(f"The spec states no level at rest for {taxel.name}.", hint="State ChannelSpec.rest.")
    return taxel.rest.to("count")
