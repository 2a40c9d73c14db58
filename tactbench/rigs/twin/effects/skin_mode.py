"""A mode of the skin shaken by a motion that is straight between samples: exact for any step."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.effects.memory import ComplexArray, recurrence
from tactbench.rigs.twin.effects.slip_event import Mode


def shaken(t_s: FloatArray, pushed: FloatArray, mode: Mode) -> FloatArray:
    """Return (n,) the answer of ``q'' + 2 z w q' + w^2 q = w^2 u``, at rest in equilibrium at the first sample.

    Parameters
    ----------
    t_s
        (n,) ascending; equal neighbours change nothing.
    pushed
        (n,) u: where a slow push would bring it; straight between samples.
    mode
        The mode.

    Notes
    -----
    With ``l = -z w + i wd`` and ``p = q' - conj(l) q`` it is one complex lag, ``p' = l p + w^2 u``, and
    ``q = Im p / wd``: exact like the lag of ``memory``, and solved as quickly.
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
