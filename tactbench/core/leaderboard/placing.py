"""Where each answer of a block stands: its place, whether it shares it, and between which places it may lie.

Ranks take every pair of cells and numpy; what they came to is remembered by a digest of everything that decides them
(the scores and replicates of the block, and the code that ranks), so that a table that is shown again costs neither.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from typing import Any

from tactbench.core.leaderboard import memo

Row = Mapping[str, Any]

_DECIDING = ("tactbench.core.statistics", "tactbench.core.evaluation")
"""Packages whose code ranks."""
_DECIDES = ("cell", "score", "ci_low", "ci_high", "metric", "equivalence", "classes")
MOST_RANKED = 20_000
"""Answers of one block beyond which comparing all pairs takes too long."""


@dataclass(frozen=True)
class Placing:
    """A place among the answers of a block, from 1."""

    place: int
    low: int | None
    """Best place that the 95 % interval holds; None if no interval can be told."""
    high: int | None
    """Worst place that the 95 % interval holds."""
    tied: bool
    """Whether others share the place."""


def places(results: Sequence[Row]) -> tuple[dict[str, Placing], str]:
    """Return where each of `results` stands, by the name of its cell, and why there are no rank intervals, if so.

    Parameters
    ----------
    results
        The finished answers of one block, no baselines, the best score first.
    """
    reason = _unrankable(results)
    if not results or reason:
        return _by_score(results), reason
    try:
        facts = [([row.get(key) for key in _DECIDES], memo.ordered(row.get("replicates"))) for row in results]
        digest = memo.digest_of(*map(memo.source_digest, _DECIDING), facts)
        found = _believed(memo.recall(digest), results)
        if found is None:
            from tactbench.core.statistics.ranking import ranks

            found = {cell: Placing(rank.place, rank.low, rank.high, rank.tied) for cell, rank in ranks(results).items()}
            memo.remember(digest, [[cell, *astuple(placing)] for cell, placing in found.items()])
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        # Rows of a stranger's folder: their replicates may be anything.
        return _by_score(results), f"their replicates cannot be used ({type(error).__name__})"
    return found, ""


def _unrankable(results: Sequence[Row]) -> str:
    """Return why places have no intervals, if they have none; a row without replicates enters with its own interval."""
    if not any(row.get("replicates") for row in results):
        return "rows keep no replicates" if results else ""
    if len(results) > MOST_RANKED:
        return f"there are more than {MOST_RANKED} answers"
    return "" if all(math.isfinite(row["score"]) for row in results) else "a score is no finite number"


def _by_score(results: Sequence[Row]) -> dict[str, Placing]:
    found: dict[str, Placing] = {}
    many = Counter(row["score"] for row in results)
    place = 0
    for position, row in enumerate(results):
        if position == 0 or row["score"] != results[position - 1]["score"]:
            place = position + 1
        found[row["cell"]] = Placing(place, None, None, many[row["score"]] > 1)
    return found


def _believed(told: Any, results: Sequence[Row]) -> dict[str, Placing] | None:
    """Return remembered places if they can be those of `results`, the best first: a file on disk may say anything."""
    if not isinstance(told, list) or len(told) != len(results):
        return None
    found = {}
    for entry in told:
        if not (isinstance(entry, list) and [type(one) for one in entry] == [str, int, int, int, bool]):
            return None
        cell, place, low, high, tied = entry
        if not 1 <= low <= place <= high <= len(results):
            return None
        found[cell] = Placing(place, low, high, tied)
    if set(found) != {row["cell"] for row in results}:
        return None
    places = [found[row["cell"]].place for row in results]
    return found if places == sorted(places) else None
