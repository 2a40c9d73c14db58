"""Conversion of skin states to the BioTac's counts: film, conduction, divider, and the fluid's pressure.

It gives the 19 electrodes and PDC. TDC, TAC and PAC are not computed from the skin but by effects of the twin.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactbench.plugin import FloatArray, RigError, SensorSpec
from tactbench.plugin.simulation import FluidBackedShell, SkinGrid, SkinState, Transducer
from tactbench.sensors.biotac.channels import NAMES
from tactbench.sensors.biotac.film import REFINEMENT, edges, mid_film_mm, refined, spectral_interpolation
from tactbench.sensors.biotac.meshes import sheet_x
from tactbench.sensors.biotac.rims import Disc, RimmedDiscs
from tactbench.sensors.biotac.sheet import FilmSheet, faces_between

_STEP_MM = 0.1
"""Step [mm] for differences that give the film's stretch under a disc: an eighth of the disc's size or less."""


class Electrodes:
    """The electrodes under the film of one skin: geometry and interpolation, which do not depend on the load."""

    def __init__(self, sensor: SensorSpec, grid: SkinGrid, refinement: int = REFINEMENT) -> None:
        self.skin, outer, dome = finger_of(sensor)
        fine = refined(grid, refinement)
        self.film = self.skin.film.at(fine.x_mm, fine.s_mm / outer)
        self.to_fine_x = spectral_interpolation(len(grid.x_mm), len(fine.x_mm), mirrored=True)
        self.to_fine_s = np.ascontiguousarray(spectral_interpolation(len(grid.s_mm), len(fine.s_mm)).T)
        self.residual_film = self.skin.residual_film.to("mm")
        # S/m times ohm is 1/m: a length, the only electrical scale of the problem.
        conductivity = sensor.parameters["conductivity"].to("S/m")
        self.reference_per_mm = 1e-3 * conductivity * sensor.parameters["reference_resistor"].to("ohm")
        corner_x, corner_angle = edges(fine.x_mm), edges(fine.s_mm) / outer
        corners = mid_film_mm(corner_x, corner_angle, self.skin.film.at(corner_x, corner_angle), outer, dome)
        self.sheet = FilmSheet(faces_between(corners), discs_on(sensor, fine))

    def resistances(self, state: SkinState) -> FloatArray:
        """Return the (n_electrodes,) resistances times conductivity, 1/mm, of electrodes read one at a time.

        The film at rest is evaluated on the conduction grid exactly, the deflection interpolated.
        """
        deflection = self.to_fine_x @ state.deflection_mm @ self.to_fine_s
        return np.diag(self.sheet.resistances(np.maximum(self.film - deflection, self.residual_film)))

    def shares(self, state: SkinState) -> FloatArray:
        """Return the (n_electrodes,) shares, 0 to 1, of the drive voltage across the reference resistor.

        ``R_ref / (R_ref + Z_ee)``, the divider of the maker's formula ``Z = (4095 / E - 1) 10 kOhm``. That the others
        carry no current while one is sampled is derived: the commands address one channel, and no public text
        states how it is switched.
        """
        return np.asarray(self.reference_per_mm / (self.reference_per_mm + self.resistances(state)))


def build(
    sensor: SensorSpec, grid: SkinGrid, channel_names: Sequence[str], *, refinement: int = REFINEMENT
) -> Transducer:
    """Return the BioTac's transducer: readings in counts, before noise, rounding and clipping.

    `channel_names` may contain E1 to E19 and PDC; `refinement` is that of :func:`refined`.

    Raises
    ------
    RigError
        For TDC, TAC, PAC and unknown names; for a skin that is no fluid-backed shell; if PDC states no scale or rest.
    """
    for name in channel_names:
        if name not in NAMES and name != "PDC":
            raise RigError(
                f"{name} of {sensor.name} cannot be computed from the skin.",
                hint=f"Choose from {NAMES[0]} to {NAMES[-1]} and PDC.",
            )
    electrodes = Electrodes(sensor, grid, refinement)
    places = [(place, NAMES.index(name)) for place, name in enumerate(channel_names) if name in NAMES]
    channels = {channel.name: channel for channel in sensor.channels()}
    pdc, full_scale = channels["PDC"], channels[NAMES[0]].upper or 0.0
    if pdc.scale is None or pdc.rest is None:
        raise RigError("PDC has no scale or no rest level.", hint="State both in the channel's spec.")
    pa_per_count, pdc_rest = pdc.scale.to("Pa/count"), pdc.rest.value

    def read(state: SkinState) -> FloatArray:
        readings = np.full(len(channel_names), pdc_rest + 1e6 * state.fluid_pressure_mpa / pa_per_count)
        if places:
            shares = electrodes.shares(state)
            for place, electrode in places:
                readings[place] = full_scale * shares[electrode]
        return readings

    return read


def discs_on(sensor: SensorSpec, grid: SkinGrid) -> RimmedDiscs:
    """Return electrodes and excitation on the cells of `grid`, as discs that are round on the film's middle surface.

    Raises
    ------
    RigError
        If an electrode has no position, or lies outside the sheet.
    """
    par = sensor.parameters
    electrode_radius, excitation_radius = par["electrode_radius"].to("mm"), par["excitation_radius"].to("mm")
    _, outer, dome = finger_of(sensor)
    electrodes = []
    for channel in sensor.channels("taxel"):
        if channel.position_m is None:
            raise RigError(f"{channel.name} of {sensor.name} has no position.", hint="State ChannelSpec.position_m.")
        x, y, z = (1e3 * component for component in channel.position_m)
        place = sheet_x(x, float(np.hypot(y, z)), outer, dome)
        electrodes.append(disc_at(sensor, place, float(np.arctan2(y, -z)), electrode_radius))
    excitation = []
    for pair in ("front", "back"):
        x = par[f"excitation_x_{pair}"].to("mm")
        angle = par[f"excitation_arc_{pair}"].to("mm") / par["core_radius"].to("mm")
        excitation += [disc_at(sensor, x, side, excitation_radius) for side in (-angle, angle)]
    return RimmedDiscs(grid.x_mm, grid.s_mm, electrodes, excitation)


def disc_at(sensor: SensorSpec, x_mm: float, angle_rad: float, radius_mm: float) -> Disc:
    """Return a disc at a place of the sheet, with the stretch of the film's middle there."""
    skin, outer, dome = finger_of(sensor)
    x, angle = x_mm + _STEP_MM * np.array([-1.0, 1.0]), angle_rad + _STEP_MM / outer * np.array([-1.0, 1.0])
    corners = mid_film_mm(x, angle, skin.film.at(x, angle), outer, dome)
    along, across = corners[1] - corners[0], corners[:, 1] - corners[:, 0]
    stretch = tuple(float(np.linalg.norm(way.mean(axis=0))) / (2 * _STEP_MM) for way in (along, across))
    return Disc(x_mm, angle_rad * outer, radius_mm, (stretch[0], stretch[1]))


def finger_of(sensor: SensorSpec) -> tuple[FluidBackedShell, float, float]:
    """Return the shell, its outer radius [mm] and its dome's start [mm]; raises RigError for another kind of skin."""
    skin = sensor.skin
    if not isinstance(skin, FluidBackedShell) or skin.sheet.outer_radius is None or skin.sheet.dome is None:
        raise RigError(
            f"{sensor.name} has no fluid-backed shell with an outer radius and a dome, which this transduction needs.",
            hint="Declare the skin as FluidBackedShell with both, or name another transducer.",
        )
    return skin, skin.sheet.outer_radius.to("mm"), skin.sheet.dome.start.to("mm")
