"""A row as the texts that stand in a table, by column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from tactbench.core.leaderboard.columns import NUMERIC, OF_ROWS
from tactbench.core.leaderboard.hosts import timing_mark
from tactbench.core.leaderboard.names import answer_name, sensor_name
from tactbench.core.leaderboard.placing import Placing
from tactbench.core.spec.status import STOPPED
from tactbench.core.tables.numbers import ABSENT

Row = Mapping[str, Any]
Kind = Literal["result", "baseline", "failed", "skipped"]
"""Of a line: an answer, a trivial one, a cell that did not end well or was not begun."""


@dataclass(frozen=True)
class Line:
    """One row as text."""

    row: Row = field(repr=False, compare=False)
    """Numbers in full."""
    texts: Mapping[str, str]
    """By column."""
    kind: Kind
    placing: Placing | None = None
    """Where it stands in its block; results better than the trivial answer only."""

    @property
    def cells(self) -> tuple[str, ...]:
        """Its texts, one a column."""
        return tuple(self.texts.values())

    def value(self, column: str) -> float | None:
        """Return what a line is sorted by in a column of numbers; None: last."""
        if column not in NUMERIC or self.kind in ("failed", "skipped"):
            return None  # a stopped cell may know a number that the table does not show
        if column in OF_ROWS:
            return OF_ROWS[column].value(self.row)
        one = self.placing
        if one is None or column == "#":
            return one and one.place
        return (one.low + one.high) / 2 if one.low and one.high else None


def line_of(row: Row, placing: Placing | None, columns: Sequence[str], letters: Mapping[str, str]) -> Line:
    """Return the line of a row.

    Parameters
    ----------
    placing
        Where the row stands in its block; None: a baseline, or a cell that did not end well.
    letters
        The mark of each host.
    """
    texts = {"sensor": sensor_name(row), "estimator": answer_name(row)}
    if row["status"] != "done":
        texts |= {"#": "", "score": row["status"].upper()}
        kind: Kind = "failed" if row["status"] in STOPPED else "skipped"
        return Line(row, {name: texts.get(name, ABSENT) for name in columns}, kind)
    texts |= {"#": _place(placing, row), "rank 95 %": _range(placing)}
    mark = timing_mark(row, letters)
    for name in columns:
        if name in OF_ROWS:
            text = OF_ROWS[name].text(row)
            texts[name] = text + mark if OF_ROWS[name].timed and text != ABSENT else text
    texts["score"] += (" †" if row["dagger"] else "") + (" ‡" if row["stamps"] else "")
    kind = "baseline" if row["is_baseline"] else "result"
    return Line(row, {name: texts[name] for name in columns}, kind, placing)


def _place(one: Placing | None, row: Row) -> str:
    """Return the place; an answer that is no better than the trivial one has none, nor has an oracle."""
    if one is None and row["is_baseline"]:
        return "oracle" if row.get("looks_at") == "reference" else "base"
    if one is None:
        return ABSENT
    return f"{one.place}=" if one.tied else str(one.place)


def _range(one: Placing | None) -> str:
    if one is None or one.low is None or one.high is None:
        return ABSENT
    return str(one.low) if one.low == one.high else f"{one.low}–{one.high}"
