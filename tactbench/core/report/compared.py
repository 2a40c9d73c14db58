"""The same questions asked otherwise: tables of other rooms, each a provider in `TABLES`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tactbench.core.evaluation.protocols import DEPLOYABLE, FIRST_FRAME
from tactbench.core.leaderboard.probe import NUMERIC, build_probe
from tactbench.core.report.plain import Entry, PlainTable, number, plain
from tactbench.core.report.section import Section, Subject


def probe_tables(subject: Subject) -> list[PlainTable]:
    """Return what the recordings give away before the contact, each score leading to the cell it is from."""
    table = build_probe(subject.rows)
    if table is None:
        return []
    lines = []
    for line in table.lines:
        facts = dict(zip(table.columns, line, strict=True))
        asked = {
            "sensor": facts["sensor"].removesuffix(" SIM"),
            "task": facts["task"],
            "estimator": facts["estimator"],
            "split": facts["split"],
            "protocol": DEPLOYABLE.name,
            "repeat": int(facts["repeat"]) if facts.get("repeat") else None,
        }
        other = {
            "shuffled": {**asked, "split": "shuffled"},
            "first frame alone": {**asked, "protocol": FIRST_FRAME.name},
        }
        entries = [
            Entry(text, number(text), subject.anchor_of(other.get(name, asked))) if name in NUMERIC else Entry(text)
            for name, text in facts.items()
        ]
        lines.append(entries)
    return [plain(table.title, table.columns, lines, numeric=NUMERIC, notes=table.notes)]


TABLES: tuple[Callable[[Subject], Sequence[PlainTable]], ...] = (probe_tables,)
"""Called one after the other; one that has nothing to show returns an empty list."""


def compared_section(subject: Subject) -> Section:
    """Return the section of comparisons and probes."""
    tables = tuple(table for provider in TABLES for table in provider(subject))
    lacks = (
        "No question was asked in two ways: `tactbench run --probe` adds shuffled rows and the first frame alone, "
        "`--protocol` and `--split` ask otherwise."
    )
    return Section("compared", "The same questions asked otherwise", tables=tables, missing=() if tables else (lacks,))
