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
    return _recursion(np.exp(-e), step, float(x[0]))


def _recursion(a: FloatArray, b: FloatArray, start: float) -> FloatArray:
    """Return z with ``z[i+1] = a[i] z[i] + b[i]``; a compiled filter where all steps are equal."""
    from scipy.signal import lfilter

    if len(a) and np.ptp(a) <= 1e-12:
        rest = lfilter([1.0], [1.0, -float(a.mean())], b, zi=np.array([float(a.mean()) * start]))[0]
        return np.concatenate([[start], rest])
    out = np.empty(len(a) + 1)
    out[0] = start
    value = start
    for place, (factor, addend) in enumerate(zip(a.tolist(), b.tolist(), strict=True)):
        value = factor * value + addend
        out[place + 1] = value
    return out
