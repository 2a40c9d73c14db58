"""Solver of a skin under one load: minimises a convex energy by Newton's method with Fourier-preconditioned CG.

The energy over deflection ``w`` and approach ``delta`` is

    E = 1/2 <w, K w> + <phi(w), 1> + 1/2 k_s |(delta - g - w)_+|² - (F / dA) delta

with ``<a, b>`` the sum over cells. Every term is convex in (w, delta) jointly, so there is one minimiser, and the
Hessian in both unknowns is positive definite: one CG solves for the step in w and in delta together. It is piecewise
smooth (the contact set), so Newton is semismooth and ends in a few full steps once that set settles.

Where the penalty k_s is a numerical means and no property of the skin, its penetration is corrected: the gap is lowered
by p/k_s and the energy minimised again (method of multipliers; Hestenes 1969, Powell 1969). Every pass leaves a share
K/(K + k_s) of the penetration; a stiffer penalty would cost iterations with the root of its stiffness.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.rigs.twin.contact.media import LowModes, Medium

TOLERANCE = 1e-6
"""Largest relative residual of a solution that is returned."""
ROUGH_TOLERANCE = 1e-3
"""Largest relative residual of all passes but the last; their pressures only lower the gap of the next pass."""
MAX_STEPS = 40
"""Number of Newton steps after which an error is raised; hard cases take up to 25 steps from the unloaded skin."""
_ARMIJO = 1e-4
_HALVINGS = 12
_EPS = float(np.finfo(np.float64).eps)
_BALANCED = 1e-12
"""Largest relative error of the force balance: the rounding of a sum over thousands of cells."""


@dataclass(frozen=True)
class Solution:
    """Solved state of the skin under one load."""

    vector: FloatArray
    """(size + 1,) Fourier coefficients of the deflection (none in a closed form) and, last, the approach [mm]."""
    deflection_mm: FloatArray
    """(nx, ns) deflection of the skin."""
    pressure_mpa: FloatArray
    """(nx, ns) contact pressure."""
    residual: float
    """Residual of the field equation relative to the load; the force balance holds to rounding."""

    @property
    def depth_mm(self) -> float:
        """Approach of the indenter from its first touch of the unloaded skin."""
        return float(self.vector[-1])


class NewtonSolver:
    """Solver of the contact of one medium through one (nx, ns) gap at zero approach."""

    def __init__(self, medium: Medium, gap_mm: FloatArray) -> None:
        self.medium = medium
        self.gap_mm = gap_mm
        self._gap = gap_mm
        self._spectrum = medium.spectrum
        self._k = medium.contact_stiffness
        self._diagonal = self._spectrum.diagonal(medium.stiffness)
        self._precondition = Preconditioner(medium)
        shape = self._spectrum.shape
        self._lift = np.empty(shape)
        self._tangent = np.empty(shape)
        self._contact = np.empty(shape)
        self._pressure = np.empty(shape)
        self._product = np.empty(self._spectrum.size + 1)

    def start(self, force_n: float) -> FloatArray:
        """Return the vector of the unloaded skin with the indenter just touching: a first guess for `force_n`."""
        vector = np.zeros(self._spectrum.size + 1)
        # The depth of a single cell, never more than the answer: a piconewton does not start from 1e10 times its depth.
        # From 0.02 mm on the guess would leave the contact's shape behind.
        single = force_n / (self._spectrum.area_mm2 * self._k)
        vector[-1] = float(self.gap_mm.min()) + min(0.02, single)
        return vector

    def solve(self, force_n: float, guess: FloatArray | None = None, *, tolerance: float = TOLERANCE) -> Solution:
        """Return the skin under `force_n` newtons.

        Parameters
        ----------
        force_n
            Positive normal force.
        guess
            State of a neighbouring load (its ``vector``).
        tolerance
            Largest relative residual. Where rounding of the equations' terms is larger, a residual up to
            :data:`TOLERANCE` is accepted; the solution states it.

        Raises
        ------
        RigError
            If the residual stays above both limits.
        """
        if not force_n > 0 or not math.isfinite(force_n):
            raise RigError(
                f"The contact solver was given a force of {force_n!r} N; a finite force above 0 N is expected.",
                hint="Leave the solver out at 0 N: the skin is at rest.",
            )
        self._gap = self.gap_mm
        updates = self.medium.contact_updates
        # A multiplier need not be known better than the next pass corrects it.
        first = max(tolerance, ROUGH_TOLERANCE) if updates else tolerance
        found = self._minimised(force_n, self.start(force_n) if guess is None else guess, first)
        for last in range(updates - 1, -1, -1):
            self._gap = self.gap_mm - found.pressure_mpa / self._k
            found = self._minimised(force_n, found.vector, first if last else tolerance)
        return found

    def _minimised(self, force_n: float, guess: FloatArray, tolerance: float) -> Solution:
        """Return the state of least energy for the present gap; raises RigError if `tolerance` is missed."""
        load = force_n / self._spectrum.area_mm2
        vector = guess.copy()
        energy, gradient = self._evaluate(vector, load)
        residual = self._residual(gradient, load)
        for steps in range(MAX_STEPS + 1):
            if residual < max(tolerance, min(self._rounding(vector, load), TOLERANCE)):
                return self._solution(force_n, vector, residual)
            if steps == MAX_STEPS:
                break
            if not self._contact.any():
                # Without contact the energy is straight in the approach: no curvature, and no Newton step.
                vector[-1], _ = self._balanced(vector, load)
                energy, gradient = self._evaluate(vector, load)
                residual = self._residual(gradient, load)
            stiffness = self._tangent + self._contact
            self._precondition.update(stiffness, self._contact)
            # Solve each linear system only as well as this Newton step can use: its own error is of second order.
            # Far from the solution, at loads of nanonewtons above all, the contact set goes astray on loose steps.
            least = 1e-3 if residual < 0.1 else 1e-4
            forcing = min(0.05, max(0.3 * tolerance / residual, least))
            step = self._conjugate_gradients(gradient, stiffness, forcing)
            slope = float(gradient @ step)
            size = 1.0
            for _ in range(_HALVINGS):
                trial = vector + size * step
                trial_energy, trial_gradient = self._evaluate(trial, load)
                trial_residual = self._residual(trial_gradient, load)
                # Near the solution, and at loads of nanonewtons, the energy's change drowns in its rounding while
                # the gradient is still accurate: a step that halves the residual is taken as well.
                if trial_energy <= energy + _ARMIJO * size * slope or trial_residual < 0.5 * residual:
                    break
                size /= 2
            vector, energy, gradient, residual = trial, trial_energy, trial_gradient, trial_residual
        raise RigError(
            f"The contact solver left a residual of {residual:.1e} at {force_n:g} N after {MAX_STEPS} Newton steps; "
            f"at most {tolerance:.0e} is allowed.",
            hint="Check the skin's parameters: moduli and stiffnesses must be positive and of sensible size.",
        )

    def _evaluate(self, vector: FloatArray, load: float) -> tuple[float, FloatArray]:
        """Return energy and gradient; store contact pressure, contact stiffness and tangent as attributes."""
        spectrum, coefficients, delta = self._spectrum, vector[:-1], float(vector[-1])
        deflection = spectrum.field(coefficients)
        lift = self._lift
        np.add(self._gap, deflection, out=lift)
        np.subtract(delta, lift, out=lift)
        np.multiply(lift > 0, self._k, out=self._contact)
        np.multiply(lift, self._contact, out=self._pressure)
        local_pressure, local_energy = self.medium.respond(deflection, self._tangent)
        stiff = self._diagonal * coefficients
        gradient = np.empty(vector.size)
        local_pressure -= self._pressure
        np.add(stiff, spectrum.of(local_pressure), out=gradient[:-1])
        if self.medium.zero_mean:
            gradient[0] = 0.0
        gradient[-1] = self._pressure.sum() - load
        pressed = self._pressure.reshape(-1)
        energy = (
            0.5 * float(stiff @ coefficients) + local_energy + 0.5 * float(pressed @ pressed) / self._k - load * delta
        )
        return energy, gradient

    def _residual(self, gradient: FloatArray, load: float) -> float:
        field = gradient[:-1]
        return (abs(float(gradient[-1])) + math.sqrt(float(field @ field))) / load

    def _rounding(self, vector: FloatArray, load: float) -> float:
        """Return the share of the residual, relative to the load, that is rounding error at the state last evaluated.

        Terms that round: the skin's stiffness times its deflection, the contact pressure, and the larger terms whose
        difference this pressure is, the contact stiffness times the approach and times gap plus deflection.
        A fast transform of n numbers rounds by about eps log2 n of their norm (Gentleman and Sande 1966).
        """
        stiff = self._diagonal * vector[:-1]
        touched = int(np.count_nonzero(self._contact))
        apart = 2 * self._k * math.sqrt(touched) * abs(float(vector[-1]))
        pressed = self._pressure.reshape(-1)
        terms = math.sqrt(float(stiff @ stiff)) + math.sqrt(float(pressed @ pressed)) + apart
        return _EPS * math.log2(vector.size) * (terms + load) / load

    def _balanced(self, vector: FloatArray, load: float) -> tuple[float, FloatArray]:
        """Return the approach at which the contact carries `load` on an unmoved skin, and the (nx, ns) overlap there.

        The load is a convex, piecewise linear function of the approach: a few Newton steps on one number balance it to
        rounding, whatever their start.
        """
        surface = self._gap + self._spectrum.field(vector[:-1])
        approach = float(vector[-1])
        if not approach > float(surface.min()):
            approach = float(surface.min()) + load / self._k
        for _ in range(_HALVINGS):
            lift = np.maximum(approach - surface, 0.0)
            touched = np.count_nonzero(lift)
            lacking = load - self._k * float(lift.sum())
            if abs(lacking) <= _BALANCED * load or not touched:
                break
            approach += lacking / (self._k * touched)
        return approach, lift

    def _multiply(self, direction: FloatArray, stiffness: FloatArray) -> FloatArray:
        """Return the Hessian times `direction`: the tangent stiffness, bordered by the approach."""
        out, approach = self._product, float(direction[-1])
        field = self._spectrum.field(direction[:-1])
        out[-1] = self._coupling * approach - float(self._contact.reshape(-1) @ field.reshape(-1))
        field *= stiffness
        field -= approach * self._contact
        np.multiply(self._diagonal, direction[:-1], out=out[:-1])
        out[:-1] += self._spectrum.of(field)
        if self.medium.zero_mean:
            out[0] = 0.0
        return out

    def _conjugate_gradients(self, gradient: FloatArray, stiffness: FloatArray, forcing: float) -> FloatArray:
        """Return the Newton step for `gradient`, to a residual of `forcing` in the preconditioner's norm.

        The iteration ends early, with the step so far, at a direction along which the energy's curvature is no more
        than rounding error: the step length there is undetermined, and the division by the curvature would overflow.
        """
        self._coupling = float(self._contact.sum())
        step = np.zeros_like(gradient)
        remainder = -gradient
        conditioned = self._precondition(remainder)
        direction = conditioned.copy()
        rho = float(remainder @ conditioned)
        goal = rho * forcing**2
        expected = rho  # the curvature along `direction` if the preconditioner were the Hessian's inverse
        if not rho > 0:
            return step
        for _ in range(300):
            product = self._multiply(direction, stiffness)
            curvature = float(direction @ product)
            if not curvature > _EPS * expected:
                break
            alpha = rho / curvature
            step += alpha * direction
            remainder -= alpha * product
            conditioned = self._precondition(remainder)
            rho_next = float(remainder @ conditioned)
            if rho_next <= goal:
                break
            direction *= rho_next / rho
            direction += conditioned
            expected = rho_next + (rho_next / rho) ** 2 * expected
            rho = rho_next
        return step

    def _solution(self, force_n: float, vector: FloatArray, residual: float) -> Solution:
        """Return the converged state, with an approach that balances the force exactly.

        `residual` sums the errors of both equations, so that the field equation's own error stays below it.
        """
        vector = vector.copy()
        vector[-1], lift = self._balanced(vector, force_n / self._spectrum.area_mm2)
        return Solution(
            vector=vector,
            deflection_mm=self._spectrum.field(vector[:-1]),
            pressure_mpa=self._k * lift,
            residual=residual,
        )


class Preconditioner:
    """Approximate inverse of the Hessian in deflection and approach, with ``medium.low_modes`` exact pairs of modes.

    A skin is stiff against short waves, so the contact's varying stiffness matters for long waves only. The few long
    waves and the approach form a small dense matrix, factorised once per Newton step; for all other modes the diagonal
    of the Hessian is used.
    """

    def __init__(self, medium: Medium) -> None:
        from scipy.linalg import lapack

        self._lapack: Any = lapack
        self._medium = medium
        self._spectrum = medium.spectrum
        self._low = LowModes(medium.spectrum, medium.stiffness, count=medium.low_modes, zero_mean=medium.zero_mean)
        size = self._low.size
        self._matrix = np.empty((size + 1, size + 1), order="F")
        self._right = np.empty(size + 1)
        self._diagonal = self._spectrum.diagonal(medium.stiffness)
        self._inverse = np.empty_like(self._diagonal)
        self._out = np.empty(self._diagonal.size + 1)

    def update(self, stiffness: FloatArray, contact: FloatArray) -> None:
        """Adapt to a (nx, ns) tangent stiffness, of which `contact` is the indenter's part."""
        size, matrix = self._low.size, self._matrix
        self._low.matrix(stiffness, matrix)
        coupling = self._low.take(self._spectrum.of(contact))
        total = float(contact.sum())
        matrix[size, :size] = -coupling
        matrix[:size, size] = -coupling
        # A floor for the approach: without contact its own stiffness would vanish.
        matrix[size, size] = total * (1 + 1e-12) + 1e-6 * self._medium.contact_stiffness
        self._factor, _ = self._lapack.dpotrf(matrix, lower=1, clean=0)
        # Stiff modes are short waves: they live where the local stiffness is large, so its mean is too little for them.
        np.add(self._diagonal, 2.0 * float(stiffness.mean()), out=self._inverse)
        np.reciprocal(self._inverse, out=self._inverse)

    def __call__(self, vector: FloatArray) -> FloatArray:
        """Return the approximate inverse times a (size + 1,) vector; the next call overwrites the returned array."""
        out, right = self._out, self._right
        np.multiply(self._inverse, vector[:-1], out=out[:-1])
        right[:-1] = self._low.take(vector)
        right[-1] = vector[-1]
        solution, _ = self._lapack.dpotrs(self._factor, right, lower=1)
        self._low.put(solution[:-1], out)
        out[-1] = solution[-1]
        if self._medium.zero_mean:
            out[0] = 0.0
        return out
