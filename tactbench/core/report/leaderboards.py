"""The leaderboards: every block of the table as a table that can be sorted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.columns import NUMERIC
from tactbench.core.leaderboard.lines import Line
from tactbench.core.report.plain import ABSENT, Entry, PlainTable, finite, plain
from tactbench.core.report.section import Section, Subject


def leaderboards_section(subject: Subject) -> Section:
    """Return the section of leaderboards, failed and skipped cells with their reasons."""
    table = subject.leaderboard
    tables = tuple(
        _table(block, table.columns, subject.anchors, block_anchor(place)) for place, block in enumerate(table.blocks)
    )
    said = ("Click a heading to sort by it; click it again to turn the order round.",)
    return Section("leaderboards", "Leaderboards", said=said, tables=tables, notes=table.notes)


def block_anchor(place: int) -> str:
    """Return where the page shows the block at this place of the table."""
    return f"leaderboard-{place + 1}"


def _table(block: Block, columns: tuple[str, ...], anchors: Mapping[str, str], anchor: str) -> PlainTable:
    lines = []
    for line in block.lines:
        reason = "" if line.row["status"] == "done" else str(line.row["reason"])
        lines.append([*_entries(line, anchors[line.row["cell"]]), Entry(reason)])
    kinds = [line.kind for line in block.lines]
    told = plain(block.title, (*columns, "reason"), lines, numeric=NUMERIC, kinds=kinds)
    return replace(told, said=block.verdict, anchor=anchor)


def _entries(line: Line, anchor: str) -> list[Entry]:
    return [
        Entry(text) if name not in NUMERIC or text in ("", ABSENT) else Entry(text, finite(line.value(name)), anchor)
        for name, text in line.texts.items()
    ]
