"""Creep: part of the response arrives late, by exact exponentials.

Linear viscoelasticity with constant shape of the contact: the skin answers to the force filtered by a Prony series,
``F (1 - sum c_i) + sum c_i z_i``, where ``z_i`` lags behind F with time constant ``tau_i``.
"""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.effects.signal import Signal


def apply(signal: Signal) -> None:
    """Filter the force by the creep of the observed channels' skin."""
    known = signal.sensor.spec.nuisances
    # One skin: the channels share its creep. The kind that states most of it speaks for all.
    kinds = {channel.kind for channel in signal.channels if channel.kind in known}
    terms = max(
        (known[kind].creep for kind in sorted(kinds)), key=lambda t: sum(x.fraction.value for x in t), default=()
    )
    late = sum(term.fraction.to("1") for term in terms)
    signal.load = (1.0 - late) * signal.force + sum(
        (term.fraction.to("1") * lag(signal.force, signal.t_s, term.tau.to("s")) for term in terms),
        start=np.zeros_like(signal.force),
    )


def lag(x: FloatArray, t_s: FloatArray, tau_s: float) -> FloatArray:
    """Return ``z' = (x - z)/tau``, started in equilibrium, exact for x linear between samples.

    Unconditionally stable: any step, also of a thousand time constants; a step of zero, or backwards, changes nothing.

    Parameters
    ----------
    x, t_s
        (n,) input and its times; need not be uniform.
    tau_s
        Time constant.
    """
    dt = np.maximum(np.diff(t_s), 0.0)
    e = dt / tau_s
    gain = -np.expm1(-e)
    # 1 - (1 - exp(-e))/e, by its series where the closed form cancels.
    safe = np.where(e > 0, e, 1.0)
    slope = np.where(e < 1e-4, e / 2 - e**2 / 6 + e**3 / 24, 1.0 - gain / safe)
    step = np.where(dt > 0, gain * x[:-1] + slope * np.diff(x), 0.0)
    return recursion(np.exp(-e), step, float(x[0]))


def recursion(a: FloatArray, b: FloatArray, start: float) -> FloatArray:
    """Return (n+1,) z with ``z[0] = start`` and ``z[i+1] = a[i] z[i] + b[i]``, (n,) factors in 0 … 1 and addends.

    Solved as the bidiagonal system that it is: compiled, for any steps.
    """
    from scipy.linalg import solve_banded

    n = len(a) + 1
    bands = np.ones((2, n))
    bands[1, :-1], bands[1, -1] = -a, 0.0
    return np.asarray(solve_banded((1, 0), bands, np.concatenate([[start], b]), check_finite=False))
