"""The interval of a median over replicates, from their order alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

FEWEST = 5
"""Replicates that an interval or a rank needs: the range of four holds the median in 87.5 % of cases only."""
LEVEL = 0.95


@dataclass(frozen=True)
class MedianInterval:
    """Where a median may lie."""

    low: float
    high: float
    level: float
    """Coverage: 0.95, or that of the whole range where five replicates reach no more."""


def median_interval(values: Sequence[float]) -> MedianInterval | None:
    """Return the 95 % interval of the median of what `values` were drawn from; None of fewer than five.

    Notes
    -----
    The interval between the k-th smallest and the k-th largest of n values holds the median with probability
    ``1 - 2 P(B < k)``, B binomial with n and 1/2, whatever the distribution is. Between the two k whose probabilities
    enclose 95 % the ends are interpolated [1]_. The range of five values holds it in 93.75 % only: the level says so.

    References
    ----------
    .. [1] Hettmansperger and Sheather 1986, Confidence intervals based on interpolated order statistics, Statistics and
       Probability Letters 4, equation 2.
    """
    n = len(values)
    if n < FEWEST:
        return None
    ordered = sorted(map(float, values))
    k = next(k for k in range(1, n) if _coverage(n, k + 1) < LEVEL)
    held, next_held = _coverage(n, k), _coverage(n, k + 1)
    if held <= LEVEL:
        return MedianInterval(ordered[0], ordered[-1], held)
    share = (held - LEVEL) / (held - next_held)
    weight = (n - k) * share / (k + (n - 2 * k) * share)
    low = (1 - weight) * ordered[k - 1] + weight * ordered[k]
    high = (1 - weight) * ordered[n - k] + weight * ordered[n - k - 1]
    return MedianInterval(low, high, LEVEL)


def counted(n: int, unit: str) -> str:
    """Return so many of a unit of replication as text: ``8 replicates``, ``20 presses``, ``1 session``."""
    if unit.startswith("block"):
        return f"{n} {unit.replace('block', 'blocks', 1)}"
    return f"{n} {unit}" if n == 1 else f"{n} {unit}{'es' if unit.endswith('s') else 's'}"


def percent(n: int | None, unit: str | None) -> str:
    """Return what intervals over `n` replicates, or sessions, cover, as text: ``95 %``."""
    return "93.8 %" if n == FEWEST and unit == "replicate" else "95 %"


def _coverage(n: int, k: int) -> float:
    """Return the probability that the median lies between the k-th smallest and the k-th largest of n values."""
    return 1.0 - 2.0 * sum(comb(n, i) for i in range(k)) / float(2**n)
