"""What the paper found, and how often it comes out so; linear answers against non-linear ones."""

from __future__ import annotations

from tactbench.core.report.calibrated import Share
from tactbench.core.report.linearity import contrasts
from tactbench.core.report.section import ReportData, Section
from tactbench.core.tables.text_table import ABSENT, Entry, TextTable, text_table


def findings_section(subject: ReportData) -> Section:
    """Return the section of findings."""
    tables = [table for table in (_frequencies(subject), _linear(subject)) if table is not None]
    lacks = []
    if not (subject.calibrated and subject.calibrated.findings):
        lacks.append("How often the paper's findings come out is not here: `tactbench calibrate` counts.")
    if _linear(subject) is None:
        lacks.append(
            "No task was answered both linearly and otherwise: add `--estimator` to `tactbench run`, twice; "
            "`tactbench list estimators` has them."
        )
    if subject.calibrated is not None:
        tables += subject.calibrated.tables
    if not tables:
        return Section("findings", "The paper's findings", missing=tuple(lacks))
    notes = subject.calibrated.notes if subject.calibrated else ()
    return Section("findings", "The paper's findings", missing=tuple(lacks), tables=tuple(tables), notes=notes)


def _frequencies(subject: ReportData) -> TextTable | None:
    if subject.calibrated is None or not subject.calibrated.findings:
        return None
    lines = [
        (
            Entry(one.statement),
            _share_text(one.accepted),
            _share_text(one.prior),
            Entry(one.reference),
            Entry(one.reason),
        )
        for one in subject.calibrated.findings
    ]
    return text_table(
        "Findings: share of the draws in which they come out, with its 95 % interval",
        ("finding", "accepted draws", "all draws", "stated by", "what is asked of a draw"),
        lines,
        numeric=("accepted draws", "all draws"),
    )


def _share_text(one: Share | None) -> Entry:
    if one is None:
        return Entry(ABSENT)
    return Entry(f"{one.share:.0%} ({one.low:.0%} … {one.high:.0%}) of {one.draws}", one.share)


def _linear(subject: ReportData) -> TextTable | None:
    lines = []
    for one in contrasts(subject.rows, subject.results.registry):
        anchors = [subject.anchors[row["cell"]] for row in (one.linear, one.other)]
        lines.append(
            (
                Entry(one.where),
                Entry(one.linear["estimator"]),
                Entry(one.score_text(one.linear), one.linear["score"], anchors[0]),
                Entry(one.other["estimator"]),
                Entry(one.score_text(one.other), one.other["score"], anchors[1]),
                Entry(one.sentence),
            )
        )
    if not lines:
        return None
    return text_table(
        "Linear against non-linear",
        ("question", "linear", "score", "non-linear", "score", "comparison"),
        lines,
        numeric=("score",),
        notes=(
            "The best of each kind by its score on the test set: of many that are equally good, the best of more looks "
            "better. Whether an answer is linear is for its estimator to say.",
        ),
    )
