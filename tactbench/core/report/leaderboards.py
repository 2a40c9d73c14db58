"""The leaderboards: every block of the table as a table that can be sorted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from tactbench.core.leaderboard.columns import VALUES
from tactbench.core.leaderboard.table import NUMERIC, Block, Line
from tactbench.core.report.plain import ABSENT, Entry, PlainTable, finite, plain
from tactbench.core.report.section import Section, Subject

Row = Mapping[str, Any]


def leaderboards_section(subject: Subject) -> Section:
    """Return the section of leaderboards, failed and skipped cells with their reasons."""
    table = subject.leaderboard
    rows = {row["cell"]: row for row in subject.rows}
    tables = tuple(
        _table(block, table.columns, rows, subject.anchors, block_anchor(place))
        for place, block in enumerate(table.blocks)
    )
    said = ("Click a heading to sort by it; click it again to turn the order round.",)
    return Section("leaderboards", "Leaderboards", said=said, tables=tables, notes=table.notes)


def block_anchor(place: int) -> str:
    """Return where the page shows the block at this place of the table."""
    return f"leaderboard-{place + 1}"


def _table(
    block: Block, columns: tuple[str, ...], rows: Mapping[str, Row], anchors: Mapping[str, str], anchor: str
) -> PlainTable:  # fmt: skip
    members = [rows[line.cell] for line in block.lines]
    lines = []
    for line, row in zip(block.lines, members, strict=True):
        own = {name: VALUES[name](row) for name in columns if name in VALUES}
        reason = "" if row["status"] == "done" else str(row["reason"])
        lines.append([*_entries(line, columns, own, anchors[line.cell]), Entry(reason)])
    kinds = [line.kind for line in block.lines]
    told = plain(block.title, (*columns, "reason"), lines, numeric=NUMERIC, kinds=kinds)
    return replace(told, said=block.verdict, anchor=anchor)


def _entries(
    line: Line, columns: tuple[str, ...], values: Mapping[str, float | None], anchor: str
) -> list[Entry]:  # fmt: skip
    entries = []
    for name, text in zip(columns, line.cells, strict=True):
        if name not in NUMERIC or text in ("", ABSENT):
            entries.append(Entry(text))
        else:
            place = line.placing.place if line.placing else None
            entries.append(Entry(text, finite(values[name]) if name in values else place, anchor))
    return entries
