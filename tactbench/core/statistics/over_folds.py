"""Two estimators over folds whose training data overlap: their differences are not independent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactbench.core.statistics.student import quantile, two_sided

Row = Mapping[str, Any]


@dataclass(frozen=True)
class FoldDifference:
    """The mean difference over folds, and what can be said of it."""

    mean: float
    low: float
    high: float
    p: float
    folds: int
    method: str


def corrected_t(differences: Sequence[float], test_over_train: float, repeats: int = 1) -> FoldDifference | None:
    """Return the corrected resampled t-test of differences over folds; None of fewer than two.

    Parameters
    ----------
    differences
        One a fold, of every repeat.
    test_over_train
        Test rows over training rows of a fold; of unequal folds, the mean.
    repeats
        How often the folds were dealt anew.

    Notes
    -----
    ``t = d̄ / sqrt((1/n + n_test/n_train) s²)`` with n - 1 degrees of freedom. The second term stands for the
    correlation of folds that train on mostly the same rows; without it the test finds differences that are not there
    (Nadeau and Bengio 2003, Inference for the generalization error). Over r repeats of k folds n is r k, as in
    Bouckaert and Frank 2004, Evaluating the replicability of significance tests for comparing learning algorithms.
    """
    d = np.asarray(differences, dtype=np.float64)
    n = len(d)
    if n < 2:
        return None
    deviation = float(np.sqrt((1 / n + test_over_train) * d.var(ddof=1)))
    mean = float(d.mean())
    reach = float(quantile(n - 1)) * deviation
    p = two_sided(mean / deviation, n - 1) if deviation > 0 else float(mean == 0)
    who = "Bouckaert and Frank" if repeats > 1 else "Nadeau and Bengio"
    over = f"{n // repeats} folds" + (f" of {repeats} repeats" if repeats > 1 else "")
    return FoldDifference(mean, mean - reach, mean + reach, p, n, f"corrected resampled t ({who}) over {over}")


def over_folds(pairs: Sequence[tuple[Row, Row]]) -> FoldDifference | None:
    """Return the corrected test of two cells over the folds that both have, their repeats together.

    Parameters
    ----------
    pairs
        The two rows of each repeat.
    """
    differences: list[float] = []
    ratios: list[float] = []
    for first, second in pairs:
        sizes = first.get("fold_sizes") or {}
        for name, (n_train, n_test) in sizes.items():
            if name in first["scores"] and name in second["scores"] and name in (second.get("fold_sizes") or {}):
                differences.append(first["scores"][name] - second["scores"][name])
                ratios.append(n_test / n_train)
    if len(differences) < 2 * len(pairs):
        return None
    return corrected_t(differences, float(np.mean(ratios)), len(pairs))
