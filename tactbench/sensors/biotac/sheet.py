"""Conduction in a thin film between disc electrodes.

The potential, averaged over the film's depth h, obeys ``div(sigma h grad phi) = 0`` with insulated edges. Finite
volumes: a face conducts with the logarithmic mean of its two cells, ``(h2 - h1) / ln(h2 / h1)``, which is exact where
the film is straight between their centres; beside a closed film, where h changes several times within a cell, the
harmonic mean is a third too small. Electrodes and excitations are equipotential contacts: cell k under contact e is
joined to it by about ``sigma A_ke (3/h_k + 4/(pi a))``, A_ke the overlap, a the disc's radius.

The first term is the exact depth average of a film fed from one face, right for h << a; alone it would let a
*thinner* film conduct *better* into a small disc (for h^2 > 1.5 a^2 ln(r/a)), which no conductor does. The second is
the disc on a half-space, 1/(4 sigma a). Their sum agrees with the method of images for a disc on a slab,
``R = 1/(4 sigma a) + (ln(r/(4h)) + gamma) / (2 pi sigma h)``, within 2 % of 1/(4 sigma a) for h > 1.2 a.

Electrodes are read one at a time: an electrode's resistance is the one between it and all excitations while the others
carry no current, ``Z_ee``, the diagonal of the resistance matrix. Cells eliminated by one factorisation,
``Z = (D - Bᵀ C⁻¹ B)⁻¹`` with C the cells' own matrix, B the joints and D their sums by electrode: all electrodes for
the price of one. Everything is divided by sigma.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, RigError
from tactbench.sensors.biotac.discs import Contacts


class Faces(NamedTuple):
    """What the faces between cells conduct at unit thickness: their width over the distance of their cells' centres."""

    along_x: FloatArray
    """(nx-1, ns)"""
    along_s: FloatArray
    """(nx, ns-1)"""


def flat_faces(shape: tuple[int, int], cell_mm: tuple[float, float]) -> Faces:
    """Return the faces of equal rectangles."""
    (nx, ns), (dx, ds) = shape, cell_mm
    return Faces(np.full((nx - 1, ns), ds / dx), np.full((nx, ns - 1), dx / ds))


def faces_between(corners_mm: FloatArray) -> Faces:
    """Return the faces between cells of a curved film, given the (nx+1, ns+1, 3) corners of the cells."""
    centres = (corners_mm[:-1, :-1] + corners_mm[1:, :-1] + corners_mm[:-1, 1:] + corners_mm[1:, 1:]) / 4
    across, along = (np.linalg.norm(np.diff(corners_mm, axis=axis), axis=-1) for axis in (1, 0))
    apart = [np.linalg.norm(np.diff(centres, axis=axis), axis=-1) for axis in (0, 1)]
    return Faces(across[1:-1] / apart[0], along[:, 1:-1] / apart[1])


class FilmSheet:
    """A film over electrodes on one grid; `resistances` for any thickness.

    Parameters
    ----------
    faces
        Of the cells, in the film's metric.
    contacts
        Electrodes and excitation on the cells.
    """

    def __init__(self, faces: Faces, contacts: Contacts) -> None:
        self.shape = (faces.along_s.shape[0], faces.along_x.shape[1])
        self._faces, self._contacts = faces, contacts
        # Elimination goes along the longer side: its cost grows with the square of the shorter one.
        self._turned = self.shape[1] > self.shape[0]
        self._order = self.shape[::-1] if self._turned else self.shape
        row, column = np.divmod(contacts.under, self.shape[1])
        self._cell = column * self.shape[0] + row if self._turned else contacts.under

    def resistances(self, film_mm: FloatArray) -> FloatArray:
        """Return the (n_electrodes, n_electrodes) resistances times sigma under `film_mm`, in 1/mm.

        Entry (i, j): the potential of electrode i, the excitations grounded, while a unit of current enters at j and
        leaves by the excitations.

        Parameters
        ----------
        film_mm
            (nx, ns) thickness, positive everywhere.

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
        diagonal, along, across, joints, sums = self._system(film_mm)
        rows, width = self._order
        middle = rows // 2
        # Both halves towards the row between them: an electrode's own current is followed half as far.
        separator, gathered = np.diag(diagonal[middle]), self._at(joints, middle * width, width)
        inner = np.arange(width - 1)
        separator[inner, inner + 1] = separator[inner + 1, inner] = -across[middle]
        coupled = np.zeros((sums.size, sums.size))
        for half, reverse in ((slice(0, middle), False), (slice(middle + 1, rows), True)):
            if half.start >= half.stop:
                continue
            own = [diagonal[half], along[half.start : half.stop - 1], across[half]]
            link = along[middle if reverse else middle - 1]
            right = self._at(joints, half.start * width, (half.stop - half.start) * width)
            if reverse:
                own, link, right = [part[::-1, ::-1] for part in own], link[::-1], right[::-1]
            factor = _factorised(*own)
            right = _forward(factor, right)
            coupled += right.T @ right
            # Of the elimination only the last row touches the separator.
            edge = _last_block(factor, width) * link
            passed, lost = edge.T @ right[-width:], edge.T @ edge
            separator -= lost[::-1, ::-1] if reverse else lost
            gathered += passed[::-1] if reverse else passed
        try:
            lower = np.linalg.cholesky(separator)
            crossed = np.linalg.solve(lower, gathered)
            found: FloatArray = np.asarray(np.linalg.inv(np.diag(sums) - coupled - crossed.T @ crossed), np.float64)
        except np.linalg.LinAlgError as error:
            raise _unsolved() from error
        return found

    def _at(self, joints: FloatArray, first: int, count: int) -> FloatArray:
        """Return the (count, n_electrodes) joints of `count` cells in elimination order from `first`."""
        dense = np.zeros((count, self._contacts.count), order="F")
        inside = (self._cell >= first) & (self._cell < first + count)
        np.add.at(dense, (self._cell[inside] - first, self._contacts.owner[inside]), joints[inside])
        return dense

    def _system(self, film_mm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return diagonal, faces along and across the elimination, joints and their sums by electrode."""
        log = np.log(film_mm)
        along_x = self._faces.along_x * _logarithmic_mean(film_mm[:-1], film_mm[1:], log[1:] - log[:-1])
        along_s = self._faces.along_s * _logarithmic_mean(film_mm[:, :-1], film_mm[:, 1:], log[:, 1:] - log[:, :-1])
        self._contacts.narrow(film_mm, along_x, along_s)
        joints, drive = self._contacts.joints(film_mm)
        joined = np.bincount(self._contacts.under, weights=joints, minlength=film_mm.size)
        diagonal: FloatArray = np.asarray(drive + joined, np.float64).reshape(self.shape)
        diagonal[1:] += along_x
        diagonal[:-1] += along_x
        diagonal[:, 1:] += along_s
        diagonal[:, :-1] += along_s
        owned = np.bincount(self._contacts.owner, weights=joints, minlength=self._contacts.count)
        sums: FloatArray = np.asarray(owned, np.float64)
        if self._turned:
            return diagonal.T, along_s.T, along_x.T, joints, sums
        return diagonal, along_x, along_s, joints, sums


def _factorised(diagonal: FloatArray, along: FloatArray, across: FloatArray) -> npt.NDArray[np.float64]:
    """Return the banded Cholesky factor of rows of cells, one row after another."""
    from scipy.linalg import lapack

    rows, width = diagonal.shape
    banded = np.zeros((rows * width, width + 1))
    banded[:, 0] = diagonal.ravel()
    by_row = banded.reshape(rows, width, width + 1)
    by_row[:, :-1, 1] -= across
    by_row[:-1, :, width] -= along
    factor, failed = lapack.dpbtrf(banded.T, lower=1, overwrite_ab=1)
    if failed:
        raise _unsolved()
    return np.asarray(factor)


def _forward(factor: npt.NDArray[np.float64], right: FloatArray) -> FloatArray:
    """Return the factor's inverse times each column, begun at the column's first entry; zero columns stay."""
    from scipy.linalg import lapack

    out = np.zeros(right.shape, order="F")
    for column in range(right.shape[1]):
        entries = np.flatnonzero(right[:, column])
        if entries.size:
            first = int(entries[0])
            found, _ = lapack.dtbtrs(factor[:, first:], right[first:, column : column + 1], uplo="L")
            out[first:, column] = found[:, 0]
    return out


def _last_block(factor: npt.NDArray[np.float64], width: int) -> FloatArray:
    """Return the (width, width) inverse of the factor's last block."""
    from scipy.linalg import lapack

    lower = np.zeros((width, width), order="F")
    for below in range(width):
        np.fill_diagonal(lower[below:], factor[below, factor.shape[1] - width : factor.shape[1] - below])
    found, _ = lapack.dtrtri(lower, lower=1)
    return np.asarray(found)


def _unsolved() -> RigError:
    return RigError(
        "No current of an electrode reaches the excitation through this film.",
        hint="Check the excitation's places, the skin's residual_film and the contact solver's residual.",
    )


def _logarithmic_mean(one: FloatArray, other: FloatArray, log_ratio: FloatArray) -> FloatArray:
    """Return ``(b - a) / ln(b/a)``; by its series where the difference of logarithms would cancel."""
    near = np.abs(log_ratio) < 1e-3
    log_ratio[near] = 1.0
    mean = (other - one) / log_ratio
    a, b = one[near], other[near]
    # (a+b)/2 (1 - d²/12) with d = ln(b/a) ~ 2 (b-a)/(a+b): next term of order d^4, 1e-12.
    half = (a + b) / 2
    mean[near] = half - (b - a) ** 2 / (12 * half)
    return np.asarray(mean)
