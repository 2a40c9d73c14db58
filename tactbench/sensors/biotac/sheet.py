"""Computation of the electric resistances between disc electrodes under a thin conducting film.

The potential, averaged over the film's depth h, obeys ``div(sigma h grad phi) = 0`` with insulated edges. Finite
volumes: a face conducts with the logarithmic mean of its two cells, ``(h2 - h1) / ln(h2 / h1)``, which is exact where
the film is straight between their centres; beside a closed film, where h changes several times within a cell, the
harmonic mean is a third too small. Electrodes and excitations are equipotential contacts: cell k under contact e is
joined to it by about ``sigma A_ke (3/h_k + 4/(pi a))``, A_ke the overlap, a the disc's radius.

The first term is the exact depth average of a film fed from one face, right for h << a; by itself it would let a
*thinner* film conduct *better* into a small disc (for h^2 > 1.5 a^2 ln(r/a)), which no conductor does. The second is
the disc on a half-space, 1/(4 sigma a). Their sum agrees with the method of images for a disc on a slab,
``R = 1/(4 sigma a) + (ln(r/(4h)) + gamma) / (2 pi sigma h)``, within 2 % of 1/(4 sigma a) for h > 1.2 a.

Electrodes are read one at a time: an electrode's resistance is the one between it and all excitations while the others
carry no current, ``Z_ee``, the diagonal of the resistance matrix. One factorisation eliminates the cells,
``Z = (D - Bᵀ C⁻¹ B)⁻¹`` with C the cells' own matrix, B the joints and D their sums by electrode, and gives all
electrodes at once. All conductances are divided by sigma.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.sensors.biotac.rims import RimmedDiscs


class Faces(NamedTuple):
    """Conductances of the faces between cells at unit thickness: width over distance of the cells' centres."""

    along_x: FloatArray
    """(nx-1, ns) conductances between neighbours along x."""
    along_s: FloatArray
    """(nx, ns-1) conductances between neighbours along the arc s."""


def faces_between(corners_mm: FloatArray) -> Faces:
    """Return the faces between cells of a curved film, given the (nx+1, ns+1, 3) corners of the cells."""
    centres = (corners_mm[:-1, :-1] + corners_mm[1:, :-1] + corners_mm[:-1, 1:] + corners_mm[1:, 1:]) / 4
    across, along = (np.linalg.norm(np.diff(corners_mm, axis=axis), axis=-1) for axis in (1, 0))
    apart = [np.linalg.norm(np.diff(centres, axis=axis), axis=-1) for axis in (0, 1)]
    return Faces(across[1:-1] / apart[0], along[:, 1:-1] / apart[1])


class FilmSheet:
    """A film over electrodes on one grid, with the faces between its cells; `resistances` for any thickness."""

    def __init__(self, faces: Faces, contacts: RimmedDiscs) -> None:
        self._faces, self._contacts = faces, contacts

    def resistances(self, film_mm: FloatArray) -> FloatArray:
        """Return the (n_electrodes, n_electrodes) resistances times sigma under a (nx, ns) film, in 1/mm.

        Entry (i, j) is the potential of electrode i while a unit of current enters at electrode j and leaves by the
        grounded excitations.

        Raises
        ------
        RigError
            If the film is not positive and finite, or no current reaches the excitation.
        """
        if not np.isfinite(film_mm).all() or film_mm.min() <= 0.0:
            raise RigError(
                f"The film's thickness must be finite and positive; its smallest value is {film_mm.min():g} mm.",
                hint="Check the skin's residual_film and the contact solver's residual.",
            )
        from scipy.linalg import lapack

        log = np.log(film_mm)
        along_x = self._faces.along_x * _logarithmic_mean(film_mm[:-1], film_mm[1:], log[1:] - log[:-1])
        along_s = self._faces.along_s * _logarithmic_mean(film_mm[:, :-1], film_mm[:, 1:], log[:, 1:] - log[:, :-1])
        contacts = self._contacts
        contacts.narrow(film_mm, along_x, along_s)
        joints, drive = contacts.joints(film_mm)
        nx, ns = film_mm.shape
        # Below the diagonal of the cells' matrix, row by row of the film: the neighbour along s, and along x.
        banded = np.zeros((nx * ns, ns + 1))
        by_cell = banded.reshape(nx, ns, ns + 1)
        diagonal = by_cell[:, :, 0]
        diagonal += (drive + np.bincount(contacts.under, weights=joints, minlength=film_mm.size)).reshape(nx, ns)
        diagonal[1:] += along_x
        diagonal[:-1] += along_x
        diagonal[:, 1:] += along_s
        diagonal[:, :-1] += along_s
        by_cell[:, :-1, 1] -= along_s
        by_cell[:-1, :, ns] -= along_x
        joined = np.zeros((nx * ns, contacts.count), order="F")
        np.add.at(joined, (contacts.under, contacts.owner), joints)
        factor, failed = lapack.dpbtrf(banded.T, lower=1, overwrite_ab=1)
        if not failed:
            half, failed = lapack.dtbtrs(factor, joined, uplo="L")
        if failed:
            raise RigError(
                "No current of an electrode reaches the excitation through this film.",
                hint="Check the excitation's places, the skin's residual_film and the contact solver's residual.",
            )
        sums = np.bincount(contacts.owner, weights=joints, minlength=contacts.count)
        return np.asarray(np.linalg.inv(np.diag(sums) - half.T @ half), np.float64)


def _logarithmic_mean(one: FloatArray, other: FloatArray, log_ratio: FloatArray) -> FloatArray:
    """Return ``(b - a) / ln(b/a)`` of two arrays; by a series where the difference of logarithms would cancel."""
    near = np.abs(log_ratio) < 1e-3
    log_ratio[near] = 1.0
    mean = (other - one) / log_ratio
    a, b = one[near], other[near]
    # (a+b)/2 (1 - d²/12) with d = ln(b/a) ~ 2 (b-a)/(a+b): next term of order d^4, 1e-12.
    half = (a + b) / 2
    mean[near] = half - (b - a) ** 2 / (12 * half)
    return np.asarray(mean)
