"""Rows as the texts that stand in a table, column by column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from operator import add
from typing import Any

from tactbench.core.leaderboard.column_table import ColumnTable
from tactbench.core.leaderboard.columns import OF_ROWS, columns
from tactbench.core.leaderboard.hosts import timing_marks
from tactbench.core.leaderboard.numbers import ABSENT
from tactbench.core.leaderboard.placing import Placing
from tactbench.core.leaderboard.text_table import Kind
from tactbench.core.spec.status import STOPPED

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Line:
    """One row as text, one string a column."""

    cells: tuple[str, ...]
    kind: Kind
    cell: str = ""
    """Name of the cell."""
    placing: Placing | None = None
    """Where it stands in its block; results better than the trivial answer only."""
    row: Row = field(default_factory=dict, repr=False, compare=False)
    """The row itself: numbers in full."""


@dataclass(frozen=True)
class RowTexts:
    """All rows of a table as text."""

    by_key: ColumnTable = field(repr=False, compare=False)
    texts: Mapping[str, Sequence[str]]
    """One text a row, by the name of the column."""
    kinds: Sequence[Kind]
    placings: Sequence[Placing | None]

    def line(self, place: int) -> Line:
        """Return the line of the row at this place."""
        row = self.by_key.rows[place]
        cells = tuple(column[place] for column in self.texts.values())
        return Line(cells, self.kinds[place], row["cell"], self.placings[place], row)


def row_texts(
    by_key: ColumnTable, placings: Sequence[Placing | None], letters: Mapping[str, str], times: bool
) -> RowTexts:
    """Return what stands in the lines of a table.

    Parameters
    ----------
    placings
        Where each row stands in its block; None: a baseline, or a cell that did not end well.
    letters
        The mark of each host.
    times
        Whether the table has times.
    """
    texts: dict[str, list[str]] = {}
    marks = timing_marks(by_key, letters)
    for name in columns(by_key, times=times):
        if name in OF_ROWS:
            texts[name] = list(map(OF_ROWS[name].text, by_key.rows))
            if name == "score":
                texts[name] = list(map(add, texts[name], _score_marks(by_key)))
            elif OF_ROWS[name].timed and marks:
                texts[name] = [text if text == ABSENT else text + mark
                               for text, mark in zip(texts[name], marks, strict=True)]  # fmt: skip
    texts |= {"#": _places(placings, by_key["is_baseline"]), "rank 95 %": _ranges(placings),
              "sensor": by_key.sensors, "estimator": by_key.answers}  # fmt: skip
    texts = {name: texts[name] for name in columns(by_key, times=times)}
    status = by_key["status"]
    for place in [place for place, ended in enumerate(status) if ended != "done"]:
        for name, column in texts.items():
            if name not in ("sensor", "estimator"):
                column[place] = ABSENT
        texts["#"][place], texts["score"][place] = "", status[place].upper()
    return RowTexts(by_key, texts, list(map(_kind, status, by_key["is_baseline"])), placings)


def _kind(status: str, trivial: bool) -> Kind:
    if status == "done":
        return "baseline" if trivial else "result"
    return "failed" if status in STOPPED else "skipped"


def _places(placings: Sequence[Placing | None], trivial: Sequence[bool]) -> list[str]:
    """Return places; an answer that is no better than the trivial one has none."""
    return [
        ("base" if plain else ABSENT) if one is None
        else f"{one.place}=" if one.tied
        else str(one.place)
        for one, plain in zip(placings, trivial, strict=True)
    ]  # fmt: skip


def _ranges(placings: Sequence[Placing | None]) -> list[str]:
    return [
        ABSENT if one is None or one.low is None or one.high is None
        else str(one.low) if one.low == one.high
        else f"{one.low}–{one.high}"
        for one in placings
    ]  # fmt: skip


def _score_marks(by_key: ColumnTable) -> list[str]:
    """Return what stands behind each score: † for test-set statistics, ‡ for what its row is stamped with."""
    given = zip(by_key["dagger"], by_key["stamps"], strict=True)
    return [(" †" if dagger else "") + (" ‡" if stamps else "") for dagger, stamps in given]
