"""An ideal grid of taxels, without noise and with readings in closed form, for tests (see ``docs/sensors.md``).

Taxel i reads ``S * integral of p(r) exp(-|r - r_i|^2 / (2 sigma^2)) dA``: linear in the contact pressure p, and in
closed form for a point load, for a Gaussian pressure and for a uniform one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tactbench.plugin import (
    ChannelSpec,
    DataSheet,
    FloatArray,
    Quantity,
    RigError,
    SensorDescriptor,
    SensorSpec,
    Source,
    StreamSpec,
    assumed,
    hookimpl,
)
from tactbench.plugin.simulation import BondedLayer, Nuisances, SkinGrid, SkinSheet, SkinState, Transducer


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


TACTBENCH_API = 2

_WHY = "by definition: this sensor is an oracle, not a product"
_AT_MM = (-4.5, -1.5, 1.5, 4.5)


def _by_definition(value: float, unit: str) -> Quantity:
    return assumed(value, unit, _WHY)


SKIN = BondedLayer(
    sheet=SkinSheet(
        x_min=_by_definition(-8.0, "mm"),
        x_max=_by_definition(8.0, "mm"),
        arc=_by_definition(16.0, "mm"),
        cells=(48, 48),
    ),
    young=_by_definition(1.0, "MPa"),
    poisson=_by_definition(0.3, "1"),
    thickness=_by_definition(2.0, "mm"),
    contact_stiffness=_by_definition(30.0, "MPa/mm"),
)

PARAMETERS = {
    "contact_x": _by_definition(0.0, "mm"),
    "contact_s": _by_definition(0.0, "mm"),
    "sensitivity": _by_definition(1000.0, "count/N"),
    "influence": _by_definition(1.5, "mm"),
}

_SOURCE = Source(tag="assumed", reference=_WHY)

STREAM = StreamSpec(
    name="taxels",
    rate_hz=100.0,
    rate_source=_SOURCE,
    dtype="float64",
    channels=tuple(
        ChannelSpec(
            name=f"T{row * len(_AT_MM) + column + 1}",
            kind="taxel",
            rest=_by_definition(0.0, "count"),
            sign=1,
            position_m=(x_mm * 1e-3, s_mm * 1e-3, 0.0),
            normal=(0.0, 0.0, -1.0),
            position_source=_SOURCE,
        )
        for row, x_mm in enumerate(_AT_MM)
        for column, s_mm in enumerate(_AT_MM)
    ),
)

SPEC = SensorSpec(
    name="ideal",
    title="Ideal taxel grid",
    principle="contact pressure under a Gaussian influence",
    principle_source=_SOURCE,
    streams=(STREAM,),
    link_delay=_by_definition(0.0, "ms"),
    skin=SKIN,
    parameters=PARAMETERS,
    nuisances={"taxel": Nuisances()},
    data_sheet=DataSheet(exists=False),
)


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Return the descriptor of the ideal taxel grid."""
    return [SensorDescriptor(spec=SPEC, transducer="tactbench.sensors.ideal:build")]
