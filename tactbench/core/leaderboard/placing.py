"""Where each answer of a block stands: its place, whether it shares it, and between which places it may lie."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from tactbench.core.leaderboard.names import sign_of
from tactbench.core.statistics.excess import beyond_floor, excess_of
from tactbench.core.statistics.median import FEWEST

Row = Mapping[str, Any]

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


def places(results: Sequence[Row]) -> tuple[dict[str, Placing], str]:
    """Return where each of `results` stands, by the name of its cell, and why there are no rank intervals, if so.

    Parameters
    ----------
    results
        The finished answers of one block, no baselines, the best score first.
    """
    counts = [row.get("n_replicates") for row in results]
    if any(n is not None and n < FEWEST for n in counts):
        shared = Placing(1, None, None, len(results) > 1)
        return dict.fromkeys((row["cell"] for row in results), shared), f"fewer than {FEWEST} replicates carry them"
    reason = _unrankable(results)
    if not results or reason:
        return _by_score(results), reason
    try:
        from tactbench.core.statistics.ranking import ranks

        return {cell: Placing(**vars(rank)) for cell, rank in ranks(results).items()}, ""
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        # Rows of a stranger's folder: their replicates may be anything.
        return _by_score(results), f"their replicates cannot be used ({type(error).__name__})"


def errors(results: Sequence[Row]) -> list[float]:
    """Return what answers of one metric are ordered by, the lower the better.

    The score; of errors of force the mean square beyond the floor of the reference, if all of them have one. It may be
    below zero, where the error beyond the floor is 0: two answers of one sensor differ by more than its floor tells.
    """
    if beyond_floor(results):
        return [one if math.isfinite(one) else math.inf for one in map(excess_of, results)]
    return [sign_of(row) * row["score"] if math.isfinite(row["score"]) else math.inf for row in results]


def _unrankable(results: Sequence[Row]) -> str:
    """Return why places have no intervals, if they have none; a row without replicates enters with its own interval."""
    if not any(row.get("replicates") for row in results):
        return "rows keep no replicates" if results else ""
    if len(results) > MOST_RANKED:
        return f"there are more than {MOST_RANKED} answers"
    return "" if all(math.isfinite(row["score"]) for row in results) else "a score is no finite number"


def _by_score(results: Sequence[Row]) -> dict[str, Placing]:
    ordered = errors(results)
    many = Counter(ordered)
    first = {error: place for place, error in reversed(list(enumerate(ordered, 1)))}
    return {
        row["cell"]: Placing(first[error], None, None, many[error] > 1)
        for row, error in zip(results, ordered, strict=True)
    }
