"""Student's t, with the library that knows it imported when it is asked."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from tactbench.core.evaluation.interval import LEVEL
from tactbench.core.samples import FloatArray

NORMAL = 1.959963984540054
"""The normal quantile at 97.5 %: intervals of rows are 95 %."""
_MOST = 1e9
"""Degrees of freedom beyond which t is normal to all digits."""


def quantile(freedom: Any, level: float = LEVEL) -> FloatArray:
    """Return how many standard errors a two-sided interval of `level` reaches, for each of some degrees of freedom."""
    special = importlib.import_module("scipy.special")
    return np.asarray(special.stdtrit(np.minimum(freedom, _MOST), 0.5 + level / 2), dtype=np.float64)


def two_sided(t: float, freedom: float) -> float:
    """Return the probability of a value at least as far from 0 as `t`."""
    special = importlib.import_module("scipy.special")
    return float(2 * special.stdtr(min(freedom, _MOST), -abs(t)))
