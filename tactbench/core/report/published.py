"""The reproduction table: published numbers, ours, and how they compare."""

from __future__ import annotations

from tactbench.core.report.reproduction import Reproduction, interval_text, range_text, reproduce, unasked
from tactbench.core.report.section import ReportData, Section
from tactbench.core.tables.numbers import score
from tactbench.core.tables.text_table import ABSENT, Entry, TextTable, finite, text_table

COLUMNS = ("number", "published", "ours", "95 % interval", "calibrated range", "verdict")
NUMERIC = ("published", "ours", "95 % interval", "calibrated range")


def published_section(subject: ReportData) -> Section:
    """Return the section of published numbers."""
    table = published_table(subject)
    if not table.lines:
        return Section("reproduction", "Published numbers, and ours", missing=("No task installed here states any.",))
    paragraphs = (
        "Each number is held against the 95 % interval of our score over its replicates: inside, it is reproduced as "
        "far as they can tell. The calibrated range is where the simulation can put the number, over everything it "
        "cannot know.",
    )
    missing = () if subject.calibrated else ("There is no calibrated range yet: `tactbench calibrate` finds it.",)
    return Section(
        "reproduction", "Published numbers, and ours", paragraphs=paragraphs, tables=(table,), missing=missing
    )


def published_table(subject: ReportData) -> TextTable:
    """Return the reproduction table of all tasks that are installed."""
    lines = reproduce(subject.results.registry, subject.rows, subject.calibrated)
    titles: dict[str, list[str]] = {}
    for line in lines:
        if line.remark:
            titles.setdefault(line.remark, []).append(line.title)
    notes = [f"{', '.join(dict.fromkeys(whose))}: {remark}." for remark, whose in titles.items()]
    notes += unasked(subject.results.registry, subject.rows)
    notes += subject.calibrated.notes if subject.calibrated else ()
    return text_table(
        "Reproduction",
        COLUMNS,
        [_entries(line, subject) for line in lines],
        numeric=NUMERIC,
        notes=notes,
        kinds=[line.verdict.replace(" ", "-") for line in lines],
    )


def _entries(line: Reproduction, subject: ReportData) -> tuple[Entry, ...]:
    row, predicted = line.row, line.predicted
    anchor = subject.anchors[row["cell"]] if row else ""
    ours = ABSENT
    if row is not None and row["score"] is not None:
        ours = score(row["score"], line.unit) + (" SIM" if row["simulated"] else "") + (" †" if row["dagger"] else "")
    digits = score(line.published, line.unit) if line.unit != "1" else f"{line.published:g}"
    return (
        Entry(f"{line.title}; {line.reference}"),
        Entry(digits, line.published, anchor),
        Entry(ours, finite(row["score"]) if row else None, anchor),
        Entry(interval_text(line), finite(row["ci_low"]) if row else None, anchor),
        Entry(range_text(line), predicted.low if predicted else None, anchor),
        Entry(line.sentence),
    )
