"""The profile of a rough surface, and how much of it a contact of finite size feels."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import Surface

COMPONENTS = 48
"""Cosines the profile is made of: enough to be close to Gaussian; they set the effect's cost."""
_RADII = 1025
"""Radii for which the mean over the contact is computed; straight between them it is right to 1e-4."""


class Profile:
    """A random profile with a given dominant wavelength: a function of the place, the same whenever it is asked.

    A sum of cosines of equal amplitude, wavelengths log-normal about the dominant one, phases uniform.

    Parameters
    ----------
    surface
        Roughness (root mean square), wavelength and spread.
    generator
        Where wavelengths and phases come from.
    """

    def __init__(self, surface: Surface, generator: np.random.Generator) -> None:
        count = 1 if surface.spread == 0 else COMPONENTS
        turns = generator.standard_normal(COMPONENTS)[:count]
        self.wave_mm = surface.wavelength.to("mm") * np.exp(surface.spread * turns)
        self._phase = generator.uniform(0.0, 2.0 * np.pi, COMPONENTS)[:count]
        self._amplitude_mm = surface.roughness.to("mm") * np.sqrt(2.0 / count)

    def felt_mm(self, place_mm: FloatArray, contact_radius_mm: FloatArray) -> FloatArray:
        """Return (n,) the profile's mean over a contact of (n,) radii around (n,) places."""
        height = np.zeros(place_mm.size)
        radii = np.linspace(0.0, float(contact_radius_mm.max(initial=0.0)), _RADII)
        for wave, phase in zip(2.0 * np.pi / self.wave_mm, self._phase, strict=True):
            felt = np.interp(contact_radius_mm, radii, patch_mean(wave * radii))
            height += felt * np.cos(wave * place_mm + phase)
        return np.asarray(self._amplitude_mm * height)


def patch_mean(turn: FloatArray) -> FloatArray:
    """Return the mean of a unit cosine over a contact, relative to its middle.

    Weighted with the Hertzian pressure ``sqrt(1 - r^2/a^2)``: ``3 (sin k - k cos k)/k^3`` with
    ``k = 2 pi a/wavelength`` (the transform of a ball, which that weight is the shadow of).
    """
    small = np.abs(turn) < 0.05
    safe = np.where(small, 1.0, turn)
    # By its series for small arguments, where the difference loses its digits: next term below 2e-10.
    series = 1.0 - turn**2 / 10.0 + turn**4 / 280.0
    return np.where(small, series, 3.0 * (np.sin(safe) - safe * np.cos(safe)) / safe**3)
