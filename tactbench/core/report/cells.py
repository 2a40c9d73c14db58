"""Every cell, with everything that its row knows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.records import APART, GROUPS, TITLES
from tactbench.core.report.section import Details, ReportData, Section
from tactbench.core.tables.text_table import ABSENT, Entry, TextTable, finite, text_table

Row = Mapping[str, Any]


def cells_section(subject: ReportData) -> Section:
    """Return the section of cells."""
    paragraphs: tuple[str, ...] = (
        "Everything that is known about each cell. Times are in the unit that ends their name.",
    )
    if any(len(row.get("seeds") or []) > 1 for row in subject.rows):
        paragraphs += ("Of several replicates, key, recordings, candidates and effects are those of the first.",)
    return Section(
        "cells",
        "Every cell",
        paragraphs=paragraphs,
        details=tuple(_details(row, subject.anchors) for row in subject.rows),
    )


def _details(row: Row, anchors: Mapping[str, str]) -> Details:
    single = {name for name, value in row.items() if not isinstance(value, Mapping | list | tuple)} - set(APART)
    grouped = {name for names in GROUPS.values() for name in names} | set(TITLES)
    groups = {**GROUPS, "Also": tuple(sorted(single - grouped))}
    tables = [_pairs(title, ((name, row[name]) for name in names if name in single)) for title, names in groups.items()]
    lists = []
    for name in (*TITLES, *sorted(set(row) - set(TITLES) - single - set(APART))):
        value, title = row.get(name), TITLES.get(name, name)
        if name == "confusion" and value:
            tables.append(_confusion(title, value, row["classes"]))
        elif isinstance(value, Mapping) and value:
            tables.append(_pairs(title, value.items()))
        elif isinstance(value, list | tuple) and value:
            if all(isinstance(one, Mapping) for one in value):
                tables.append(_records(title, value))
            else:
                lists.append((title, tuple(map(_text, value))))
    return Details(
        anchor=anchors[row["cell"]],
        title=str(row["cell"]),
        status=str(row["status"]),
        tables=tuple(table for table in tables if table.lines),
        lists=tuple(lists),
        traceback=str(row.get("traceback") or ""),
    )


def _pairs(title: str, pairs: Iterable[tuple[str, Any]]) -> TextTable:
    return text_table(title, ("name", "value"), [(str(name), _entry(value)) for name, value in pairs])


def _records(title: str, records: Sequence[Mapping[str, Any]]) -> TextTable:
    columns = list(dict.fromkeys(str(name) for record in records for name in record))
    numeric = [name for name in columns if any(finite(record.get(name)) is not None for record in records)]
    return text_table(
        title, columns, [[_entry(record.get(name)) for name in columns] for record in records], numeric=numeric
    )


def _confusion(title: str, table: Sequence[Sequence[int]], classes: Sequence[Any]) -> TextTable:
    names = [f"{label}" for label in classes]
    columns = ("true", *(f"as {name}" for name in names))
    lines = [[Entry(name), *map(_entry, counts)] for name, counts in zip(names, table, strict=True)]
    return text_table(title, columns, lines, numeric=columns[1:])


def _entry(value: Any) -> Entry:
    if value is None or value == "":
        return Entry(ABSENT)
    if isinstance(value, bool):
        return Entry("yes" if value else "no")
    return Entry(_text(value), finite(value))


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_text, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
