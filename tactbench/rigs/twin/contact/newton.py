"""One load: the minimiser of a convex energy, by damped Newton with Fourier-preconditioned conjugate gradients.

``E(w, d) = 1/2 ∫ w K w + ∫ phi(w) + 1/2 ks ∫ (d - g - w)₊² - F d`` over the deflection w and the approach d. Every
term is convex in (w, d) together, so there is one minimiser (under zero mean where a fluid is enclosed). It is
piecewise smooth: once the contact set settles, Newton ends in one or two full steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.rigs.twin.contact.medium import Medium

TOLERANCE = 1e-6
"""Residual, relative to the load, at which a solution is one."""
MAX_STEPS = 60
MAX_INNER = 400
MAX_HALVINGS = 14
FIRST_APPROACH_MM = 0.02
"""Start of a cold solve: at least one cell touches."""


@dataclass(frozen=True)
class Solution:
    """Equilibrium under one load."""

    force_n: float
    w: FloatArray
    """(nx, ns) deflection, mm"""
    approach_mm: float
    pressure: FloatArray
    """(nx, ns) contact pressure, MPa"""
    fluid_pressure: float
    """MPa; 0 without a fluid"""
    residual: float
    steps: int
    inner: int


class Press:
    """A medium, and an indenter over it.

    Parameters
    ----------
    medium
        The skin.
    gap
        (nx, ns) gap at zero approach, mm, minimum zero.
    """

    def __init__(self, medium: Medium, gap: FloatArray) -> None:
        from scipy import fft

        self.medium, self.gap = medium, gap
        self._shape = gap.shape
        self._forward: Any = fft.rfft2
        self._back: Any = fft.irfft2
        dx, ds = medium.grid.cell_mm
        self._cell = dx * ds

    def solve(self, force_n: float, start: tuple[FloatArray, float] | None = None, tol: float = TOLERANCE) -> Solution:
        """Return the equilibrium under `force_n`.

        Parameters
        ----------
        force_n
            Load; zero and less is the rest state, which is exact and not solved for.
        start
            Deflection and approach of a neighbouring load.
        tol
            Largest residual relative to the load.

        Raises
        ------
        RigError
            If the residual does not fall below `tol`: a result is never returned with a silent error.
        """
        if force_n <= 0:
            rest = np.zeros(self._shape)
            return Solution(0.0, rest, 0.0, rest, 0.0, 0.0, 0, 0)
        w, d = (start[0].copy(), start[1]) if start else (np.zeros(self._shape), FIRST_APPROACH_MM)
        state = _State(self, w, d, force_n)
        inner_total = 0
        for step in range(MAX_STEPS):
            residual = state.residual
            if residual < tol:
                return self._solution(state, step, inner_total)
            # Inexact Newton: far from the solution the direction need not be better than the step is long.
            dw, dd, inner = self._direction(state, min(1e-2, 0.1 * residual) if residual > 1e-3 else 1e-4)
            inner_total += inner
            state = self._descend(state, dw, dd)
        raise RigError(
            f"Contact at {force_n:g} N did not settle: residual {state.residual:.1e} after {MAX_STEPS} steps.",
            hint="Check the skin's parameters: stiffnesses over more than six decades are beyond the solver.",
        )

    def energy(self, w: FloatArray, d: float, force_n: float) -> float:
        """Return the energy [N mm]."""
        return _State(self, w, d, force_n).energy

    def gradient(self, w: FloatArray, d: float, force_n: float) -> tuple[FloatArray, float]:
        """Return the gradient per unit area, (nx, ns), and with respect to the approach."""
        state = _State(self, w, d, force_n)
        return state.g_w, state.g_d

    def apply_stiffness(self, w: FloatArray) -> FloatArray:
        """Return K w."""
        return self._back(self.medium.stiffness * self._forward(w), s=self._shape)  # type: ignore[no-any-return]

    def _direction(self, state: _State, tol: float) -> tuple[FloatArray, float, int]:
        """Return Newton's step.

        The approach is eliminated: with ``b = ks chi`` and ``s = ∫ b``, ``(H - b b/s) dw = -g_w - b g_d / s`` and
        ``dd = (-g_d + ∫ b dw) / s``. What the elimination takes away is the mean over the contact, so the matrix stays
        positive semidefinite, and one system is solved instead of two.
        """
        medium, cell = self.medium, self._cell
        b = np.asarray(medium.contact_stiffness * state.touching, dtype=np.float64)
        s = float(b.sum()) * cell
        diagonal = np.asarray(medium.law.tangent(state.w) + b, dtype=np.float64)
        right = np.asarray(-state.g_w - b * (state.g_d / s), dtype=np.float64)
        if medium.keeps_volume:
            right -= right.mean()
        inverse = np.asarray(1.0 / (medium.stiffness + diagonal.mean()), dtype=np.float64)
        if medium.keeps_volume:
            inverse[0, 0] = 0.0
        dw, inner = self._conjugate_gradients(diagonal, b, s, right, inverse, tol)
        return dw, (-state.g_d + float((b * dw).sum()) * cell) / s, inner

    def _conjugate_gradients(
        self, diagonal: FloatArray, b: FloatArray, s: float, right: FloatArray, inverse: FloatArray, tol: float
    ) -> tuple[FloatArray, int]:
        """Solve for the deflection.

        Preconditioner and stiffness are both diagonal in Fourier space, so one transform of the residual and one
        transform back of two stacked fields give ``z = M r`` and ``K z``; ``K p`` follows by the same recurrence as p.
        """
        x = np.zeros(self._shape)
        r = right.copy()
        p, k_p = np.zeros(self._shape), np.zeros(self._shape)
        stacked = np.stack([inverse, inverse * self.medium.stiffness])
        stop = tol * tol * float(np.vdot(right, right))
        last = 1.0
        for count in range(1, MAX_INNER + 1):
            z, k_z = self._back(stacked * self._forward(r), s=self._shape)
            rz = float(np.vdot(r, z))
            ratio = rz / last if count > 1 else 0.0
            p *= ratio
            p += z
            k_p *= ratio
            k_p += k_z
            q = diagonal * p
            q += k_p
            q -= b * (float(np.vdot(b, p)) * self._cell / s)
            if self.medium.keeps_volume:
                q -= q.mean()
            curvature = float(np.vdot(p, q))
            if curvature <= 0:
                return x, count
            length = rz / curvature
            x += length * p
            r -= length * q
            if float(np.vdot(r, r)) < stop:
                return x, count
            last = rz
        return x, MAX_INNER

    def _descend(self, state: _State, dw: FloatArray, dd: float) -> _State:
        """Return the state after the longest of the steps 1, 1/2, 1/4 … that lowers the energy enough (Armijo)."""
        slope = float(np.vdot(state.g_w, dw)) * self._cell + state.g_d * dd
        k_dw = self.apply_stiffness(dw)
        length = 1.0
        for _ in range(MAX_HALVINGS):
            new = _State(self, state.w + length * dw, state.d + length * dd, state.force, state.k_w + length * k_dw)
            # The last term lets roundoff through once the energy cannot fall any further.
            if new.energy <= state.energy + 1e-4 * length * slope + 1e-13 * abs(state.energy):
                return new
            length /= 2
        return new

    def _solution(self, state: _State, steps: int, inner: int) -> Solution:
        pressure = self.medium.contact_stiffness * state.overlap
        fluid = float((pressure - self.medium.law.pressure(state.w)).mean()) if self.medium.keeps_volume else 0.0
        return Solution(state.force, state.w, state.d, pressure, fluid, state.residual, steps, inner)


class _State:
    """Energy and gradient at (w, d)."""

    __slots__ = ("d", "energy", "force", "g_d", "g_w", "k_w", "overlap", "residual", "touching", "w")

    def __init__(self, press: Press, w: FloatArray, d: float, force: float, k_w: FloatArray | None = None) -> None:
        medium, cell = press.medium, press._cell
        self.w, self.d, self.force = w, d, force
        self.k_w = press.apply_stiffness(w) if k_w is None else k_w
        self.overlap = np.maximum(d - press.gap - w, 0.0)
        self.touching = self.overlap > 0
        if not self.touching.any():
            # Out of contact there is no stiffness against the load: come back to first touch.
            self.d = float((press.gap + w).min()) + FIRST_APPROACH_MM
            self.overlap = np.maximum(self.d - press.gap - w, 0.0)
            self.touching = self.overlap > 0
        ks = medium.contact_stiffness
        self.energy = (
            cell
            * (
                0.5 * float(np.vdot(w, self.k_w))
                + float(medium.law.energy(w).sum())
                + 0.5 * ks * float(np.vdot(self.overlap, self.overlap))
            )
            - force * self.d
        )
        g_w = self.k_w + medium.law.pressure(w) - ks * self.overlap
        if medium.keeps_volume:
            g_w -= g_w.mean()
        self.g_w = g_w
        self.g_d = ks * float(self.overlap.sum()) * cell - force
        self.residual = max(abs(self.g_d), float(np.sqrt(np.vdot(g_w, g_w))) * cell) / force
