"""Which nuisance decides which output: partial rank correlations with bootstrap intervals.

Saltelli et al. 2004, Sensitivity Analysis in Practice, section 2.4 (PRCC): ranks take out any monotone bend, the
partial correlation what the other nuisances explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactbench.core.calibration.draw import Draw, output_values, parameter_values
from tactbench.core.samples import FloatArray
from tactbench.core.spec.calibration import CalibrationSpec, Fixed

RESAMPLES = 500
LEVEL = 0.95


class Sensitivity(NamedTuple):
    """How one output goes with one nuisance, all others held."""

    output: str
    parameter: str
    n: int
    correlation: float
    """Partial rank correlation, -1 to 1."""
    low: float
    high: float


def sensitivities(spec: CalibrationSpec, draws: Sequence[Draw], rng: np.random.Generator) -> list[Sensitivity]:
    """Return the partial rank correlation of every output with every nuisance that is not fixed.

    Outputs that are read off some draws only, that never change, or that have too few draws are left out: with p
    nuisances, fewer than p + 4 draws leave hardly a degree of freedom.

    Parameters
    ----------
    rng
        Draws the bootstrap's resamples.
    """
    names = [one.name for one in spec.nuisances if not isinstance(one.prior, Fixed)]
    if not names or len(draws) < len(names) + 4:
        return []
    X = np.column_stack([parameter_values(draws, name) for name in names])
    outputs = [output.name for output in spec.outputs if output.only_first is None]
    Y = {name: output_values(draws, name) for name in outputs}
    Y = {name: column for name, column in Y.items() if not np.isnan(column).any() and np.ptp(column) > 0}
    if not Y:
        return []
    columns = np.column_stack(list(Y.values()))
    here = partial_rank_correlations(X, columns)
    n = len(X)
    again = np.full((RESAMPLES, *here.shape), np.nan)
    for place in range(RESAMPLES):
        rows = rng.integers(n, size=n)
        again[place] = partial_rank_correlations(X[rows], columns[rows])
    low, high = np.nanquantile(again, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0)
    return [
        Sensitivity(output, name, n, float(here[i, j]), float(low[i, j]), float(high[i, j]))
        for i, output in enumerate(Y)
        for j, name in enumerate(names)
    ]


def partial_rank_correlations(X: FloatArray, Y: FloatArray) -> FloatArray:
    """Return (outputs, parameters) partial rank correlations of Y (n, outputs) with X (n, parameters).

    From the inverse ``P`` of the rank correlations of all parameters and one output: ``-P_jy / sqrt(P_jj P_yy)``. Where
    an output is a function of the parameters' ranks, or a resample leaves two columns the same, there would
    be no inverse: 1e-9 is added to the diagonal.
    """
    from scipy.stats import rankdata

    p = X.shape[1]
    ranks = rankdata(np.hstack([X, Y]), axis=0)
    ranks -= ranks.mean(axis=0)
    size = np.sqrt((ranks**2).sum(axis=0))
    ranks /= np.where(size > 0, size, 1.0)
    together = ranks.T @ ranks + 1e-9 * np.eye(ranks.shape[1])
    own = np.column_stack([np.tile(np.arange(p), (Y.shape[1], 1)), np.arange(p, ranks.shape[1])])
    P = np.linalg.inv(together[own[:, :, None], own[:, None, :]])
    diagonal = np.diagonal(P, axis1=1, axis2=2)
    found: FloatArray = -P[:, :p, p] / np.sqrt(diagonal[:, :p] * diagonal[:, p:])
    return found
