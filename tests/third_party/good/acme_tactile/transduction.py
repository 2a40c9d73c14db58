"""Mean pressure over each taxel, 1000 counts a MPa."""

import numpy as np


def build(sensor, grid, channel_names):
    x, s = np.meshgrid(grid.x_mm, grid.s_mm, indexing="ij")
    places = {channel.name: channel.position_m for channel in sensor.channels("taxel")}
    weights = []
    for name in channel_names:
        px, py, _ = places[name]
        weight = np.exp(-(((x - px * 1e3) ** 2 + (s - py * 1e3) ** 2) / 1.2**2))
        weights.append(weight / weight.sum())
    stacked = np.array(weights)

    def transduce(state):
        return 100.0 + 1000.0 * np.tensordot(stacked, state.pressure_mpa, 2)

    return transduce
