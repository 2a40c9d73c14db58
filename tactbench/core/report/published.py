"""Comparison of published scores with ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

from tactbench.core.leaderboard.names import grouped
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.task import Published, TaskSpec
from tactbench.core.statistics.replicates import against_reference
from tactbench.core.tables.numbers import interval, score, signed
from tactbench.core.tables.text_table import ABSENT, Entry, TextTable, finite, text_table

Row = Mapping[str, Any]
Verdict = Literal["inside", "outside", "no interval", "no answer"]
COLUMNS = ("number", "published", "ours", "interval", "ours − published", "verdict")


class Reproduction(NamedTuple):
    """A published score, and a comparable row of our results."""

    task: TaskSpec
    published: Published
    row: Row

    @property
    def title(self) -> str:
        """Title of the published score, with our sensor and estimator where the publication does not state them."""
        title = self.published.title or f"{self.task.name}, {self.task.metric}"
        ours = [str(self.row[key]) for key in ("sensor", "estimator") if getattr(self.published, key) is None]
        return f"{title} ({', '.join(ours)})" if ours else title

    @property
    def verdict(self) -> Verdict:
        """`inside` if the published score lies in our interval; `no interval`: too few replicates for an interval."""
        if self.row["status"] != "done":
            return "no answer"
        low, high = self.row["ci_low"], self.row["ci_high"]
        if low is None:
            return "no interval"
        return "inside" if low <= self.published.score and (high is None or self.published.score <= high) else "outside"


def reproduce(registry: Registry, rows: Sequence[Row]) -> list[Reproduction]:
    """Return one comparison for each published score and comparable row, tasks in the order of the rows."""
    rows = list(map(against_reference, rows))
    tasks = [registry.tasks[name].spec for name in dict.fromkeys(row["task"] for row in rows) if name in registry.tasks]
    return [
        Reproduction(task, published, row)
        for task in tasks
        for published in task.published
        for row in rows
        if stands_beside(row, task, published)
    ]


def stands_beside(row: Row, task: TaskSpec, published: Published) -> bool:
    """Return True if `row` is comparable with a published score."""
    if row["task"] != task.name or row["params"] or (published.estimator is None and row["is_baseline"]):
        return False
    return task.published_for(row["sensor"], row["protocol"], row["estimator"], row["split"]) == published


def published_table(registry: Registry, rows: Sequence[Row]) -> TextTable:
    """Return the table of published scores, ours, and their differences."""
    lines = reproduce(registry, rows)
    stated = grouped((line.published for line in lines if line.published.remark), lambda one: one.remark)
    notes = [f"{', '.join(dict.fromkeys(one.title for one in own))}: {remark}." for remark, own in stated.items()]
    kinds = [line.verdict.replace(" ", "-") for line in lines]
    entries = list(map(_entries, lines))
    return text_table("Published numbers, and ours", COLUMNS, entries, numeric=COLUMNS[1:5], notes=notes, kinds=kinds)


def _entries(line: Reproduction) -> tuple[str, ...]:
    row, unit, published = line.row, line.task.unit, line.published.score
    title = f"{line.title}; {line.published.reference}"
    theirs = Entry(f"{published:g}" if unit == "1" else score(published, unit), published)
    if row["score"] is None:
        return (title, theirs, ABSENT, ABSENT, ABSENT, f"{row['status']}: {row['reason']}")
    marks = (" SIM" if row["simulated"] else "") + (" †" if row["dagger"] else "")
    return (
        title,
        theirs,
        Entry(score(row["score"], unit) + marks, finite(row["score"]), cell=row["cell"]),
        Entry(interval(row["ci_low"], row["ci_high"], unit), finite(row["ci_low"])),
        Entry(signed(row["score"] - published, unit), row["score"] - published),
        line.verdict,
    )
