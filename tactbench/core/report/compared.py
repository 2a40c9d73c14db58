"""The same questions asked otherwise: tables of other rooms, each a provider in `TABLES`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tactbench.core.evaluation.protocols import DEPLOYABLE, FIRST_FRAME
from tactbench.core.leaderboard.axes import AXES
from tactbench.core.leaderboard.probe import NUMERIC, build_probe
from tactbench.core.leaderboard.side_by_side import compare
from tactbench.core.report.section import ReportData, Section
from tactbench.core.tables.text_table import ABSENT, Entry, TextTable, finite, sort_value, text_table


def probe_tables(subject: ReportData) -> list[TextTable]:
    """Return what the recordings give away before the contact, each score leading to the cell it is from."""
    table = build_probe(subject.rows)
    if table is None:
        return []
    lines = []
    for line in table.lines:
        facts = dict(zip(table.columns, line, strict=True))
        conditions = {
            "sensor": facts["sensor"].removesuffix(" SIM"),
            "task": facts["task"],
            "estimator": facts["estimator"],
            "split": facts["split"],
            "protocol": DEPLOYABLE.name,
            "repeat": int(facts["repeat"]) if facts.get("repeat") else None,
        }
        other = {
            "shuffled": {**conditions, "split": "shuffled"},
            "first frame alone": {**conditions, "protocol": FIRST_FRAME.name},
        }
        entries = [
            Entry(text, sort_value(text), subject.anchor_of(other.get(name, conditions)))
            if name in NUMERIC
            else Entry(text)
            for name, text in facts.items()
        ]
        lines.append(entries)
    return [text_table(table.title, table.columns, lines, numeric=NUMERIC, notes=table.notes)]


def comparison_tables(subject: ReportData) -> list[TextTable]:
    """Return protocols, splits and folds side by side, each score leading to the cell it is from."""
    found = []
    for table in (table for by in AXES for table in compare(subject.rows, by)):
        records = iter(table.records)
        lines = []
        for names, texts in ((line[:2], line[2:]) for line in table.lines):
            entries = [Entry(name) for name in names]
            for text in texts:
                record = next(records) if text != ABSENT else {}
                entries.append(Entry(text, finite(record.get("score")), subject.anchor_of(record)))
            lines.append(entries)
        found.append(text_table(table.title, table.columns, lines, numeric=table.columns[2:], notes=table.notes))
    return found


TABLES: tuple[Callable[[ReportData], Sequence[TextTable]], ...] = (comparison_tables, probe_tables)
"""Called one after the other; one that has nothing to show returns an empty list."""


def compared_section(subject: ReportData) -> Section:
    """Return the section of comparisons and probes."""
    tables = tuple(table for provider in TABLES for table in provider(subject))
    lacks = (
        "No question was asked in two ways: `tactbench run --probe` adds shuffled rows and the first frame alone, "
        "`--protocol` and `--split` ask otherwise."
    )
    return Section("compared", "The same questions asked otherwise", tables=tables, missing=() if tables else (lacks,))
