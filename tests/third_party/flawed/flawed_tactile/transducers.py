"""Mean pressure over each taxel; but for `sound`, with one flaw."""

import numpy as np

COUNTS_A_MPA = 400.0


def weights(sensor, grid, channels, place=lambda x, y: (x, y)):
    x, s = np.meshgrid(grid.x_mm, grid.s_mm, indexing="ij")
    places = {channel.name: channel.position_m for channel in sensor.channels("taxel")}
    found = []
    for name in channels:
        px, py = place(*(1e3 * part for part in places[name][:2]))
        weight = np.exp(-(((x - px) ** 2 + (s - py) ** 2) / 1.2**2))
        found.append(weight / weight.sum())
    return np.array(found)


def made(sensor, grid, channels, change=lambda readings, state: readings, **how):
    stacked = weights(sensor, grid, channels, **how)

    def transduce(state):
        readings = 100.0 + COUNTS_A_MPA * np.tensordot(stacked, state.pressure_mpa, 2)
        return change(readings, state)

    return transduce


def sound(sensor, grid, channels):
    return made(sensor, grid, channels)


def takes_no_grid(sensor, channels):
    return made(sensor, None, channels)


def writes_into_the_spec(sensor, grid, channels):
    sensor.parameters["gain"] = sensor.parameters["contact_x"]
    return made(sensor, grid, channels)


def leaves_one_taxel_out(sensor, grid, channels):
    return made(sensor, grid, channels[1:])


def is_nan_at_rest(sensor, grid, channels):
    return made(sensor, grid, channels, lambda readings, state: readings + 0.0 / np.float64(state.contact_radius_mm))


def is_nan_over_range(sensor, grid, channels):
    return made(sensor, grid, channels, lambda readings, state: readings + 0.0 * np.log(1.5 - state.depth_mm))


def rests_elsewhere(sensor, grid, channels):
    return made(sensor, grid, channels, lambda readings, state: readings + 200.0)


def keeps_its_own_order(sensor, grid, channels):
    every = [channel.name for channel in sensor.channels("taxel") if channel.name in channels]
    return made(sensor, grid, every)


def remembers(sensor, grid, channels):
    last = [0.0]

    def change(readings, state):
        readings = readings + 0.01 * last[0]
        last[0] = state.force_n
        return readings

    return made(sensor, grid, channels, change)


def changes_the_state(sensor, grid, channels):
    def change(readings, state):
        state.pressure_mpa[:] *= 2
        return readings

    return made(sensor, grid, channels, change)


def feels_nothing(sensor, grid, channels):
    return made(sensor, grid, channels, lambda readings, state: np.full_like(readings, 100.0))


def reads_shear(sensor, grid, channels):
    return made(
        sensor, grid, channels, lambda readings, state: readings + 40.0 * state.tangential_displacement_mm.sum()
    )


def folds_shear(sensor, grid, channels):
    return made(sensor, grid, channels, lambda readings, state: readings + 40.0 * np.abs(state.shear_mpa.sum()))


def forgets_shear(sensor, grid, channels):
    return made(sensor, grid, channels)


def swaps_axes(sensor, grid, channels):
    return made(sensor, grid, channels, place=lambda x, y: (y, x))


def mirrors(sensor, grid, channels):
    return made(sensor, grid, channels, place=lambda x, y: (x, -y))


def turns_the_sign(sensor, grid, channels):
    return made(sensor, grid, channels, lambda readings, state: 200.0 - readings)


def falls_back(sensor, grid, channels):
    return made(
        sensor, grid, channels, lambda readings, state: 100.0 + (readings - 100.0) / (1.0 + 3.0 * state.force_n**2)
    )


def is_in_grams(sensor, grid, channels):
    return made(sensor, grid, channels, lambda readings, state: 100.0 + 101_972.0 * (readings - 100.0))
