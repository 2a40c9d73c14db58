"""Conduction in a thin film between disc electrodes.

The potential, averaged over the film's depth h, obeys ``div(sigma h grad phi) = 0`` with insulated edges. Finite
volumes: a face conducts with the harmonic mean of its two cells. Electrodes and excitations are equipotential discs:
cell k under disc e is joined to it by ``sigma A_ke (3/h_k + 4/(pi a))``, A_ke the overlap, a the disc's radius. Each
electrode leaks to ground through the reference resistor; its potential is an unknown.

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
from tactbench.sensors.biotac.discs import Discs

DEPTH_AVERAGE = 3.0
"""Contact conductance of a thin film times h / (sigma A)."""

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
    with that factor, rescaled by ``sqrt(h / h_rest)`` on both sides (Concus and Golub 1973): what is left to iterate
    on is only how strongly the film's thickness varies.

    Parameters
    ----------
    cell_mm
        Spacing in x and s, in the film's metric.
    discs
        Overlaps of electrodes and excitation with the cells.
    leak_mm
        1 / (sigma R_ref).
    at_rest_mm
        (nx, ns) the film to factorise for, positive.
    thin_contact
        Contact conductance of a thin film times h / (sigma A).
    """

    def __init__(
        self,
        cell_mm: tuple[float, float],
        discs: Discs,
        leak_mm: float,
        at_rest_mm: FloatArray,
        thin_contact: float = DEPTH_AVERAGE,
    ) -> None:
        dx, ds = cell_mm
        self.shape = (at_rest_mm.shape[0], at_rest_mm.shape[1])
        self.cells = at_rest_mm.size
        self.leak = leak_mm
        self._aspect = (ds / dx, dx / ds)
        flat = discs.electrodes.reshape(len(discs.electrodes), self.cells)
        self._owner, self._under = np.nonzero(flat)
        areas = flat[self._owner, self._under]
        self._thin, self._thick = thin_contact * areas, areas * (4.0 / (np.pi * discs.electrode_radius_mm))
        excitation = discs.excitation.ravel()
        self._thin_drive = thin_contact * excitation
        self._thick_drive = excitation * (4.0 / (np.pi * discs.excitation_radius_mm))
        self._n_electrodes = len(flat)
        self._at_rest = at_rest_mm.copy()
        self._factor = _factorised(self.matrix(at_rest_mm))
        self._rest_unknowns: FloatArray = self._factor.solve(self._source(at_rest_mm))

    @property
    def at_rest(self) -> Answer:
        """The solution for the film at rest."""
        return Answer(self._rest_unknowns[self.cells :].copy(), self._rest_unknowns.copy(), 0, 0.0)

    def matrix(self, film_mm: FloatArray) -> Any:
        """Return the whole sparse system of `film_mm`, divided by sigma: symmetric and positive definite."""
        from scipy import sparse

        index = np.arange(self.cells).reshape(self.shape)
        along_x, along_s = self._faces(film_mm)
        joints = self._joints(film_mm)
        row = np.concatenate([index[:-1].ravel(), index[:, :-1].ravel(), self._under])
        column = np.concatenate([index[1:].ravel(), index[:, 1:].ravel(), self._owner + self.cells])
        value = np.concatenate([along_x.ravel(), along_s.ravel(), joints])
        n = self.cells + self._n_electrodes
        upper = sparse.coo_matrix((value, (row, column)), shape=(n, n))
        whole = (upper + upper.T).tocsr()
        grounded = np.concatenate([self._source(film_mm)[: self.cells], np.full(self._n_electrodes, self.leak)])
        return (sparse.diags(np.asarray(whole.sum(axis=1)).ravel() + grounded) - whole).tocsc()

    def solve_directly(self, film_mm: FloatArray) -> FloatArray:
        """Return (cells + n_electrodes,) potentials by factorising anew: slow, the oracle of `solve`."""
        return np.asarray(_factorised(self.matrix(film_mm)).solve(self._source(film_mm)))

    def currents(self, film_mm: FloatArray, unknowns: FloatArray) -> tuple[float, float]:
        """Return the current that enters by the excitation and the one that leaves by the electrodes, over sigma."""
        entering = self._source(film_mm)[: self.cells] * (1.0 - unknowns[: self.cells])
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
        action = _Action(self, film_mm)
        source = self._source(film_mm)
        scale = np.ones(len(source))
        scale[: self.cells] = np.sqrt(self._at_rest / film_mm).ravel()
        unknowns, residual = _best_combination(action, source, np.stack([*neighbours, self._rest_unknowns]))
        # The energy of the solution is u·b.
        size = float(np.sqrt(abs(unknowns @ source)))
        direction = np.zeros_like(unknowns)
        energy_before = 1.0
        error = np.inf
        for step in range(MOST_STEPS):
            corrected = scale * self._factor.solve(scale * residual)
            energy = float(residual @ corrected)
            error = np.sqrt(max(energy, 0.0)) / size
            if energy <= 0.0:  # nothing left to correct
                return Answer(unknowns[self.cells :].copy(), unknowns, step, 0.0)
            direction = corrected + (energy / energy_before if step else 0.0) * direction
            energy_before = energy
            pushed = action(direction)
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

    def _faces(self, film_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Conductances over sigma of the faces between neighbours along x (nx-1, ns) and along s (nx, ns-1)."""
        thin = 1.0 / film_mm
        along_x = (2.0 * self._aspect[0]) / (thin[1:] + thin[:-1])
        along_s = (2.0 * self._aspect[1]) / (thin[:, 1:] + thin[:, :-1])
        return along_x, along_s

    def _joints(self, film_mm: FloatArray) -> FloatArray:
        """Conductances over sigma between cells and the electrodes above them, one per overlap."""
        return np.asarray(self._thin / film_mm.ravel()[self._under] + self._thick)

    def _source(self, film_mm: FloatArray) -> FloatArray:
        driven = self._thin_drive / film_mm.ravel() + self._thick_drive
        return np.concatenate([driven, np.zeros(self._n_electrodes)])


class _Action:
    """The system of one film as a linear map, without a matrix."""

    def __init__(self, sheet: FilmSheet, film_mm: FloatArray) -> None:
        self._sheet = sheet
        self._along_x, self._along_s = sheet._faces(film_mm)
        self._joints = sheet._joints(film_mm)
        self._drive = sheet._source(film_mm)[: sheet.cells].reshape(sheet.shape)

    def __call__(self, unknowns: FloatArray) -> FloatArray:
        sheet = self._sheet
        out = np.empty_like(unknowns)
        potential = unknowns[: sheet.cells].reshape(sheet.shape)
        flow = out[: sheet.cells].reshape(sheet.shape)
        np.multiply(self._drive, potential, out=flow)
        down_x = self._along_x * (potential[1:] - potential[:-1])
        flow[1:] += down_x
        flow[:-1] -= down_x
        down_s = self._along_s * (potential[:, 1:] - potential[:, :-1])
        flow[:, 1:] += down_s
        flow[:, :-1] -= down_s
        electrodes = unknowns[sheet.cells :]
        into = self._joints * (unknowns[sheet._under] - electrodes[sheet._owner])
        np.add.at(out, sheet._under, into)
        out[sheet.cells :] = sheet.leak * electrodes - np.bincount(
            sheet._owner, weights=into, minlength=sheet._n_electrodes
        )
        return out


def _best_combination(action: _Action, source: FloatArray, known: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the combination of `known` rows that is nearest to the solution in the energy norm, and its residual."""
    acted = np.stack([action(row) for row in known])
    # Rows of neighbouring loads are almost parallel: least squares drops what rounding cannot tell apart.
    weights = np.linalg.lstsq(known @ acted.T, known @ source, rcond=1e-13)[0]
    return weights @ known, source - weights @ acted


def _factorised(matrix: Any) -> Any:
    from scipy.sparse.linalg import splu

    # Symmetric and diagonally dominant: no pivoting, and the ordering of the symmetric pattern (half the fill-in).
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
