"""Several comparisons at once: the more are made, the stronger each must be."""

from __future__ import annotations

from collections.abc import Sequence


def holm(p: Sequence[float | None]) -> list[float | None]:
    """Return p-values corrected for being several, in the order given.

    Parameters
    ----------
    p
        One a declared comparison; None for one that could not be made, which neither counts nor gets a value.

    Notes
    -----
    Holm 1979, A simple sequentially rejective multiple test procedure: the k-th smallest of m is multiplied by
    m - k + 1, never below that of a smaller one, never above 1. It controls the probability of any false finding
    whatever the dependence between the comparisons.
    """
    made = sorted((value, place) for place, value in enumerate(p) if value is not None)
    corrected: list[float | None] = [None] * len(p)
    least = 0.0
    for rank, (value, place) in enumerate(made):
        least = max(least, min(1.0, (len(made) - rank) * value))
        corrected[place] = least
    return corrected
