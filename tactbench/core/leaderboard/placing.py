"""Where each answer of a block stands: its place, whether it shares it, and between which places it may lie."""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

from tactbench.core.leaderboard.column_table import ColumnTable
from tactbench.core.leaderboard.names import LOWER_IS_BETTER
from tactbench.core.statistics.excess import beyond_floor, excess_of
from tactbench.core.statistics.median import FEWEST

MOST_RANKED = 20_000
"""Answers of one block beyond which comparing all pairs takes too long."""


class Placing(NamedTuple):
    """A place among the answers of a block, from 1."""

    place: int
    low: int | None
    """Best place that the 95 % interval holds; None if no interval can be told."""
    high: int | None
    """Worst place that the 95 % interval holds."""
    tied: bool
    """Whether others share the place."""
    apart: bool = False
    """Whether it is clearly worse than the answer next before it."""
    behind: bool = False
    """Whether it is clearly worse than the best one."""
    first_without: int = 0
    """Without how many replicates, each left out alone, it is the best one; 0 for all where replicates differ."""


def places(results: ColumnTable) -> tuple[dict[str, Placing], str]:
    """Return where each of `results` stands, by the name of its cell, and why there are no rank intervals, if so.

    Parameters
    ----------
    results
        The finished answers of one block, no baselines, the best score first.
    """
    few = [n for n in results.known("n_replicates") if n is not None and n < FEWEST]
    if few:
        shared = Placing(1, None, None, len(results.rows) > 1)
        return dict.fromkeys(results["cell"], shared), f"fewer than {FEWEST} replicates carry them"
    reason = _unrankable(results)
    if not results.rows or reason:
        return _by_score(results), reason
    try:
        from tactbench.core.statistics.ranking import ranks

        return {cell: Placing(**vars(rank)) for cell, rank in ranks(results.rows).items()}, ""
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        # Rows of a stranger's folder: their replicates may be anything.
        return _by_score(results), f"their replicates cannot be used ({type(error).__name__})"


def errors(results: ColumnTable) -> list[float]:
    """Return what answers of one metric are ordered by, the lower the better.

    The score; of errors of force the mean square beyond the floor of the reference, if all of them have one. It may be
    below zero, where the error beyond the floor is 0: two answers of one sensor differ by more than its floor tells.
    """
    if beyond_floor(results.rows):
        return [one if math.isfinite(one) else math.inf for one in map(excess_of, results.rows)]
    signs = [1.0 if metric in LOWER_IS_BETTER else -1.0 for metric in results["metric"]]
    return [
        sign * score if math.isfinite(score) else math.inf
        for sign, score in zip(signs, results["score"], strict=True)
    ]  # fmt: skip


def _unrankable(results: ColumnTable) -> str:
    """Return why places have no intervals, if they have none; a row without replicates enters with its own interval."""
    if not any(results.known("replicates")):
        return "rows keep no replicates" if results.rows else ""
    if len(results.rows) > MOST_RANKED:
        return f"there are more than {MOST_RANKED} answers"
    return "" if all(map(math.isfinite, results["score"])) else "a score is no finite number"


def _by_score(results: ColumnTable) -> dict[str, Placing]:
    found: dict[str, Placing] = {}
    ordered = errors(results)
    many = Counter(ordered)
    place, before = 0, None
    for position, (cell, error) in enumerate(zip(results["cell"], ordered, strict=True)):
        if position == 0 or error != before:
            place = position + 1
        found[cell] = Placing(place, None, None, many[error] > 1)
        before = error
    return found
