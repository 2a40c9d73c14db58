"""Preconditioner of the conjugate gradients: soft modes solved exactly, stiff ones by their diagonal.

A skin is stiff against short waves, so the contact's varying stiffness matters for long waves only. These few modes,
together with the approach, form a small dense matrix that is factorised once per Newton step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.contact.media import Medium
from tactbench.rigs.twin.contact.spectrum import LowModes


class Preconditioner:
    """Approximate inverse of the Hessian in deflection and approach, with ``medium.low_modes`` exact pairs of modes."""

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
        # A floor for the approach alone: without contact its own stiffness would vanish.
        matrix[size, size] = total * (1 + 1e-12) + 1e-6 * self._medium.contact_stiffness
        self._factor, _ = self._lapack.dpotrf(matrix, lower=1, clean=0)
        # Stiff modes are short waves: they live where the local stiffness is large, so its mean is too little for them.
        np.add(self._diagonal, 2.0 * float(stiffness.mean()), out=self._inverse)
        np.reciprocal(self._inverse, out=self._inverse)

    def __call__(self, vector: FloatArray) -> FloatArray:
        """Return the approximate inverse times a flat (size + 1,) vector; the result is overwritten by the next."""
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
