"""Data of a report: result rows with their answers and recordings, figures, details of cells, and published scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any, Literal, NamedTuple

import numpy as np

from tactbench.core.errors import DataError
from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.leaderboard.names import METRIC_NAMES, Row, grouped
from tactbench.core.leaderboard.table import Table, over_all, table_of
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.declared import with_declared_of
from tactbench.core.plugins.registry import Registry
from tactbench.core.samples import Answers
from tactbench.core.spec.row import TRUE, Asked, Cost, Ended, RestsOn, Scored
from tactbench.core.spec.task import Published, TaskSpec
from tactbench.core.statistics.replicates import against_reference
from tactbench.core.tables.text import (
    ABSENT,
    Entry,
    TextTable,
    field_text,
    finite,
    interval,
    records_table,
    score,
    signed,
    text_table,
)

MOST_CELLS = 500
"""Largest number of cells whose details a page shows; each takes 20 kB and the reading of a file."""


@dataclass(frozen=True)
class SavedFigure:
    """A figure saved as PNG and PDF, with title and caption."""

    name: str
    """Short name for files and anchors, such as ``force-against-time``."""
    title: str
    """Heading: the question that the figure answers."""
    caption: str
    """Description of axes and marks, in complete sentences as for a paper."""
    png: Path
    """Path of the PNG file; the PDF has the same path with another suffix."""


@dataclass(frozen=True)
class Results:
    """The results of a folder, opened for reading, with the figures drawn from them.

    Parameters
    ----------
    registry
        Registry with the specs of sensors and tasks.
    rows
        One row for each cell, over its replicates.
    replicates
        The stored rows, one for each cell and replicate, by key.
    drawn
        Figures drawn from these results.
    """

    store: Store
    registry: Registry
    rows: tuple[Row, ...]
    replicates: Mapping[str, Row] = field(default_factory=dict)
    drawn: tuple[SavedFigure, ...] = ()
    undrawn: tuple[str, ...] = ()
    """One sentence for each figure that could not be drawn."""

    @cached_property
    def leaderboard(self) -> Table:
        """The rows arranged as ranked tables."""
        return table_of(self.store, self.rows)

    @cached_property
    def anchors(self) -> dict[str, str]:
        """HTML anchor of each cell's details, by name of the cell; empty for more than `MOST_CELLS` cells."""
        lines = self.leaderboard.lines if len(self.rows) <= MOST_CELLS else ()
        return {str(line.row["cell"]): f"cell-{place}" for place, line in enumerate(lines, 1)}

    def answers(self, row: Row) -> dict[str, Answers]:
        """Return the answers of a cell by role; empty if the cell did not finish."""
        return self.store.answers(str(row["key"]))

    def replicate(self, row: Row) -> Row:
        """Return the row of the replicate whose answers represent a cell, with the cell's number of replicates."""
        return {**self.replicates.get(str(row["key"]), row), "repeats": row["repeats"]}

    def recordings(self, row: Row) -> list[Path]:
        """Return the paths of a cell's recordings; ``Answers.recording`` is an index into this list.

        Raises
        ------
        DataError
            If a recording does not exist.
        """
        found = []
        for path, recording in self.store.recordings(row):
            if recording is None:
                raise DataError(
                    f"The recording {path}, on which {row['cell']} was evaluated, does not exist.",
                    hint="Put the file back, or run the cell again.",
                )
            found.append(recording)
        return found


def open_results(store: Store, registry: Registry) -> Results:
    """Return the results of the folder `store`, with the registry of its sensors and tasks."""
    rows = store.rows()
    shown = tuple(over_all(store, rows))
    return Results(store, with_declared_of(registry, shown), shown, {str(row["key"]): row for row in rows})


@dataclass(frozen=True)
class Details:
    """Details of one cell for the report page."""

    cell: str
    status: str
    pairs: Mapping[str, Mapping[str, str]]
    """Names and values, by title of their group."""
    tables: tuple[TextTable, ...]
    texts: Mapping[str, str]
    """Texts of many lines, such as a log, by title."""


@dataclass(frozen=True)
class Section:
    """A section of the report page. Text between backticks is shown as code; other markup is escaped."""

    anchor: str = ""
    title: str = ""
    paragraphs: tuple[str, ...] = ()
    tables: tuple[TextTable, ...] = ()
    pictures: tuple[SavedFigure, ...] = ()
    details: tuple[Details, ...] = ()
    missing: tuple[str, ...] = ()
    """One sentence for each missing part of the section."""


_GROUPS = {
    **dict.fromkeys(Asked.model_fields, "Configuration"),
    **dict.fromkeys((*Ended.model_fields, *Scored.model_fields), "Answer"),
    **dict.fromkeys(Cost.model_fields, "Times and memory"),
    **dict.fromkeys(RestsOn.model_fields, "What it rests on"),
}
"""Title of the group of values that a key of a row belongs to."""


def details(row: Row, tested: Answers | None) -> Details:
    """Return the values of a cell's row that are not empty, in titled groups, and the scores of its recordings."""
    known = {name: value for name, value in row.items() if name != "digests" and value not in (None, "", [], {}, ())}
    texts: dict[str, str] = {name: str(known.pop(name)) for name in ("traceback", "log") if name in known}
    of = f", replicate with seed {row['seed']}" if row["repeats"] > 1 else ""
    classes = list(map(str, row.get("classes") or ()))
    confusion = [dict(zip(["true", *classes], [one, *counts], strict=False))
                 for one, counts in zip(classes, known.pop("confusion", ()), strict=False)]  # fmt: skip
    records: dict[str, Any] = {
        f"Score of each recording{of}": recording_scores(row, tested),
        "Confusion: true class down, answer across [rows]": confusion,
    }
    pairs: dict[str, dict[str, str]] = {}
    for name in sorted(known, key=[*_GROUPS, *known].index):
        value = known[name]
        if isinstance(value, list | tuple) and isinstance(value[0], Mapping):
            records[name] = value
        else:
            pairs.setdefault(_GROUPS.get(name, "Replicates"), {})[name] = _text(value)
    tables = tuple(records_table(title, own) for title, own in records.items() if own)
    return Details(cell=str(row["cell"]), status=str(row["status"]), pairs=pairs, tables=tables, texts=texts)


def recording_scores(row: Row, tested: Answers | None) -> list[dict[str, Any]]:
    """Return name, number of rows, metric and score of each test recording of a cell; empty for event metrics.

    For classifications the metric is the accuracy, since a recording may hold a single class.
    """
    metric = METRICS.get(str(row["metric"]).removeprefix(TRUE))
    if tested is None or metric is None or metric.kind == "events":
        return []
    if metric.kind == "classification":
        metric = METRICS["accuracy"]
    found = []
    for number in np.unique(tested.recording):
        own = tested.recording == number
        value = metric.of(tested.y_true[own], tested.y_pred[own], len(row["classes"] or ()))
        found.append({"recording": PurePosixPath(row["recordings"][number]).stem, "test rows": int(own.sum()),
                      "metric": METRIC_NAMES.get(metric.name, metric.name), "score": value})  # fmt: skip
    return found


def _text(value: Any) -> str:
    """Return the text of a value, with one line for each entry of a mapping and for each text of a list."""
    if isinstance(value, Mapping):
        return "\n".join(f"{name}: {text}" for name, one in value.items() if (text := field_text(one)))
    lines = isinstance(value, list | tuple) and any(isinstance(one, str) for one in value)
    return "\n".join(map(field_text, value)) if lines else field_text(value)


Verdict = Literal["inside", "outside", "no interval", "no answer"]
_PUBLISHED = ("number", "published", "ours", "interval", "ours − published", "verdict")


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
    title, entries = "Published numbers, and ours", map(_entries, lines)
    return text_table(title, _PUBLISHED, entries, numeric=_PUBLISHED[1:5], notes=notes, kinds=kinds)


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
