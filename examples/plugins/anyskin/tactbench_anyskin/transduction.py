"""Over each chip the skin holds a magnet, upright and at the surface: the chip reads the field of a dipole that moves."""

from collections.abc import Sequence

import numpy as np
from tactbench.plugin import FloatArray, SensorSpec
from tactbench.plugin.simulation import SkinGrid, SkinState, Transducer


def build(sensor: SensorSpec, grid: SkinGrid, channel_names: Sequence[str]) -> Transducer:
    """Prepare for a grid and the channels named in `channel_names`."""
    places = {channel.name: channel.position_m or (0.0, 0.0, 0.0) for channel in sensor.channels("taxel")}
    given = sensor.parameters
    height_mm, radius_mm = given["magnet_height"].to("mm"), given["magnet_radius"].to("mm")
    x_mm, s_mm = (1e3 * np.array([places[name][axis] for name in channel_names])[:, None, None] for axis in (0, 1))
    near = np.exp(-((grid.x_mm[:, None] - x_mm) ** 2 + (grid.s_mm - s_mm) ** 2) / radius_mm**2)
    near /= near.sum(axis=(1, 2), keepdims=True)
    axes = np.eye(3)[["xyz".index(name[-1]) for name in channel_names]]

    def read(state: SkinState) -> FloatArray:
        moved_mm = np.stack([*state.tangential_displacement_mm, -state.deflection_mm])
        # From the chip to its magnet, in units of their distance at rest.
        r = np.tensordot(near, moved_mm, ((1, 2), (1, 2))) / height_mm + (0, 0, 1)
        d = np.linalg.norm(r, axis=1, keepdims=True)
        field = (3 * r * r[:, 2:] / d**2 - (0, 0, 1)) / (2 * d**3)
        return np.asarray(given["magnet_field"].to("uT") * (axes * field).sum(axis=1))

    return read
