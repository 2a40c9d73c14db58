"""What draws say: which are accepted, ranges, shares of findings, and which nuisance decides which number.

Draws are accepted by rejection (Pritchard et al. 1999, Population growth of human Y chromosomes, Mol. Biol. Evol. 16).
The distance of a draw is the largest difference of a number from the published one, in units of its scale.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest, rankdata

from studies.calibration.draws import Draw, FloatArray, Procedure

FEWEST = 10
"""With fewer draws the 10 % and 90 % quantiles are hardly more than the ends."""
RESAMPLES = 500


class Accepted(NamedTuple):
    """The draws that count."""

    draws: tuple[Draw, ...]
    near: int
    """How many draws lie within the tolerance."""
    reach: float
    """The largest distance of an accepted draw [scales]."""


def output_values(draws: Sequence[Draw], name: str) -> FloatArray:
    """Return (n,) values of one output; NaN where a draw has none."""
    return np.array([draw.outputs.get(name, math.nan) for draw in draws])


def parameter_values(draws: Sequence[Draw], name: str) -> FloatArray:
    """Return (n,) values of one nuisance."""
    return np.array([draw.parameters[name] for draw in draws])


def accept(procedure: Procedure, draws: Sequence[Draw], targets: Sequence[Mapping[str, Any]]) -> Accepted:
    """Return the draws within the tolerance of all targets, or as many of the nearest as are wanted at least."""
    away = np.max(
        [np.abs(output_values(draws, one["output"]) - one["value"]) / one["scale"] for one in targets], axis=0
    )
    near = int(np.sum(away <= procedure["tolerance"]))
    places = sorted(np.argsort(away, kind="stable")[: max(near, procedure["at_least"])].tolist())
    return Accepted(tuple(draws[place] for place in places), near, float(max(away[places], default=0.0)))


def by_fitted(procedure: Procedure, draws: Sequence[Draw]) -> Accepted:
    """Return the draws that the fitted numbers accept."""
    return accept(procedure, draws, [one for one in procedure["published"] if one["use"] == "fitted"])


def middle(values: FloatArray) -> tuple[float, float, float] | None:
    """Return the median and the ends of the middle 80 %; None of fewer than ten values."""
    if values.size < FEWEST:
        return None
    low, median, high = np.quantile(values, [0.1, 0.5, 0.9])
    return float(median), float(low), float(high)


def share(verdicts: Sequence[bool]) -> tuple[float, float, float]:
    """Return the share of the verdicts that are true, and its 95 % interval by Wilson 1927."""
    interval = binomtest(sum(verdicts), len(verdicts)).proportion_ci(method="wilson")
    return sum(verdicts) / len(verdicts), float(interval.low), float(interval.high)


def holds(finding: Mapping[str, Any], outputs: Mapping[str, float]) -> bool:
    """Return whether a finding is true of one draw's outputs."""
    return all(outputs[one["above"]] - outputs[one["below"]] > one["margin"] for one in finding["all_of"])


def same_verdicts(procedure: Procedure, draws: Sequence[Draw], finding: Mapping[str, Any]) -> list[bool]:
    """Return whether the dear outputs give the verdict of the cheap ones they check, for the draws that have them."""
    dear = {one["stands_for"]: one["name"] for one in procedure["outputs"] if one.get("stands_for")}
    names = {one[side] for one in finding["all_of"] for side in ("above", "below")}
    if not names <= set(dear):
        return []
    instead = [
        (draw.outputs, {name: draw.outputs[dear[name]] for name in names})
        for draw in draws if all(dear[name] in draw.outputs for name in names)
    ]  # fmt: skip
    return [holds(finding, cheap) == holds(finding, costly) for cheap, costly in instead]


def sensitivities(procedure: Procedure, draws: Sequence[Draw], seed: int) -> dict[str, list[tuple[float, bool]]]:
    """Return each output's partial rank correlation with every nuisance, and whether its 95 % interval leaves out 0.

    Saltelli et al. 2004, Sensitivity Analysis in Practice, section 2.4: ranks take out any monotone bend, the partial
    correlation what the other nuisances explain. The interval is a bootstrap over the draws. Outputs of some draws
    only are left out; with fewer draws than nuisances and four, all are.
    """
    names = [one["name"] for one in procedure["nuisances"]]
    if len(draws) < len(names) + 4:
        return {}
    outputs = [one["name"] for one in procedure["outputs"] if one.get("only_first") is None]
    X = np.column_stack([parameter_values(draws, name) for name in names])
    Y = np.column_stack([output_values(draws, name) for name in outputs])
    here = partial_rank_correlations(X, Y)
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0x5E]))
    resamples = (rng.integers(len(X), size=len(X)) for _ in range(RESAMPLES))
    again = np.array([partial_rank_correlations(X[rows], Y[rows]) for rows in resamples])
    low, high = np.nanquantile(again, [0.025, 0.975], axis=0)
    apart = (low > 0) | (high < 0)
    return {name: list(zip(here[i].tolist(), apart[i].tolist(), strict=True)) for i, name in enumerate(outputs)}


def partial_rank_correlations(X: FloatArray, Y: FloatArray) -> FloatArray:
    """Return (outputs, parameters) partial rank correlations of Y (n, outputs) with X (n, parameters).

    From the inverse ``P`` of the rank correlations of all parameters and one output: ``-P_jy / sqrt(P_jj P_yy)``. Where
    a resample leaves two columns the same there would be no inverse: 1e-9 is added to the diagonal.
    """
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
