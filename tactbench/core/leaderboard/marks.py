"""The marks that stand behind scores, and what each of them means."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from tactbench.core.leaderboard.text import visible

Row = Mapping[str, Any]

DAGGER = (
    "† test-set statistics were used: the protocol drops test rows by the test set's own mean and deviation, and "
    "`karl2016` scales each set, the test set too, by its own. A deployed sensor cannot; protocol `deployable` shows "
    "what it can."
)


def score_marks(row: Row) -> str:
    """Return what stands behind a score: † for test-set statistics, ‡ for what its row is stamped with."""
    return (" †" if row["dagger"] else "") + (" ‡" if row["stamps"] else "")


def mark_notes(rows: Iterable[Row]) -> list[str]:
    """Return what the marks of `rows` mean: †, ‡ and SIM, each once."""
    dagger: list[str] = []
    stamps: dict[str, None] = {}
    simulated: dict[str, None] = {}
    told: set[int] = set()
    for row in rows:
        if row["dagger"]:
            dagger = [DAGGER]
        for stamp in row["stamps"]:
            stamps[f"‡ {visible(str(stamp))}"] = None
        if row["simulated"] and id(row["assumptions"]) not in told:  # rows share what was assumed of a recording
            told.add(id(row["assumptions"]))
            assumed = f"SIM: simulated by the twin, never ranked against hardware. Assumed: {_assumptions(row)}."
            simulated[assumed] = None
    return [*dagger, *stamps, *simulated]


def _assumptions(row: Row) -> str:
    told = ", ".join(f"{key} {value}" for key, value in sorted(row["assumptions"].items()))
    return visible(told) or "see docs/twin.md"
