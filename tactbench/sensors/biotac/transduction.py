"""Conversion of skin states to the BioTac's counts: film, conduction, divider, and the fluid's pressure.

It gives the 19 electrodes and PDC. TDC, TAC and PAC are not computed from the skin but by effects of the twin.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactbench.plugin import FloatArray, RigError, SensorSpec
from tactbench.plugin.simulation import FluidBackedShell, SkinGrid, SkinState, Transducer
from tactbench.sensors.biotac.channels import NAMES
from tactbench.sensors.biotac.conduction import Disc, FilmSheet, RimmedDiscs, faces_between
from tactbench.sensors.biotac.meshes import RAYS_FROM_MM, core_reach_mm, sheet_x

REFINEMENT = 2
"""Refinement step of the grid for conduction in the film, relative to the grid of the skin."""
_CELLS_PER_STEP = 0.75, 0.515
"""Conduction cells along and across per cell of the skin and refinement step: about square on the film, whose arc is
shorter than the skin's. At step 2, 96 x 66 cells, reading changes are off by 0.6 % of their rms; at 3, by 0.5 %."""
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
        return self.reference_per_mm / (self.reference_per_mm + self.resistances(state))


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


def refined(grid: SkinGrid, factor: int = REFINEMENT) -> SkinGrid:
    """Return the grid for conduction in the film on the sheet of the skin's `grid`; points are centres of cells."""
    along, across = (
        max(2, round(axis.size * factor * cells))
        for axis, cells in zip((grid.x_mm, grid.s_mm), _CELLS_PER_STEP, strict=True)
    )
    return SkinGrid(x_mm=_divided_axis(grid.x_mm, along), s_mm=_divided_axis(grid.s_mm, across))


def edges(centres: FloatArray) -> FloatArray:
    """Return the (n+1,) edges of cells of equal length with the (n,) `centres`."""
    half = float(centres[1] - centres[0]) / 2
    return np.concatenate([centres - half, centres[-1:] + half])


def _divided_axis(centres: FloatArray, cells: int) -> FloatArray:
    step = float(centres[1] - centres[0])
    edge = float(centres[0]) - step / 2
    return np.asarray(edge + (np.arange(cells) + 0.5) * (step * len(centres) / cells))


def spectral_interpolation(n: int, cells: int, *, mirrored: bool = False) -> FloatArray:
    """Return the (cells, n) matrix that interpolates n cell-centred samples to `cells` cells on the same length.

    It is the Dirichlet kernel, that is a zero-padded Fourier transform with the shift between the cells' centres
    (which do not coincide), for an even n: two small products interpolate along both axes. Rows sum to 1; waves below
    the Nyquist wave are interpolated exactly. `mirrored` samples continue as their own image at both ends, others are
    periodic.
    """
    fine = (np.arange(cells) + 0.5) * (n / cells)
    coarse = np.arange(n) + 0.5
    images, period = ([coarse, -coarse], 2 * n) if mirrored else ([coarse], n)
    turn = np.pi / period * (fine[:, None] - np.array(images)[:, None])  # distance in coarse cells, as a phase
    at_node = np.abs(np.sin(turn)) < 1e-12
    kernel = np.sin(period * turn) / (period * np.tan(np.where(at_node, 0.5, turn)))
    return np.asarray(np.where(at_node, 1.0, kernel).sum(axis=0))


def mid_film_mm(
    x_mm: FloatArray, angle_rad: FloatArray, film_mm: FloatArray, outer_mm: float, dome_mm: float
) -> FloatArray:
    """Return the (nx, ns, 3) places of the film's middle, for a (nx, ns) thickness.

    `x_mm` (nx,) and `angle_rad` (ns,) are the sheet's axial coordinates and angles around the finger, within a right
    angle of the midline; `outer_mm` is the radius of its outer surface, whose dome begins at `dome_mm`.
    """
    x = x_mm[:, None]
    behind = np.minimum(x, RAYS_FROM_MM)
    ring = np.sqrt(np.maximum(outer_mm**2 - np.maximum(x - dome_mm, 0.0) ** 2, 0.0))
    ray = np.arctan2(x - behind, ring)
    middle = core_reach_mm(behind, ray, angle_rad) + film_mm / 2
    height = middle * np.cos(ray)
    around = angle_rad[None, :]
    return np.stack([behind + middle * np.sin(ray), height * np.sin(around), -height * np.cos(around)], axis=-1)
