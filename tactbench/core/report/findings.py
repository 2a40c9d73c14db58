"""Linear answers against non-linear ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tactbench.core.leaderboard.names import LOWER_IS_BETTER, sensor_name
from tactbench.core.plugins.registry import Registry
from tactbench.core.report.published import row_interval
from tactbench.core.report.section import ReportData, Section
from tactbench.core.tables.numbers import score, score_with_unit
from tactbench.core.tables.text_table import Entry, TextTable, text_table

Row = Mapping[str, Any]
_SAME = ("sensor", "task", "rig", "protocol", "split", "repeat")


@dataclass(frozen=True)
class Contrast:
    """The best linear and the best other answer to one question about one sensor."""

    linear: Row
    other: Row

    @property
    def where(self) -> str:
        """What was asked of which sensor, and how."""
        row = self.linear
        parts = [sensor_name(row), row["task"], row["protocol"], row["split"] or ""]
        return ", ".join(part for part in parts if part)

    @property
    def sentence(self) -> str:
        """Which is better, by how much, and whether their intervals are apart."""
        unit = self.linear["unit"]
        by = self.other["score"] - self.linear["score"]
        if by == 0:
            return "they score the same"
        better = "non-linear" if (by < 0) == (self.linear["metric"] in LOWER_IS_BETTER) else "linear"
        low, high = sorted((self.linear, self.other), key=lambda row: float(row["score"]))
        if low["ci_high"] is None or high["ci_low"] is None:
            return f"{better} is better by {score_with_unit(abs(by), unit)}; too few replicates for intervals"
        apart = "are apart" if low["ci_high"] < high["ci_low"] else "overlap"
        return f"{better} is better by {score_with_unit(abs(by), unit)}; the intervals {apart}"

    @staticmethod
    def score_text(row: Row) -> str:
        """Return a score and its interval as text."""
        return f"{score(row['score'], row['unit'])} ({row_interval(row)})"


def contrasts(rows: Sequence[Row], registry: Registry) -> list[Contrast]:
    """Return a contrast for each question that was answered in both ways; baselines are neither."""
    groups: dict[tuple[Any, ...], dict[bool, list[Row]]] = {}
    for row in rows:
        kind = _linear(row, registry)
        if row["status"] == "done" and not row["is_baseline"] and kind is not None:
            groups.setdefault(tuple(row[name] for name in _SAME), {}).setdefault(kind, []).append(row)
    return [Contrast(_best(group[True]), _best(group[False])) for group in groups.values() if len(group) == 2]


def _linear(row: Row, registry: Registry) -> bool | None:
    name = row["estimator"]
    return registry.estimators[name].linear if name in registry.estimators.names() else None


def _best(rows: Sequence[Row]) -> Row:
    sign = 1.0 if rows[0]["metric"] in LOWER_IS_BETTER else -1.0
    return min(rows, key=lambda row: sign * float(row["score"]))


def findings_section(subject: ReportData) -> Section:
    """Return the section that compares linear with non-linear answers."""
    table = _linear_table(subject)
    if table is not None:
        return Section("findings", "Linear and non-linear estimators", tables=(table,))
    lacks = (
        "No task was answered both linearly and otherwise: add `--estimator` to `tactbench run`, twice; "
        "`tactbench list estimators` has them."
    )
    return Section("findings", "Linear and non-linear estimators", missing=(lacks,))


def _linear_table(subject: ReportData) -> TextTable | None:
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
