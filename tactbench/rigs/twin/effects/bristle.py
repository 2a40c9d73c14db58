"""Friction against speed, and its memory: the LuGre bristle with exact steps.

Canudas de Wit, Olsson, Åström and Lischinsky 1995: ``dz/dt = v - |v| z/g(v)``. With v and g held over a step it is
a decay with the way travelled, whatever the step: ``z' = b z + (1 - b) g sign(v)``, ``b = exp(-|v| dt/g)``.
"""

from __future__ import annotations

import math

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.effects.memory import recurrence

COULOMB_MM_S = 1e-6
"""Below this Stribeck speed friction falls at once: nothing measured is slower."""


def coefficient(speed_mm_s: float, static: float, kinetic: float, stribeck_mm_s: float) -> float:
    """Return friction over load at a speed: ``mu_k + (mu_s - mu_k) exp(-|v|/v_s)``, Tustin's form (1947).

    Its slope is steepest at rest, so that the slowest slide is the least stable. ``v_s = 0`` (or below a nanometre a
    second): Coulomb's two coefficients.
    """
    if stribeck_mm_s < COULOMB_MM_S:
        return kinetic if speed_mm_s else static
    return kinetic + (static - kinetic) * math.exp(-abs(speed_mm_s) / stribeck_mm_s)


def bristle(t_s: FloatArray, speed_mm_s: float, limit_mm: FloatArray, start_mm: float) -> FloatArray:
    """Return the (n,) deflection of the bristle at a constant speed.

    Parameters
    ----------
    t_s
        (n,) ascending; equal neighbours change nothing.
    speed_mm_s
        Held throughout; 0 leaves the deflection as it is.
    limit_mm
        (n,) deflection of steady sliding ``g``, at least 0, held from each sample to the next. 0: nothing is held.
    start_mm
        Deflection at the first sample.
    """
    way = abs(speed_mm_s) * np.diff(t_s, prepend=t_s[:1])
    held = np.concatenate([limit_mm[:1], limit_mm[:-1]])
    lost = -np.expm1(-np.divide(way, held, out=np.where(way > 0, np.inf, 0.0), where=held > 0))
    drive = lost * held * np.sign(speed_mm_s)
    drive[0] = start_mm
    return recurrence(1.0 - lost, drive)
