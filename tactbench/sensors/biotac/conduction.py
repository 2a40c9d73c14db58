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

The rims of the discs are modelled more finely than the cells of the conduction grid. Under a disc the potential obeys
``div(h grad phi) = kappa (phi - V)`` with ``kappa = 3/h + 4/(pi a)``: it nears the disc's own over the length ``lambda
= sqrt(h / kappa)``, which under a closed film is a fifth of a cell. A cell covered in part would then count as fully
covered, and the disc would grow with the cell size.

So cells belong to a disc by their centres, and the plane solution across a straight rim, ``phi - V = q n.r / h``
outside and ``(q / h) lambda exp(n.r / lambda)`` inside (up to ``lambda``'s own shift), is built into the
conductances: a face across the rim, ``t`` of whose length is outside, conducts ``h w / (t + (lambda / n) (1 -
exp(-(D - t) n / lambda)))``, and a cell inside beside the rim takes the current that makes this solution balance. Both
tend to plain area weighting for thick films and to a fixed potential on the rim itself for closed films.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, RigError

_AXIS, _SIGN = np.array([0, 0, 1, 1]), np.array([[-1], [1], [-1], [1]])
"""Axis (0: x, 1: s) and direction (-1, 1) of a cell's four faces."""
_MOST_DECAYS = 9.0
"""Distance inside the rim, in decay lengths, beyond which a cell counts as connected without resistance."""
_LEAST_WAY = 0.02
"""Least distance between a cell's centre and the rim, as a share of a cell."""
_GRAZING = 1e-3
"""Smallest cosine between a face's direction and the rim's normal: 1/n would overflow for a face along the rim."""
_THICK = 1e4
"""Decay length [mm] at which connections are proportional to area: for comparison with the discs' true areas."""


class Disc(NamedTuple):
    """A round electrode or excitation on the core, with its place in the grid's coordinates."""

    x_mm: float
    s_mm: float
    radius_mm: float
    """Radius in true lengths on the film."""
    stretch: tuple[float, float] = (1.0, 1.0)
    """Ratios of lengths on the film to lengths on the grid, along x and s, at the disc."""


class RimmedDiscs:
    """Electrodes and excitations as discs with rims, on the conduction grid of (nx,), (ns,) cell centres.

    Raises
    ------
    RigError
        If no cell has its centre under a disc.
    """

    def __init__(self, x_mm: FloatArray, s_mm: FloatArray, electrodes: Sequence[Disc], excitation: Sequence[Disc]):
        self.count = len(electrodes)
        cell = (float(x_mm[1] - x_mm[0]), float(s_mm[1] - s_mm[0]))
        discs = [*electrodes, *excitation]
        found = []
        for number, disc in enumerate(discs):
            along, across = (x_mm - disc.x_mm) * disc.stretch[0], (s_mm - disc.s_mm) * disc.stretch[1]
            i, j = np.nonzero(along[:, None] ** 2 + across[None, :] ** 2 < disc.radius_mm**2)
            if i.size == 0:
                raise RigError(
                    f"An electrode of {disc.radius_mm:g} mm at {disc.x_mm:.2f}, {disc.s_mm:.2f} mm covers no cell of "
                    f"a conduction grid of {cell[0]:.2f} x {cell[1]:.2f} mm.",
                    hint="Correct the sensor's electrode positions or its SkinSheet, or use more cells.",
                )
            found.append((np.full(i.size, number), np.stack([i, j]), np.stack([along[i], across[j]])))
        whose, place, offset = (np.concatenate(parts, axis=-1) for parts in zip(*found, strict=True))
        self._radius = np.array([disc.radius_mm for disc in discs])[whose]
        # Of each cell, as large as its disc's own stretch makes it.
        step = np.array(cell)[:, None] * np.array([disc.stretch for disc in discs])[whose].T
        self._area = step[0] * step[1]
        self._cell = place[0] * s_mm.size + place[1]
        electrode = whose < self.count
        self.owner, self.under = whose[electrode], self._cell[electrode]
        self._driven = self._cell[~electrode]
        self._rims(offset, place, step, np.array([[x_mm.size], [s_mm.size]]))
        plain = self._area.copy()
        plain[self._beside] = self._beside_rim(np.full(self._beside.size, _THICK)) * _THICK**2
        true_area = np.array([np.pi * disc.radius_mm**2 for disc in discs])
        # A staircase of cells has the disc's area only roughly.
        self._scale = (true_area / np.bincount(whose, weights=plain))[whose]

    def _rims(
        self, offset: FloatArray, place: npt.NDArray[np.intp], step: FloatArray, shape: npt.NDArray[np.intp]
    ) -> None:
        """Find the faces that cross a rim, and the straight rim assumed at each cell beside one; all are (4, cells)."""
        distance = np.maximum(np.hypot(*offset), 1e-9)
        outward = _SIGN * (offset / distance)[_AXIS]
        reach, width = step[_AXIS], step[1 - _AXIS]
        beyond, sideways = offset[_AXIS] + _SIGN * reach, offset[1 - _AXIS]
        there = place[_AXIS] + _SIGN
        # At the sheet's insulated edge there is no face.
        exists = (there >= 0) & (there < shape[_AXIS])
        crossing = (beyond**2 + sideways**2 >= self._radius**2) & exists
        rim = np.sqrt(np.maximum(self._radius**2 - sideways**2, 0.0))
        way = np.clip(_SIGN * beyond - rim, _LEAST_WAY * reach, reach)
        slope = np.maximum(outward, _GRAZING)
        self._crossed = []
        for axis in (0, 1):
            rows, crossed = slice(2 * axis, 2 * axis + 2), crossing[2 * axis : 2 * axis + 2]
            _, inner = np.nonzero(crossed)
            # A face has the number of the cell before it; those along s have a column less.
            first = place[:, None, :] - np.eye(2, dtype=int)[axis][:, None, None] * (_SIGN[rows] < 0)
            face = first[0] * (shape[1] - axis) + first[1]
            self._crossed.append((face[crossed], inner, *(part[rows][crossed] for part in (reach, slope, way))))
        self._beside = beside = np.flatnonzero(crossing.any(axis=0))
        self._crossing, self._exists = crossing[:, beside], exists[:, beside]
        self._depth = (self._radius - distance)[beside]
        self._outward, self._width, self._reach = outward[:, beside], width[:, beside], reach[:, beside]

    def _decay(self, film: FloatArray, cells: npt.NDArray[np.intp] | slice = slice(None)) -> FloatArray:
        """Return the decay length ``lambda`` [mm] for film thicknesses at the discs' cells."""
        return np.asarray(film / np.sqrt(3.0 + (4.0 / np.pi) * film / self._radius[cells]))

    def _beside_rim(self, decay: FloatArray) -> FloatArray:
        """Return the conductances over film thickness of cells beside a rim that balance the plane solution there."""
        entering = self._outward * (self._width / decay) * np.exp(np.minimum(self._depth / decay, _MOST_DECAYS))
        passing = (self._width / self._reach) * np.expm1(np.minimum(self._outward * self._reach / decay, _MOST_DECAYS))
        return np.asarray(np.maximum((np.where(self._crossing, entering, passing) * self._exists).sum(axis=0), 0.0))

    def joints(self, film_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return conductances over sigma from cells to electrodes (shape of `owner`) and to excitations (nx*ns,)."""
        flat = film_mm.reshape(-1)
        film = flat[self._cell]
        decay = self._decay(film)
        joint = film * (self._area / decay**2)
        beside = self._beside
        joint[beside] = film[beside] * self._beside_rim(decay[beside])
        joint *= self._scale
        drive = np.zeros(flat.size)
        np.add.at(drive, self._driven, joint[self.owner.size :])
        return joint[: self.owner.size], drive

    def narrow(self, film_mm: FloatArray, along_x: FloatArray, along_s: FloatArray) -> None:
        """Raise, in place, the (nx-1, ns) and (nx, ns-1) conductances of faces across a rim: their path is shorter."""
        flat = film_mm.reshape(-1)
        for (face, inner, step, slope, way), conductance in zip(self._crossed, (along_x, along_s), strict=True):
            decay = self._decay(flat[self._cell[inner]], inner)
            inside = (decay / slope) * -np.expm1(-(step - way) * slope / decay)
            conductance.reshape(-1)[face] *= step / np.maximum(way + inside, _LEAST_WAY * step)


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
        return np.linalg.inv(np.diag(sums) - half.T @ half)


def _logarithmic_mean(one: FloatArray, other: FloatArray, log_ratio: FloatArray) -> FloatArray:
    """Return ``(b - a) / ln(b/a)`` of two arrays; by a series where the difference of logarithms would cancel."""
    near = np.abs(log_ratio) < 1e-3
    log_ratio[near] = 1.0
    mean = (other - one) / log_ratio
    a, b = one[near], other[near]
    # (a+b)/2 (1 - d²/12) with d = ln(b/a) ~ 2 (b-a)/(a+b): next term of order d^4, 1e-12.
    half = (a + b) / 2
    mean[near] = half - (b - a) ** 2 / (12 * half)
    return mean
