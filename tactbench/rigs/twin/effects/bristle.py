"""Friction that depends on speed and history: the LuGre bristle with exact steps.

Canudas de Wit, Olsson, Åström and Lischinsky 1995: ``dz/dt = v - |v| z/g(v)``. With v and g held over a step, z decays
exponentially with the distance travelled: ``z' = b z + (1 - b) g sign(v)``, ``b = exp(-|v| dt/g)``.
"""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.effects.memory import recurrence

COULOMB_MM_S = 1e-6
"""Stribeck speed below which friction falls from static to kinetic at once; all measured speeds are higher."""
NOTHING_MM = 1e-12
"""Deflection, a femtometre, below which a deflection counts as zero."""


def coefficient(speed_mm_s: FloatArray, static: float, kinetic: float, stribeck_mm_s: float) -> FloatArray:
    """Return (n,) friction coefficients at (n,) speeds: ``mu_k + (mu_s - mu_k) exp(-|v|/v_s)``, Tustin's form (1947).

    The coefficient falls fastest at rest, so that the slowest slide is the least stable. For ``v_s`` below a nanometre
    per second it has two values only, static and kinetic (Coulomb).
    """
    if stribeck_mm_s < COULOMB_MM_S:
        return np.where(speed_mm_s == 0, static, kinetic)
    return np.asarray(kinetic + (static - kinetic) * np.exp(-np.abs(speed_mm_s) / stribeck_mm_s))


def bristle(
    t_s: FloatArray, speed_mm_s: float, limit_mm: FloatArray, start_mm: float, most_mm: FloatArray | None = None
) -> FloatArray:
    """Return the (n,) deflection of the bristle at (n,) ascending times and a constant speed, from `start_mm` on.

    At a speed of 0, and between equal times, the deflection stays. `limit_mm` (n,) is the deflection ``g`` of steady
    sliding, at least 0 and constant from each sample to the next; where it is 0, motion leaves no deflection. With
    `most_mm` (n,), the deflection is at most this at every sample; samples are computed one after the other only if
    this limit is reached, which is rare.
    """
    way = abs(speed_mm_s) * np.diff(t_s, prepend=t_s[:1])
    held = np.concatenate([limit_mm[:1], limit_mm[:-1]])
    lost = -np.expm1(-np.divide(way, held, out=np.where(way > 0, np.inf, 0.0), where=held > NOTHING_MM))
    drive = lost * held * np.sign(speed_mm_s)
    drive[0] = start_mm
    found: FloatArray = recurrence(1.0 - lost, drive)
    if most_mm is not None and (found > most_mm).any():
        first = int((found > most_mm).argmax())
        found[first] = most_mm[first]
        for sample in range(first + 1, found.size):
            free = (1.0 - lost[sample]) * found[sample - 1] + drive[sample]
            found[sample] = min(free, most_mm[sample])
    return found
