"""Tangential oscillation of the skin under a contact: motion in a slip, and response to a given motion.

In a slip the skin under the contact is a damped oscillator ``x'' + 2 z w x' + w^2 (x - x_e) = 0`` about ``x_e``, the
deflection that kinetic friction holds. A slip begins at ``x_e + u`` with the surface's speed V and ends when the skin
has this speed again. Without damping (two-coefficient friction, Rabinowicz 1965) it ends at ``x_e - u``, after
``(2/w)(pi - atan(w u/V))``, for any V: the force falls by ``2 (mu_s - mu_k) N``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, RigError
from tactbench.rigs.twin.effects.memory import ComplexArray, recurrence


@dataclass(frozen=True)
class Mode:
    """A damped tangential oscillation of the skin under the contact."""

    omega: float
    """Undamped angular frequency, rad/s."""
    damping: float
    """Share of the critical damping, 0 to below 1."""

    def __post_init__(self) -> None:
        if not (self.omega > 0 and 0 <= self.damping < 1):
            raise RigError(
                f"The skin cannot oscillate at {self.omega:g} rad/s with {self.damping:g} of the critical damping.",
                hint="State skin_mode_frequency above 0 and skin_mode_damping from 0 to below 1 in the sensor's spec.",
            )

    @property
    def decay(self) -> float:
        """Decay rate of the oscillation, 1/s."""
        return self.damping * self.omega

    @property
    def swing(self) -> float:
        """Damped angular frequency, rad/s."""
        return self.omega * math.sqrt(1.0 - self.damping**2)


def swing(mode: Mode, u: FloatArray, speed: FloatArray, after_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return deflection from equilibrium and velocity, (n,) each, `after_s` (n,) after a slip began at `u`, `speed`."""
    w, r = mode.swing, mode.decay
    c, s = np.cos(w * after_s), np.sin(w * after_s)
    faded = np.exp(-r * after_s)
    return (
        faded * (u * c + (speed + r * u) / w * s),
        faded * (speed * c - (mode.omega**2 * u + r * speed) / w * s),
    )


def deflection_after(mode: Mode, u: float, speed: float, after_s: float) -> float:
    """Return the deflection of :func:`swing` at one moment, without arrays because it is computed once per slip."""
    w, r = mode.swing, mode.decay
    return math.exp(-r * after_s) * (u * math.cos(w * after_s) + (speed + r * u) / w * math.sin(w * after_s))


def is_caught(mode: Mode, u: FloatArray, speed: float) -> npt.NDArray[np.bool_]:
    """Return (n,) True where the skin, in a slip that begins at `u` (n,), reaches the surface's speed again."""
    w, r = mode.swing, mode.decay
    back = (mode.omega**2 * u + r * speed) / w
    highest = np.arctan2(r * speed + back * w, r * back - speed * w) + math.pi
    _, velocity = swing(mode, u, np.full_like(u, speed), highest / w)
    return (u > 0) & (velocity >= speed)


def slip_s(mode: Mode, u: float, speed: float) -> float:
    """Return the duration of the slip in seconds; infinity if the skin never sticks again.

    The velocity rises throughout the half period after its minimum, so that it reaches the surface's speed once there.
    """
    from scipy.optimize import brentq

    w, r = mode.swing, mode.decay
    back = (mode.omega**2 * u + r * speed) / w
    if not u > 0:
        return math.inf

    def excess(t: float) -> float:
        return math.exp(-r * t) * (speed * math.cos(w * t) - back * math.sin(w * t)) - speed

    low = math.atan2(r * speed + back * w, r * back - speed * w) / w
    high = low + math.pi / w
    if excess(high) < 0:
        return math.inf
    # In the rounding of a deflection of almost nothing the velocity may not fall at all.
    return low if excess(low) >= 0 else float(brentq(excess, low, high, xtol=1e-18, rtol=1e-15))


def shaken(t_s: FloatArray, pushed: FloatArray, mode: Mode) -> FloatArray:
    """Return the (n,) solution q of ``q'' + 2 z w q' + w^2 q = w^2 u``, at rest in equilibrium at the first sample.

    `t_s` (n,) ascends; equal neighbours change nothing. u is `pushed` (n,), the displacement under a slow push,
    linear between samples. With ``l = -z w + i wd`` and ``p = q' - conj(l) q`` the equation is one complex lag, ``p' =
    l p + w^2 u``, and ``q = Im p / wd``: exact like the lag of ``memory``, and solved as quickly.
    """
    root = complex(-mode.decay, mode.swing)
    dt = np.diff(t_s, prepend=t_s[:1])
    turned: ComplexArray = np.exp(root * dt)
    before = np.concatenate([pushed[:1], pushed[:-1]])
    rise = np.divide(pushed - before, dt, out=np.zeros_like(dt), where=dt > 0)
    grown = (turned - 1.0) / root
    drive = mode.omega**2 * (before * grown + rise * (grown - dt) / root)
    drive[0] = -root.conjugate() * pushed[0]
    return np.asarray(recurrence(turned, drive).imag / mode.swing)
