"""The same questions asked otherwise: protocols, splits and folds side by side, and what the recordings give away."""

from __future__ import annotations

from tactbench.core.leaderboard import AXES
from tactbench.core.leaderboard.probe import build_probe
from tactbench.core.leaderboard.side_by_side import compare
from tactbench.core.report.section import ReportData, Section


def compared_section(subject: ReportData) -> Section:
    """Return the section of comparisons and probes, each score leading to the cell it is from."""
    probe = build_probe(subject.rows)
    found = [*(table for by in AXES for table in compare(subject.rows, by)), *([probe] if probe else [])]
    tables = tuple(subject.linked(table).compact() for table in found)
    lacks = (
        "No question was asked in two ways: `tactbench run --probe` adds shuffled rows and the first frame alone, "
        "`--protocol` and `--split` ask otherwise."
    )
    return Section("compared", "The same questions asked otherwise", tables=tables, missing=() if tables else (lacks,))
