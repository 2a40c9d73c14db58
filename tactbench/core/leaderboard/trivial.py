"""Trivial answers, and where an answer stands beside the best one of its own sensor."""

from __future__ import annotations

import math
from collections.abc import Iterable
from operator import itemgetter

from tactbench.core.leaderboard.names import Row, answer_name, grouped, sign_of

comparison_key = itemgetter("sensor", "task", "rig", "protocol", "split")
"""What answers must share to be held against a trivial one."""
WORSE_END = {1.0: "ci_high", -1.0: "ci_low"}
"""The worse end of an interval by `sign_of`: of an error, and of what is the higher the better."""


def error_of(row: Row) -> float:
    """Return a score as a number that is the lower the better; one that is no finite number is the worst."""
    return sign_of(row) * row["score"] if math.isfinite(row["score"]) else math.inf


class Bars:
    """The score that each answer is held against: the best trivial one of its own sensor, whatever it looks at."""

    def __init__(self, rows: Iterable[Row]) -> None:
        """Take the finished trivial answers from `rows`; an oracle is none."""
        trivial = (row for row in rows if row["is_baseline"] and row["status"] == "done")
        groups = grouped((row for row in trivial if row.get("looks_at") != "reference"), comparison_key)
        self._best = {key: min(alike, key=error_of) for key, alike in groups.items()}

    def trivial(self, row: Row) -> Row | None:
        """Return the trivial answer; None where it is not among the rows, and only its score may be known."""
        return self._best.get(comparison_key(row))

    def score(self, row: Row) -> float | None:
        """Return its score; None where there is no trivial answer."""
        trivial = self.trivial(row)
        return row.get("baseline") if trivial is None else trivial["score"]

    def name(self, row: Row) -> str:
        """Return what it is called."""
        trivial = self.trivial(row)
        return "the trivial answer" if trivial is None else answer_name(trivial)

    def no_better(self, row: Row) -> bool:
        """Return whether the score of an answer is no better."""
        return _reaches(error_of(row), row, self.score(row))

    def unshown(self, row: Row) -> bool:
        """Return whether the interval of an answer holds the score of the trivial one, or lies beyond it."""
        end = row[WORSE_END[sign_of(row)]]
        return end is not None and _reaches(sign_of(row) * end, row, self.score(row))


def no_better(row: Row) -> bool:
    """Return whether an answer is no better than the trivial one that used no more than it."""
    return _reaches(error_of(row), row, row.get("baseline"))


def _reaches(error: float, row: Row, bar: float | None) -> bool:
    return bar is not None and error >= sign_of(row) * bar
