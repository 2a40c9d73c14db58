"""Leakage probe: rows whose score is mostly that of the first frame of each recording are stamped as leaking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.evaluation.protocols import DEPLOYABLE, FIRST_FRAME
from tactbench.core.leaderboard.names import WORSE_END, Row, answer_name, sign_of
from tactbench.core.spec.row import LEAKS
from tactbench.core.tables.numbers import score_with_unit

LEAK_SHARE = 0.5
"""Share of the skill (score beyond the trivial answer's) at which the first frame's skill is called a leak."""
TAIL = 0.025
"""Largest probability of guessing as often right as the first frame, for it to be better than a guess."""
FEWEST = 5
"""Smallest number of test recordings for a statement on a regression from first frames."""


def with_leaks(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows, one for each cell, stamped as leaking if the first frame explains half of the skill or more."""
    firsts = {_question(row): row for row in rows if row["protocol"] == FIRST_FRAME.name and row["status"] == "done"}
    return [_stamped(row, firsts.get(_question(row))) for row in rows]


def _question(row: Row) -> tuple[str, ...]:
    return row["sensor"], row["task"], row["rig"], row["split"], answer_name(row)


def _stamped(row: dict[str, Any], first: Row | None) -> dict[str, Any]:
    """Return a row with a stamp if it leaks, given the row of the same question from first frames."""
    # A split that keeps nothing apart has a stamp of its own.
    asked = row["protocol"] == DEPLOYABLE.name and row["split"] not in ("shuffled", "in-session")
    if first is None or row["is_baseline"] or row["status"] != "done" or not asked or row["baseline"] is None:
        return row
    skill, most = (sign_of(row) * (row["baseline"] - one["score"]) for one in (first, row))
    if skill < LEAK_SHARE * most or not _beyond_guessing(first, row["baseline"]):
        return row
    alone, whole = (score_with_unit(one["score"], one["unit"]) for one in (first, row))
    return {**row, "stamps": [*row["stamps"], f"{LEAKS}first frame alone {alone} of {whole}."]}


def _beyond_guessing(first: Mapping[str, Any], trivial: float) -> bool:
    """Return True if the first frame answers better than a guess, False also if there are too few recordings.

    Classes: by the exact binomial tail of the number of right answers, one for each recording; a guess is the
    most frequent class. Numbers: if the interval is better than the trivial score.
    """
    sign, table = sign_of(first), first["confusion"]
    if table is None:
        worst = first[WORSE_END[sign]]
        return first["n_test"] >= FEWEST and worst is not None and sign * (trivial - worst) > 0
    from scipy.special import bdtrc

    n, right = sum(map(sum, table)), sum(line[place] for place, line in enumerate(table))
    guess = max(map(sum, table), default=0) / max(n, 1)
    return guess < 1.0 and right > 0 and bool(bdtrc(right - 1, n, guess) <= TAIL)
