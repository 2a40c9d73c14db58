"""Linear filters with memory, exact for any step and unconditionally stable.

All filters compute ``x' = a x + b`` with ``a = exp(-dt / tau)``, dt being that of each step: steps may differ, and a
repeated time stamp (dt = 0) changes nothing. Times must ascend.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, RigError


def steps_s(t_s: FloatArray, tau_s: float) -> FloatArray:
    """Return the (n,) steps before each sample, the first zero, for a filter of time constant `tau_s`.

    Raises
    ------
    RigError
        If the time constant is not positive and finite.
    """
    if not (tau_s > 0 and np.isfinite(tau_s)):
        raise RigError(
            f"A filter has the time constant {tau_s:g} s; a positive, finite number is expected.",
            hint="Correct the time constants among the sensor's nuisances.",
        )
    return np.diff(t_s, prepend=t_s[:1])


ComplexArray = npt.NDArray[np.complex128]
Numbers = TypeVar("Numbers", FloatArray, ComplexArray)


def recurrence(decay: Numbers, drive: Numbers) -> Numbers:
    """Return ``x_n = decay_n x_{n-1} + drive_n`` for all n, with ``x_0 = drive_0``.

    `decay` (n,) is of absolute value 0 to 1, its first entry is not used; `drive` is (n,) or (n, channels). The method
    is doubling: after step j every entry holds the sum over its last 2^j predecessors, so that 5000 samples take 13
    vector operations. Products of factors up to 1 cannot overflow.
    """
    x = drive.copy()
    factor = decay.reshape(-1, *([1] * (drive.ndim - 1))).copy()
    shift = 1
    while shift < x.shape[0]:
        x[shift:] += factor[shift:] * x[:-shift]
        factor[shift:] = factor[shift:] * factor[:-shift]
        shift *= 2
    return x


def lag(t_s: FloatArray, load: FloatArray, tau_s: float) -> FloatArray:
    """Return the (n,) first-order lag of a (n,) load that is linear between samples, starting in equilibrium.

    Times ascend; equal neighbours are allowed. Raises the errors of :func:`steps_s`.

    ``z' = a z + (1-a) x_n + (x_{n+1} - x_n) (1 - (tau/dt) (1-a))``, the exact response to a linear input.
    """
    e = steps_s(t_s, tau_s) / tau_s
    late = -np.expm1(-e)
    # 1 - late/e loses its digits for small e: there by its series, exact to 1e-4^4.
    small = e < 1e-4
    safe = np.where(small, 1.0, e)
    series = np.where(small, e, 0.0)
    straight = np.where(small, series / 2 - series**2 / 6 + series**3 / 24, 1.0 - late / safe)
    before = np.concatenate([load[:1], load[:-1]])
    drive = late * before + (load - before) * straight
    drive[:1] = load[:1]
    return recurrence(1.0 - late, drive)


def wandering(
    t_s: FloatArray, spread: float, tau_s: float, channels: int, generator: np.random.Generator
) -> FloatArray:
    """Return (n, channels) independent Ornstein-Uhlenbeck paths, stationary from the first sample on.

    Mean 0, standard deviation `spread`, correlation ``exp(-|t| / tau)``. Raises the errors of :func:`steps_s`.
    """
    dt = steps_s(t_s, tau_s)
    fresh = np.sqrt(-np.expm1(-2 * dt / tau_s))
    fresh[:1] = 1.0
    drive = generator.standard_normal((t_s.size, channels))
    drive *= (spread * fresh)[:, None]
    return recurrence(np.exp(-dt / tau_s), drive)


def time_constant_s(cutoff_hz: float) -> float:
    """Return the time constant [s] of a first-order filter with the cut-off frequency f: ``1 / (2 pi f)``."""
    return 1.0 / (2.0 * math.pi * cutoff_hz)
