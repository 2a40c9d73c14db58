"""How much each replicate carries of a score, by leaving it out."""

from __future__ import annotations

import numpy as np

from tactbench.core.samples import FloatArray, IntArray


def influences(without: FloatArray, strata: IntArray) -> FloatArray:
    """Return (…, replicates) whose sum of squares is the squared standard error of a score.

    Parameters
    ----------
    without
        (…, replicates) the score without each replicate.
    strata
        (replicates,) which replicates may stand in for each other; two or more of each.

    Notes
    -----
    The jackknife of Quenouille and Tukey, within strata as in Shao and Tu 1995, The jackknife and bootstrap, section
    6.2. For a mean over replicates this is the usual standard error exactly, and no derivative of a metric is needed.
    """
    out = np.zeros_like(without)
    for one in np.unique(strata):
        mine = without[..., strata == one]
        n = mine.shape[-1]
        out[..., strata == one] = np.sqrt((n - 1) / n) * (mine.mean(axis=-1, keepdims=True) - mine)
    return out
