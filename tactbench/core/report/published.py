"""Every published number of the tasks beside ours: how the two compare in one sentence, and their table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.task import Published, TaskSpec
from tactbench.core.statistics.replicates import against_reference
from tactbench.core.tables.numbers import interval as ends
from tactbench.core.tables.numbers import score, signed
from tactbench.core.tables.text import command_line
from tactbench.core.tables.text_table import ABSENT, Entry, TextTable, finite, text_table

Row = Mapping[str, Any]
Verdict = Literal["inside", "outside", "no interval", "no answer"]
COLUMNS = ("number", "published", "ours", "interval", "ours − published", "verdict")


@dataclass(frozen=True)
class Reproduction:
    """One published number, one of our rows beside it."""

    task: TaskSpec
    published: Published
    row: Row | None
    """What stands beside it; None: nothing has been run."""
    verdict: Verdict
    """`inside`: the published number lies in the interval of our score; `no interval`: too few replicates have one."""
    reason: str = ""
    """Why there is no answer."""

    @property
    def title(self) -> str:
        """What was published; of a number of no certain sensor or estimator, with that of our row."""
        title = self.published.title or f"{self.task.name}, {self.task.metric}"
        ours = [
            str(self.row[key]) for key in ("sensor", "estimator") if getattr(self.published, key) is None and self.row
        ]
        return f"{title} ({', '.join(ours)})" if ours else title


def reproduce(registry: Registry, rows: Sequence[Row]) -> list[Reproduction]:
    """Return a line for each published number of each task, and each row that it may stand beside.

    A number without any row gets one line that names the command to run, unless it takes recordings made elsewhere.
    Tasks come in the order of the rows.
    """
    lines: list[Reproduction] = []
    rows = list(map(against_reference, rows))
    names = list(dict.fromkeys(row["task"] for row in rows))
    order = {name: place for place, name in enumerate(names)}
    tasks = [descriptor.spec for descriptor in registry.tasks]
    for task in sorted(tasks, key=lambda task: (order.get(task.name, len(order)), task.name)):
        for published in task.published:
            beside = [row for row in rows if stands_beside(row, task, published)]
            lines += [Reproduction(task, published, row, *_verdict(row, published.score)) for row in beside]
            if not beside and not _needs_recordings(task, published, registry):
                command = _command(task, published)
                lines.append(Reproduction(task, published, None, "no answer", f"not run: `{command}`"))
    return lines


def _needs_recordings(task: TaskSpec, published: Published, registry: Registry) -> bool:
    sensor = published.sensor
    unknown = sensor is not None and (sensor not in registry.sensors or registry.sensors[sensor].transducer is None)
    return unknown or not task.scenes


def stands_beside(row: Row, task: TaskSpec, published: Published) -> bool:
    """Tell whether `row` may be compared with a published number: as the row itself says it may."""
    if row["task"] != task.name or row["params"] or (published.estimator is None and row["is_baseline"]):
        return False
    return task.published_for(row["sensor"], row["protocol"], row["estimator"], row["split"]) == published


def _verdict(row: Row, published: float) -> tuple[Verdict, str]:
    if row["status"] != "done":
        return "no answer", f"{row['status']}: {row['reason']}"
    low, high = row["ci_low"], row["ci_high"]
    if low is None:
        return "no interval", ""
    return "inside" if low <= published and (high is None or published <= high) else "outside", ""


def _command(task: TaskSpec, published: Published) -> str:
    """Return what to type for a row that the number may stand beside."""
    words = ["tactbench", "run", *(["--sensor", published.sensor] if published.sensor else []), "--task", task.name]
    words += ["--protocol", published.protocol]
    if published.split:
        words += ["--split", published.split]
    if published.estimator and published.estimator not in task.baselines:  # those are run with any other
        words += ["--estimator", published.estimator]
    return command_line(*words)


def published_table(registry: Registry, rows: Sequence[Row]) -> TextTable:
    """Return the reproduction table of all tasks that are installed."""
    lines = reproduce(registry, rows)
    titles: dict[str, list[str]] = {}
    for line in lines:
        if line.published.remark:
            titles.setdefault(line.published.remark, []).append(line.published.title or line.title)
    notes = [f"{', '.join(dict.fromkeys(whose))}: {remark}." for remark, whose in titles.items()]
    return text_table(
        "Published numbers, and ours",
        COLUMNS,
        [_entries(line) for line in lines],
        numeric=COLUMNS[1:5],
        notes=notes,
        kinds=[line.verdict.replace(" ", "-") for line in lines],
    )


def _entries(line: Reproduction) -> tuple[str, ...]:
    row, unit, published = line.row or {}, line.task.unit, line.published.score
    ours = interval = apart = ABSENT
    if row and row["score"] is not None:
        marks = (" SIM" if row["simulated"] else "") + (" †" if row["dagger"] else "")
        ours = Entry(score(row["score"], unit) + marks, finite(row["score"]), cell=row["cell"])
        interval = Entry(ends(row["ci_low"], row["ci_high"], unit), finite(row["ci_low"]))
        apart = Entry(signed(row["score"] - published, unit), row["score"] - published)
    digits = f"{published:g}" if unit == "1" else score(published, unit)
    return (
        f"{line.title}; {line.published.reference}",
        Entry(digits, published),
        ours,
        interval,
        apart,
        line.reason or line.verdict,
    )
