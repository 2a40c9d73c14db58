"""A part of the page, and what parts are made of."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from tactbench.core.leaderboard.names import answer_name
from tactbench.core.leaderboard.table import Table, build_table
from tactbench.core.report.results import Results, SavedFigure
from tactbench.core.tables.text_table import Entry, TextTable

Row = Mapping[str, Any]
_DESCRIBED = ("sensor", "task", "rig", "protocol", "split", "estimator", "repeat", "seed")


@dataclass(frozen=True)
class ReportData:
    """Everything that a page is about."""

    results: Results
    drawn: Sequence[SavedFigure] = ()
    undrawn: tuple[str, ...] = ()
    """Why figures are missing, a sentence each."""

    @property
    def rows(self) -> tuple[Row, ...]:
        """One a cell."""
        return self.results.rows

    @property
    def folder(self) -> Path:
        """The result folder."""
        return self.results.store.folder

    @cached_property
    def leaderboard(self) -> Table:
        """The rows as ranked tables."""
        return build_table(self.rows)

    @cached_property
    def anchors(self) -> dict[str, str]:
        """Where the page tells everything about a cell, by the cell's name."""
        found: dict[str, str] = {}
        for row in self.rows:
            stem = "cell-" + (re.sub(r"[^a-z0-9]+", "-", str(row["cell"]).lower()).strip("-") or "nameless")
            anchor, count = stem, 2
            while anchor in found.values():
                anchor, count = f"{stem}-{count}", count + 1
            found[row["cell"]] = anchor
        return found

    def linked(self, table: TextTable) -> TextTable:
        """Return a table whose numbers lead to the cells that they are from."""
        lines = tuple(
            tuple(
                Entry(one, one.value, self.anchors.get(one.cell, "")) if isinstance(one, Entry) and one.cell else one
                for one in line
            )
            for line in table.lines
        )
        return replace(table, lines=lines)

    def anchor_of(self, facts: Mapping[str, Any]) -> str:
        """Return the anchor of the one cell that `facts` describe: by name, by key, or by what was asked of whom.

        Empty if no cell fits, or several do. Other keys do not matter; an estimator may come with its parameters in
        brackets.
        """
        asked = {name: facts[name] for name in _DESCRIBED if facts.get(name) is not None}
        named, key = facts.get("cell"), facts.get("key") or None
        cells = [row for row in self.rows if named == row["cell"] or (key and key == row.get("key"))]
        if not cells and {"sensor", "task", "estimator"} <= set(asked):
            name = asked.pop("estimator")
            alike = [row for row in self.rows if all(row[one] == value for one, value in asked.items())]
            cells = [row for row in alike if name == answer_name(row)] or [
                row for row in alike if name == row["estimator"]
            ]
        return self.anchors[cells[0]["cell"]] if len(cells) == 1 else ""


@dataclass(frozen=True)
class Picture:
    """A figure inside the page."""

    title: str
    caption: str
    png: bytes
    cells: tuple[tuple[str, str], ...] = ()
    """Name and anchor of the cells it shows."""
    narrow: bytes = b""
    """The same for a narrow screen; empty: there is none."""

    @property
    def wide(self) -> bool:
        """Whether it needs the width of the page: more than 900 pixels, which its header tells."""
        return int.from_bytes(self.png[16:20], "big") > 900


@dataclass(frozen=True)
class Details:
    """Everything that is known about one cell, to be unfolded."""

    anchor: str
    title: str
    status: str
    tables: tuple[TextTable, ...]
    lists: tuple[tuple[str, tuple[str, ...]], ...] = ()
    """Titled lists of sentences."""
    traceback: str = ""


@dataclass(frozen=True)
class Highlight:
    """One thing that came out, and where the page shows it."""

    text: str
    anchor: str
    place: str
    """What the link is called."""


@dataclass(frozen=True)
class Section:
    """A part of the page. Text between backticks is shown as code; none of it is markup."""

    anchor: str
    title: str
    paragraphs: tuple[str, ...] = ()
    answers: tuple[Highlight, ...] = ()
    """Below the pictures: what came out, each with a link."""
    tables: tuple[TextTable, ...] = ()
    notes: tuple[str, ...] = ()
    """Below the tables."""
    pictures: tuple[Picture, ...] = ()
    details: tuple[Details, ...] = ()
    missing: tuple[str, ...] = ()
    """What the section lacks: one sentence each, with the command that makes it."""


Maker = Callable[[ReportData], Section]


def block_anchor(place: int) -> str:
    """Return where the page shows the block at this place of the table."""
    return f"leaderboard-{place + 1}"
