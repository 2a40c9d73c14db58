"""Model of the BioTac's skin: an elastic sleeve over an incompressible fluid, and a rigid core under the fluid.

The core carries load where the fluid film is closed. It is added only when a load closes the film: below that load the
solutions with and without the core are the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import FluidBackedShell, SkinGrid
from tactbench.rigs.twin.contact.media import LocalLaw, Medium, Spectrum
from tactbench.rigs.twin.geometry import outer_radius_mm


def medium(skin: FluidBackedShell, grid: SkinGrid) -> Medium:
    """Return the medium of the fluid-backed shell on `grid`, without the core.

    Shallow circular cylindrical shell (Donnell, Mushtari, Vlasov): ``K = D k⁴ + T k² + (E t / Rm²) kx⁴ / k⁴`` with
    ``D = E t³ / (12 (1 - nu²))``; the fluid keeps the mean deflection at zero and its pressure is that constraint's
    multiplier. The sheet is mirrored at the tip of a dome, where the skin continues, and at its rear.
    """
    young, poisson, thickness = skin.young.to("MPa"), skin.poisson.to("1"), skin.thickness.to("mm")
    spectrum = Spectrum(grid, mirrored=skin.sheet.dome is not None)
    k2 = spectrum.k2.copy()
    k2[0, 0] = 1.0
    bending = young * thickness**3 / (12 * (1 - poisson**2))
    hoop = young * thickness / skin.mid_radius.to("mm") ** 2
    stiffness = bending * k2**2 + skin.tension.to("N/mm") * k2 + hoop * spectrum.kx**4 / k2**2
    stiffness[0, 0] = 0.0
    return Medium(
        grid=grid,
        spectrum=spectrum,
        stiffness=stiffness,
        respond=clamp(skin, grid),
        contact_stiffness=skin.contact_stiffness.to("MPa/mm"),
        zero_mean=True,
        # The asperities that keep a film open under load do so without.
        rest_thickness_mm=np.maximum(
            skin.film.at(grid.x_mm, grid.s_mm / outer_radius_mm(skin.sheet)), skin.residual_film.to("mm")
        ),
        least_thickness_mm=skin.residual_film.to("mm"),
        low_modes=72,
        has_core=True,
    )


def clamp(skin: FluidBackedShell, grid: SkinGrid) -> LocalLaw:
    """Return the clamp ``c (max(e^-(x - a)/l, e^-(b - x)/l) + e^-(arc/2 - |s|)/l)``, never above c from the ends.

    At the tip of a dome, b, nothing is clamped. ``a`` and ``b`` lie half a cell of the *sheet's own* division inside
    its ends: there the ends' clamp has its full stiffness on every grid, so that finer grids converge to the same skin.
    The seam's distance counts from the sheet's edge. The solver's reference figures hold for this choice; a clamp
    measured from the sheet's ends is weaker by half a cell's decay, and the approach under a flat surface 8 % larger.
    """
    length, sheet = skin.clamp_length.to("mm"), skin.sheet
    x_min, x_max = sheet.x_min.to("mm"), sheet.x_max.to("mm")
    inset = (x_max - x_min) / sheet.cells[0] / 2
    inside = grid.x_mm - (x_min + inset)
    if sheet.dome is None:
        inside = np.minimum(inside, (x_max - inset) - grid.x_mm)
    ends = np.exp(-np.maximum(inside, 0.0) / length)
    seam = np.exp(-(skin.sheet.arc.to("mm") / 2 - np.abs(grid.s_mm)) / length)
    stiffness = skin.clamp_stiffness.to("MPa/mm") * (ends[:, None] + seam[None, :])

    def respond(deflection_mm: FloatArray, tangent: FloatArray) -> tuple[FloatArray, float]:
        np.copyto(tangent, stiffness)
        pressure = stiffness * deflection_mm
        return pressure, 0.5 * float(pressure.reshape(-1) @ deflection_mm.reshape(-1))

    return respond


def with_core(medium: Medium, skin: FluidBackedShell) -> Medium:
    """Return `medium` with a core that carries load where less than the residual film is left: a one-sided spring."""
    film_mm = medium.rest_thickness_mm - medium.least_thickness_mm
    stiffness, below = skin.core_stiffness.to("MPa/mm"), medium.respond

    def respond(deflection_mm: FloatArray, tangent: FloatArray) -> tuple[FloatArray, float]:
        pressure, energy = below(deflection_mm, tangent)
        pressed = deflection_mm - film_mm
        np.maximum(pressed, 0.0, out=pressed)
        tangent += stiffness * (pressed > 0)
        flat = pressed.reshape(-1)
        energy += 0.5 * stiffness * float(flat @ flat)
        pressed *= stiffness
        pressure += pressed
        return pressure, energy

    return replace(medium, respond=respond)
