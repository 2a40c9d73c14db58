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
NOTHING_MM = 1e-12
"""Deflections below this, a femtometre, count as zero."""


def coefficient(speed_mm_s: float, static: float, kinetic: float, stribeck_mm_s: float) -> float:
    """Return friction over load at a speed: ``mu_k + (mu_s - mu_k) exp(-|v|/v_s)``, Tustin's form (1947).

    Its slope is steepest at rest, so that the slowest slide is the least stable. ``v_s = 0`` (or below a nanometre a
    second): Coulomb's two coefficients.
    """
    if stribeck_mm_s < COULOMB_MM_S:
        return kinetic if speed_mm_s else static
    return kinetic + (static - kinetic) * math.exp(-abs(speed_mm_s) / stribeck_mm_s)


def bristle(t_s: FloatArray, speed_mm_s: float, limit_mm: FloatArray, start_mm: float) -> FloatArray:
    """Return the (n,) deflection of the bristle at (n,) ascending times and a constant speed, from `start_mm` on.

    A speed of 0 and equal neighbouring times change nothing. `limit_mm` (n,) is the deflection of steady sliding ``g``,
    at least 0, held from each sample to the next; where it is 0 nothing is held.
    """
    way = abs(speed_mm_s) * np.diff(t_s, prepend=t_s[:1])
    held = np.concatenate([limit_mm[:1], limit_mm[:-1]])
    lost = -np.expm1(-np.divide(way, held, out=np.where(way > 0, np.inf, 0.0), where=held > NOTHING_MM))
    drive = lost * held * np.sign(speed_mm_s)
    drive[0] = start_mm
    return recurrence(1.0 - lost, drive)


def bristle_below(
    t_s: FloatArray, speed_mm_s: float, limit_mm: FloatArray, start_mm: float, most_mm: FloatArray
) -> FloatArray:
    """Return :func:`bristle` that at no sample holds more than `most_mm` (n,), but slides back at once.

    Nearly always it never would; only where it would, sample follows sample.
    """
    free = bristle(t_s, speed_mm_s, limit_mm, start_mm)
    over = free > most_mm
    if not over.any():
        return free
    first = int(over.argmax())
    way = abs(speed_mm_s) * np.diff(t_s)
    held = limit_mm[:-1]
    kept = np.exp(-np.divide(way, held, out=np.where(way > 0, np.inf, 0.0), where=held > NOTHING_MM))
    fresh = (1.0 - kept) * held * np.sign(speed_mm_s)
    x = float(most_mm[first])
    free[first] = x
    steps = zip(kept[first:].tolist(), fresh[first:].tolist(), most_mm[first + 1 :].tolist(), strict=True)
    for sample, (b, more, most) in enumerate(steps, first + 1):
        x = min(b * x + more, most)
        free[sample] = x
    return free
