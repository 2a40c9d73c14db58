"""Conduction in a thin film between disc electrodes.

The potential, averaged over the film's depth h, obeys ``div(sigma h grad phi) = 0`` with insulated edges. Finite
volumes: a face conducts with the logarithmic mean of its two cells, ``(h2 - h1) / ln(h2 / h1)``, which is exact where
the film is straight between their centres; beside a closed film, where h changes several times within a cell, the
harmonic mean is a third too small. Electrodes and excitations are equipotential contacts: cell k under contact e is
joined to it by about ``sigma A_ke (3/h_k + 4/(pi a))``, A_ke the overlap, a the disc's radius. Each electrode leaks to
ground through the reference resistor; its potential is an unknown.

The first term is the exact depth average of a film fed from one face, right for h << a; alone it would let a
*thinner* film conduct *better* into a small disc (for h^2 > 1.5 a^2 ln(r/a)), which no conductor does. The second is
the disc on a half-space, 1/(4 sigma a). Their sum agrees with the method of images for a disc on a slab,
``R = 1/(4 sigma a) + (ln(r/(4h)) + gamma) / (2 pi sigma h)``, within 2 % of 1/(4 sigma a) for h > 1.2 a.

Everything is divided by sigma, so that the only electrical number left is ``leak = 1 / (sigma R_ref)`` in mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.sensors.biotac.discs import Contacts

# Energy norm of the error at which iterating stops, relative to the solution's own. By Cauchy and Schwarz an
# electrode is then off by at most that times sqrt(r_e), r_e = 1/leak * R_e/(R_e + R_ref) the resistance (times sigma)
# seen from it: about 3 per millimetre for the BioTac, whose solution has the norm 1.0. 4095 * sqrt(3) * 3e-6 is 0.02
# counts; the norm is estimated through the preconditioner, which a closed film makes up to four times too small. The
# promise is 0.12 counts, a third of an electrode's white noise; the largest error seen against direct solutions of 3000
# random films is 0.08. Six times finer costs a fifth more time.
TOLERANCE = 3e-6
MOST_STEPS = 200


class Answer(NamedTuple):
    """What one solve gives."""

    electrodes: FloatArray
    """(n_electrodes,) potentials, with the drive at 1."""
    unknowns: FloatArray
    """(cells + n_electrodes,) potentials of the cells and of the electrodes: the next solve's start."""
    steps: int
    """Steps of conjugate gradients."""
    error: float
    """Estimated energy norm of what is left."""


class FilmSheet:
    """A film over electrodes, prepared for one grid; `solve` it for any thickness.

    The system is factorised once, for the film at rest. A loaded film is solved by conjugate gradients preconditioned
    with that factor, rescaled on both sides by the root of the diagonals' ratio (Concus and Golub 1973, for the
    conductivity's own), plus a small system in which every electrode's cells move together (Nicolaides 1987): under a
    closed film these are joined so strongly that one by one they would be found last.

    Parameters
    ----------
    cell_mm
        Spacing in x and s, in the film's metric.
    contacts
        Electrodes and excitation on the cells.
    leak_mm
        1 / (sigma R_ref).
    at_rest_mm
        (nx, ns) the film to factorise for, positive.
    """

    def __init__(
        self,
        cell_mm: tuple[float, float],
        contacts: Contacts,
        leak_mm: float,
        at_rest_mm: FloatArray,
    ) -> None:
        dx, ds = cell_mm
        self.shape = (at_rest_mm.shape[0], at_rest_mm.shape[1])
        self.cells = at_rest_mm.size
        self.leak = leak_mm
        self._aspect = (ds / dx, dx / ds)
        self._contacts = contacts
        self._owner, self._under = contacts.owner, contacts.under
        self._n_electrodes = contacts.count
        system = _System(self, at_rest_mm)
        self._factor = _factorised(system.matrix())
        self._rest_unknowns: FloatArray = self._factor.solve(system.source)
        self._rest_diagonal = system.diagonal
        self._groups = _Groups(self.shape, contacts)

    @property
    def at_rest(self) -> Answer:
        """The solution for the film at rest."""
        return Answer(self._rest_unknowns[self.cells :].copy(), self._rest_unknowns.copy(), 0, 0.0)

    def solve_directly(self, film_mm: FloatArray) -> FloatArray:
        """Return (cells + n_electrodes,) potentials by factorising anew: slow, the oracle of `solve`."""
        system = _System(self, film_mm)
        return np.asarray(_factorised(system.matrix()).solve(system.source))

    def currents(self, film_mm: FloatArray, unknowns: FloatArray) -> tuple[float, float]:
        """Return the current that enters by the excitation and the one that leaves by the electrodes, over sigma."""
        entering = _System(self, film_mm).source[: self.cells] * (1.0 - unknowns[: self.cells])
        return float(entering.sum()), float(self.leak * unknowns[self.cells :].sum())

    def solve(self, film_mm: FloatArray, neighbours: Sequence[FloatArray] = (), tolerance: float = TOLERANCE) -> Answer:
        """Return the potentials under `film_mm`.

        Parameters
        ----------
        film_mm
            (nx, ns) thickness, positive everywhere.
        neighbours
            (cells + n_electrodes,) unknowns of neighbouring loads: the iteration begins with the best combination of
            these and the film at rest.
        tolerance
            Energy norm of the error at which to stop, relative to the solution's.

        Raises
        ------
        RigError
            If the film is not positive and finite, or the iteration does not come to its end.
        """
        if not np.isfinite(film_mm).all() or film_mm.min() <= 0.0:
            raise RigError(
                f"The film's thickness must be finite and positive; its smallest value is {film_mm.min():g} mm.",
                hint="Check the skin's residual_film and the contact solver's residual.",
            )
        system = _System(self, film_mm)
        source = system.source
        scale = np.sqrt(self._rest_diagonal / system.diagonal)
        # An electrode's own diagonal is almost all joints: it goes with its cells in the small system below.
        scale[self.cells :] = 1.0
        together = self._groups.inverse(system)
        unknowns, residual = _best_combination(system, source, np.stack([*neighbours, self._rest_unknowns]))
        # The energy of the solution is u·b.
        size = float(np.sqrt(abs(unknowns @ source)))
        direction = np.zeros_like(unknowns)
        energy_before = 1.0
        error = np.inf
        for step in range(MOST_STEPS):
            corrected = scale * self._factor.solve(scale * residual)
            self._groups.correct(corrected, together, residual)
            energy = float(residual @ corrected)
            error = np.sqrt(max(energy, 0.0)) / size
            if energy <= 0.0:  # nothing left to correct
                return Answer(unknowns[self.cells :].copy(), unknowns, step, 0.0)
            direction = corrected + (energy / energy_before if step else 0.0) * direction
            energy_before = energy
            pushed = system(direction)
            length = energy / float(direction @ pushed)
            # The correction at hand is used before stopping: its cost, the factor, is already paid.
            unknowns += length * direction
            if error <= tolerance:
                return Answer(unknowns[self.cells :].copy(), unknowns, step, float(error))
            residual -= length * pushed
        raise RigError(
            f"The film's potential did not settle: relative error {error:.1e} after {MOST_STEPS} steps, "
            f"wanted {tolerance:.1e}.",
            hint="The film may vary too steeply: check the contact solver's residual.",
        )


class _System:
    """The system of one film, divided by sigma: symmetric and positive definite; as a map it needs no matrix."""

    def __init__(self, sheet: FilmSheet, film_mm: FloatArray) -> None:
        self._sheet = sheet
        log = np.log(film_mm)
        aspect = sheet._aspect
        self.along_x = aspect[0] * _logarithmic_mean(film_mm[:-1], film_mm[1:], log[1:] - log[:-1])
        self.along_s = aspect[1] * _logarithmic_mean(film_mm[:, :-1], film_mm[:, 1:], log[:, 1:] - log[:, :-1])
        sheet._contacts.narrow(film_mm, self.along_x, self.along_s)
        self.joints, self.drive = sheet._contacts.joints(film_mm)
        self.source = np.concatenate([self.drive, np.zeros(sheet._n_electrodes)])

    @property
    def diagonal(self) -> FloatArray:
        """The (cells + n_electrodes,) diagonal of the matrix."""
        sheet = self._sheet
        joined = np.bincount(sheet._under, weights=self.joints, minlength=sheet.cells)
        cells = (self.drive + joined).reshape(sheet.shape)
        cells[1:] += self.along_x
        cells[:-1] += self.along_x
        cells[:, 1:] += self.along_s
        cells[:, :-1] += self.along_s
        electrodes = sheet.leak + np.bincount(sheet._owner, weights=self.joints, minlength=sheet._n_electrodes)
        return np.concatenate([cells.ravel(), electrodes])

    def matrix(self) -> Any:
        """Return the sparse matrix."""
        from scipy import sparse

        sheet = self._sheet
        index = np.arange(sheet.cells).reshape(sheet.shape)
        row = np.concatenate([index[:-1].ravel(), index[:, :-1].ravel(), sheet._under])
        column = np.concatenate([index[1:].ravel(), index[:, 1:].ravel(), sheet._owner + sheet.cells])
        value = np.concatenate([self.along_x.ravel(), self.along_s.ravel(), self.joints])
        n = sheet.cells + sheet._n_electrodes
        upper = sparse.coo_matrix((value, (row, column)), shape=(n, n))
        return (sparse.diags(self.diagonal) - (upper + upper.T)).tocsc()

    def __call__(self, unknowns: FloatArray) -> FloatArray:
        sheet = self._sheet
        out = np.empty_like(unknowns)
        potential = unknowns[: sheet.cells].reshape(sheet.shape)
        flow = out[: sheet.cells].reshape(sheet.shape)
        np.multiply(self.drive.reshape(sheet.shape), potential, out=flow)
        down_x = self.along_x * (potential[1:] - potential[:-1])
        flow[1:] += down_x
        flow[:-1] -= down_x
        down_s = self.along_s * (potential[:, 1:] - potential[:, :-1])
        flow[:, 1:] += down_s
        flow[:, :-1] -= down_s
        electrodes = unknowns[sheet.cells :]
        into = self.joints * (unknowns[sheet._under] - electrodes[sheet._owner])
        np.add.at(out, sheet._under, into)
        out[sheet.cells :] = sheet.leak * electrodes - np.bincount(
            sheet._owner, weights=into, minlength=sheet._n_electrodes
        )
        return out


class _Groups:
    """Every electrode with its cells, moving together: a system of as many unknowns as there are electrodes."""

    def __init__(self, shape: tuple[int, int], contacts: Contacts) -> None:
        self._count, self._cells = contacts.count, shape[0] * shape[1]
        nobody = contacts.count
        group = np.full(self._cells, nobody)
        group[contacts.under] = contacts.owner
        self._members = np.flatnonzero(group < nobody)
        self._of = group[self._members]
        by_cell = group.reshape(shape)
        pairs = [
            (by_cell[:-1].ravel(), by_cell[1:].ravel()),
            (by_cell[:, :-1].ravel(), by_cell[:, 1:].ravel()),
            (group[contacts.under], contacts.owner),
        ]
        # Only what joins two groups, or a group and the film around it, resists their moving.
        self._between = [np.flatnonzero(one != other) for one, other in pairs]
        self._ends = [(one[k], other[k]) for (one, other), k in zip(pairs, self._between, strict=True)]

    def inverse(self, system: _System) -> FloatArray:
        """Return the inverse of the small system."""
        size = self._count + 1
        values = (system.along_x.reshape(-1), system.along_s.reshape(-1), system.joints)
        small = np.zeros((size, size))
        for value, between, (one, other) in zip(values, self._between, self._ends, strict=True):
            np.add.at(small, (one, other), value[between])
        small = -(small + small.T)
        np.fill_diagonal(small, 0.0)
        driven = np.bincount(self._of, weights=system.drive[self._members], minlength=size)
        np.fill_diagonal(small, driven + system._sheet.leak - small.sum(axis=1))
        return np.asarray(np.linalg.inv(small[:-1, :-1]))

    def correct(self, corrected: FloatArray, inverse: FloatArray, residual: FloatArray) -> None:
        """Add the small system's answer to `corrected`."""
        pull = np.bincount(self._of, weights=residual[self._members], minlength=self._count)
        moved = inverse @ (pull + residual[self._cells :])
        corrected[self._members] += moved[self._of]
        corrected[self._cells :] += moved


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


def _best_combination(system: _System, source: FloatArray, known: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the combination of `known` rows that is nearest to the solution in the energy norm, and its residual."""
    acted = np.stack([system(row) for row in known])
    # Rows of neighbouring loads are almost parallel: least squares drops what rounding cannot tell apart.
    weights = np.linalg.lstsq(known @ acted.T, known @ source, rcond=1e-13)[0]
    return weights @ known, source - weights @ acted


def _factorised(matrix: Any) -> Any:
    from scipy.sparse.linalg import splu

    # Symmetric and diagonally dominant: no pivoting, and the ordering of the symmetric pattern (half the fill-in).
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
