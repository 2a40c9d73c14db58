"""A taxel reads the mean contact pressure over its square."""

from collections.abc import Sequence

import numpy as np
from tactbench.plugin import FloatArray, SensorSpec
from tactbench.plugin.simulation import SkinGrid, SkinState, Transducer

from tactbench_robotiq_tsf85 import PITCH_MM, REST


def build(sensor: SensorSpec, grid: SkinGrid, channel_names: Sequence[str]) -> Transducer:
    """Prepare for a grid and the channels named in `channel_names`."""
    places = {channel.name: channel.position_m or (0.0, 0.0, 0.0) for channel in sensor.channels("taxel")}
    gain = sensor.parameters["gain"].to("count/MPa")
    x_mm, s_mm = grid.x_mm[:, None], grid.s_mm[None, :]
    inside = [
        (abs(x_mm - 1e3 * places[name][0]) < PITCH_MM / 2) & (abs(s_mm - 1e3 * places[name][1]) < PITCH_MM / 2)
        for name in channel_names
    ]

    def read(state: SkinState) -> FloatArray:
        return np.array([REST + gain * state.pressure_mpa[square].mean() for square in inside])

    return read
