"""Conversion of contact pressure to the ideal taxel grid's readings, by an exact integral."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tactbench.plugin import FloatArray, RigError, SensorSpec
from tactbench.plugin.simulation import SkinGrid, SkinState, Transducer


def gaussian_over_cells(centres_mm: FloatArray, at_mm: float, sigma_mm: float) -> FloatArray:
    """Return the (n,) integrals [mm] of ``exp(-(x - at)^2 / (2 sigma^2))`` over cells around (n,) `centres_mm`."""
    half = float(centres_mm[1] - centres_mm[0]) / 2
    edges = np.append(centres_mm - half, centres_mm[-1] + half) - at_mm
    primitive = np.array([math.erf(edge / (math.sqrt(2.0) * sigma_mm)) for edge in edges])
    return sigma_mm * math.sqrt(math.pi / 2) * np.diff(primitive)


def build(sensor: SensorSpec, grid: SkinGrid, channel_names: Sequence[str]) -> Transducer:
    """Return the ideal grid's transducer: readings in counts, exact for a pressure that is constant in each cell.

    Raises
    ------
    RigError
        If a channel is not a taxel with a place.
    """
    places = {channel.name: channel.position_m for channel in sensor.channels("taxel")}
    sigma = sensor.parameters["influence"].to("mm")
    along_x, along_s = np.empty((len(channel_names), len(grid.x_mm))), np.empty((len(channel_names), len(grid.s_mm)))
    for row, name in enumerate(channel_names):
        place = places.get(name)
        if place is None:
            raise RigError(f"{sensor.name} has no taxel {name} with a place.", hint=f"Taxels: {', '.join(places)}.")
        along_x[row] = gaussian_over_cells(grid.x_mm, 1e3 * place[0], sigma)
        along_s[row] = gaussian_over_cells(grid.s_mm, 1e3 * place[1], sigma)
    sensitivity = sensor.parameters["sensitivity"].to("count/N")

    def read(state: SkinState) -> FloatArray:
        # MPa times mm^2 is newton.
        felt = np.einsum("ix,xs,is->i", along_x, state.pressure_mpa, along_s, optimize=True)
        return np.asarray(sensitivity * felt)

    return read
