"""Electrodes and excitation on the conduction grid.

A point source in two dimensions has a resistance that grows with ln(1/cell), so that an electrode is never one node.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, RigError, SensorSpec
from tactbench.plugin.simulation import FluidBackedShell, SkinGrid
from tactbench.sensors.biotac.film import mid_film_mm
from tactbench.sensors.biotac.meshes import sheet_x
from tactbench.sensors.biotac.rims import Disc, RimmedDiscs

_STEP_MM = 0.1
"""Over which the film's stretch under a disc is taken: an eighth of the disc or less."""
DEPTH_AVERAGE = 3.0
"""Contact conductance of a thin film times h / (sigma A)."""


class Contacts(Protocol):
    """What touches the film from the core."""

    count: int
    """Electrodes."""
    owner: npt.NDArray[np.intp]
    under: npt.NDArray[np.intp]
    """(joints,) electrode and cell that each joint connects."""

    def joints(self, film_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the conductances over sigma of the joints, (joints,), and of the cells to the drive, (nx*ns,)."""

    def narrow(self, film_mm: FloatArray, along_x: FloatArray, along_s: FloatArray) -> None:
        """Change conductances of faces between cells, (nx-1, ns) and (nx, ns-1), that a contact's rim crosses."""


class Discs:
    """Contacts of any shape, as areas of overlap with the cells; right where cells are finer than the film.

    Parameters
    ----------
    electrodes
        (n_electrodes, nx, ns) square millimetres.
    excitation
        (nx, ns) square millimetres, all excitation discs together.
    electrode_radius_mm, excitation_radius_mm
        The radius a of the part ``4/(pi a)`` of a contact's conductance.
    thin_contact
        Contact conductance of a thin film times h / (sigma A).
    """

    def __init__(
        self,
        electrodes: FloatArray,
        excitation: FloatArray,
        electrode_radius_mm: float,
        excitation_radius_mm: float,
        thin_contact: float = DEPTH_AVERAGE,
    ) -> None:
        self.count = len(electrodes)
        flat = electrodes.reshape(self.count, -1)
        self.owner, self.under = np.nonzero(flat)
        areas, drive = flat[self.owner, self.under], excitation.ravel()
        self._thin, self._thick = thin_contact * areas, areas * (4.0 / (np.pi * electrode_radius_mm))
        self._thin_drive, self._thick_drive = thin_contact * drive, drive * (4.0 / (np.pi * excitation_radius_mm))

    def joints(self, film_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``A (3/h + 4/(pi a))`` of every overlap, and of the excitation in every cell."""
        flat = film_mm.ravel()
        return self._thin / flat[self.under] + self._thick, self._thin_drive / flat + self._thick_drive

    def narrow(self, film_mm: FloatArray, along_x: FloatArray, along_s: FloatArray) -> None:
        """Leave the faces as they are."""


def disc_overlap(
    x_mm: FloatArray, s_mm: FloatArray, centre_mm: tuple[float, float], radius_mm: float, samples: int = 16
) -> FloatArray:
    """Return how much of each cell a disc covers.

    Parameters
    ----------
    x_mm, s_mm
        (nx,), (ns,) centres of the cells, in the film's own metric.
    centre_mm
        Centre of the disc.
    radius_mm
        Radius of the disc.
    samples
        Sub-samples per cell and axis.

    Returns
    -------
    (nx, ns) square millimetres, scaled so that they add up to the disc's area: sub-sampling alone would make the
    electrode's size depend on where it falls on the grid.

    Raises
    ------
    RigError
        If the disc touches no cell.
    """
    dx, ds = float(x_mm[1] - x_mm[0]), float(s_mm[1] - s_mm[0])
    within = (np.arange(samples) + 0.5) / samples - 0.5
    near_x = np.flatnonzero(np.abs(x_mm - centre_mm[0]) < radius_mm + dx)
    near_s = np.flatnonzero(np.abs(s_mm - centre_mm[1]) < radius_mm + ds)
    fine_x = (x_mm[near_x, None] + within * dx).ravel() - centre_mm[0]
    fine_s = (s_mm[near_s, None] + within * ds).ravel() - centre_mm[1]
    inside = fine_x[:, None] ** 2 + fine_s[None, :] ** 2 <= radius_mm**2
    covered = np.count_nonzero(inside)
    if covered == 0:
        raise RigError(
            f"An electrode of {radius_mm:g} mm at {centre_mm[0]:.2f}, {centre_mm[1]:.2f} mm covers no part of the "
            f"sheet's cells of {dx:.2f} x {ds:.2f} mm.",
            hint="Correct the sensor's electrode positions or its SkinSheet, or ask for more cells.",
        )
    overlap = np.zeros((len(x_mm), len(s_mm)))
    share = inside.reshape(len(near_x), samples, len(near_s), samples).sum(axis=(1, 3)) / covered
    overlap[np.ix_(near_x, near_s)] = share * (np.pi * radius_mm**2)
    return overlap


def discs_on(sensor: SensorSpec, grid: SkinGrid) -> RimmedDiscs:
    """Return electrodes and excitation on the cells of `grid`, round in the metric of the film's middle.

    Raises
    ------
    RigError
        If an electrode has no position, or lies outside the sheet.
    """
    par = sensor.parameters
    electrode_radius, excitation_radius = par["electrode_radius"].to("mm"), par["excitation_radius"].to("mm")
    outer, dome = outer_radius_mm(sensor), dome_mm(sensor)
    electrodes = []
    for channel in sensor.channels("taxel"):
        if channel.position_m is None:
            raise RigError(f"{channel.name} of {sensor.name} has no position.", hint="Give ChannelSpec.position_m.")
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
    outer = outer_radius_mm(sensor)
    x, angle = x_mm + _STEP_MM * np.array([-1.0, 1.0]), angle_rad + _STEP_MM / outer * np.array([-1.0, 1.0])
    corners = mid_film_mm(x, angle, shell_of(sensor).film.at(x, angle), outer, dome_mm(sensor))
    along, across = corners[1] - corners[0], corners[:, 1] - corners[:, 0]
    stretch = tuple(float(np.linalg.norm(way.mean(axis=0))) / (2 * _STEP_MM) for way in (along, across))
    return Disc(x_mm, angle_rad * outer, radius_mm, (stretch[0], stretch[1]))


def shell_of(sensor: SensorSpec) -> FluidBackedShell:
    """Return the sensor's fluid-backed shell; raises RigError if its skin is another."""
    if not isinstance(sensor.skin, FluidBackedShell):
        raise RigError(
            f"{sensor.name} has no fluid-backed shell, which this transduction needs.",
            hint="Declare the skin as FluidBackedShell, or name another transducer.",
        )
    return sensor.skin


def outer_radius_mm(sensor: SensorSpec) -> float:
    """Return the finger's outer radius; raises RigError if the sheet states none."""
    radius = shell_of(sensor).sheet.outer_radius
    if radius is None:
        raise RigError(f"The skin of {sensor.name} states no outer radius.", hint="Give SkinSheet.outer_radius.")
    return radius.to("mm")


def dome_mm(sensor: SensorSpec) -> float:
    """Return where the finger's dome begins; raises RigError if the sheet states none."""
    dome = shell_of(sensor).sheet.dome
    if dome is None:
        raise RigError(f"The skin of {sensor.name} states no dome.", hint="Give SkinSheet.dome.")
    return dome.start.to("mm")
