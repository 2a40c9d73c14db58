"""The leaderboards: every block of the table as a table that can be sorted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tactbench.core.leaderboard.sheet import Sheet
from tactbench.core.leaderboard.table import NUMERIC, Block, Line, build_table
from tactbench.core.leaderboard.values import VALUES
from tactbench.core.report.plain import ABSENT, Entry, PlainTable, finite, plain
from tactbench.core.report.section import Section, Subject

Row = Mapping[str, Any]


def leaderboards_section(subject: Subject) -> Section:
    """Return the section of leaderboards, failed and skipped cells with their reasons."""
    table = build_table(subject.rows)
    rows = {row["cell"]: row for row in subject.rows}
    tables = tuple(_table(block, table.columns, rows, subject.anchors) for block in table.blocks)
    said = ("Click a heading to sort by it; click it again to turn the order round.",)
    return Section("leaderboards", "Leaderboards", said=said, tables=tables, notes=table.notes)


def _table(
    block: Block, columns: tuple[str, ...], rows: Mapping[str, Row], anchors: Mapping[str, str]
) -> PlainTable:  # fmt: skip
    members = [rows[line.cell] for line in block.lines]
    sheet = Sheet(members)
    values = {name: VALUES[name](sheet) for name in columns if name in VALUES}
    lines = []
    for place, (line, row) in enumerate(zip(block.lines, members, strict=True)):
        own = {name: column[place] for name, column in values.items()}
        reason = "" if row["status"] == "done" else str(row["reason"])
        lines.append([*_entries(line, columns, own, anchors[line.cell]), Entry(reason)])
    kinds = [line.kind for line in block.lines]
    return plain(block.title, (*columns, "reason"), lines, numeric=NUMERIC, kinds=kinds)


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
