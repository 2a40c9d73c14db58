"""Every published number of the tasks beside ours: how the two compare in one sentence, and their table."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from tactbench.core.leaderboard.columns import row_interval as row_interval
from tactbench.core.leaderboard.names import LOWER_IS_BETTER
from tactbench.core.plugins.registry import Registry
from tactbench.core.report.section import ReportData, Section
from tactbench.core.spec.task import Published, TaskSpec
from tactbench.core.statistics.replicates import counted, percent
from tactbench.core.tables.numbers import score, score_with_unit
from tactbench.core.tables.text import command_line
from tactbench.core.tables.text_table import ABSENT, Entry, TextTable, finite, text_table

Row = Mapping[str, Any]
Verdict = Literal["inside", "outside", "no interval", "no answer"]


@dataclass(frozen=True)
class Reproduction:
    """One published number, one of our rows beside it."""

    title: str
    task: str
    protocol: str
    estimator: str
    sensor: str
    published: float
    reference: str
    remark: str
    unit: str
    row: Row | None
    """What stands beside it; None: nothing has been run."""
    verdict: Verdict
    """`inside`: the published number lies in the interval of our score; `no interval`: too few replicates have one."""
    sentence: str


def reproduce(registry: Registry, rows: Sequence[Row]) -> list[Reproduction]:
    """Return a line for each published number of each task, and each row that it may stand beside.

    A number without any row gets one line that names the command to run, unless it takes recordings made elsewhere
    (see `unasked`). Tasks come in the order of the rows.
    """
    lines: list[Reproduction] = []
    task_names = list(dict.fromkeys(row["task"] for row in rows))
    known = {descriptor.name: descriptor.spec for descriptor in registry.tasks}
    for name in sorted(known, key=lambda name: task_names.index(name) if name in task_names else len(task_names)):
        task = known[name]
        for published in task.published:
            beside = [row for row in rows if stands_beside(row, task, published)]
            for row in beside:
                lines.append(_beside(task, published, row, *verdict(row, published.score)))
            if not beside and not _needs_recordings(task, published, registry):
                command = _command(task, published, registry)
                lines.append(_beside(task, published, None, "no answer", f"not run: `{command}`"))
    return lines


def unasked(registry: Registry, rows: Sequence[Row]) -> list[str]:
    """Return a sentence for each published number that only recordings made elsewhere can stand beside."""
    return [
        f"Not asked here: {_title(task, published, None)} ({score_with_unit(published.score, task.unit)}; "
        f"{published.reference}): `{_command(task, published, registry)}`."
        for task in (descriptor.spec for descriptor in registry.tasks)
        for published in task.published
        if _needs_recordings(task, published, registry) and not any(stands_beside(row, task, published) for row in rows)
    ]


def _needs_recordings(task: TaskSpec, published: Published, registry: Registry) -> bool:
    sensor = published.sensor
    unknown = sensor is not None and (sensor not in registry.sensors or registry.sensors[sensor].transducer is None)
    return unknown or not task.scenes


def stands_beside(row: Row, task: TaskSpec, published: Published) -> bool:
    """Tell whether `row` may be compared with a published number: as the row itself says it may."""
    if row["task"] != task.name or row["params"] or (published.estimator is None and row["is_baseline"]):
        return False
    return task.published_for(row["sensor"], row["protocol"], row["estimator"], row["split"]) == published


def verdict(row: Row, published: float) -> tuple[Verdict, str]:
    """Return how a row compares with a published number, and one sentence that says so.

    Parameters
    ----------
    row
        A row of any status.
    published
        In the unit of the row's metric.
    """
    if row["status"] != "done":
        return "no answer", f"{row['status']}: {row['reason']}"
    if row["ci_low"] is None or row["ci_high"] is None:
        few = f"{_replicates(row)}: too few for an interval, so whether it is reproduced cannot be said"
        return "no interval", f"{few}; {_difference(row, published)}"
    if row["ci_low"] <= published <= row["ci_high"]:
        return "inside", f"inside: the published lies in our {_level(row)} interval{_over(row)}"
    end = "below" if published < row["ci_low"] else "above"
    parts = [
        f"outside: {_difference(row, published)}, and the published lies {end} our {_level(row)} interval{_over(row)}"
    ]
    if row.get("replicate_unit") != "replicate":
        method = re.sub(r" \([^)]*\)", "", row["ci_method"])
        parts.append(f"the interval is by {method}")
    return "outside", "; ".join(parts)


def _replicates(row: Row) -> str:
    n, unit = int(row.get("n_replicates") or 1), str(row.get("replicate_unit") or "replicate")
    return f"one {unit}" if n == 1 else counted(n, unit)


def _level(row: Row) -> str:
    return percent(row.get("n_replicates"), row.get("replicate_unit"))


def _over(row: Row) -> str:
    return f" over {_replicates(row)}" if row.get("n_replicates") else ""


def _difference(row: Row, published: float) -> str:
    ours, unit = row["score"], row["unit"]
    by = abs(ours - published)
    if by == 0:
        return "ours is the published"
    share = f" ({100 * by / abs(published):.1f} %)" if published else ""
    better = (ours < published) == (row["metric"] in LOWER_IS_BETTER)
    where = "below" if ours < published else "above"
    word = "better" if better else "worse"
    return f"ours is {score_with_unit(by, unit)}{share} {where} the published, which is {word}"


def _beside(task: TaskSpec, published: Published, row: Row | None, word: Verdict, sentence: str) -> Reproduction:
    return Reproduction(
        title=_title(task, published, row["sensor"] if row else None),
        task=task.name,
        protocol=published.protocol,
        estimator=row["estimator"] if row else published.estimator or "",
        sensor=row["sensor"] if row else published.sensor or "",
        published=published.score,
        reference=published.reference,
        remark=published.remark,
        unit=task.unit,
        row=row,
        verdict=word,
        sentence=sentence,
    )


def _title(task: TaskSpec, published: Published, sensor: str | None) -> str:
    title = published.title or f"{task.name}, {task.metric}"
    return f"{title} ({sensor})" if published.sensor is None and sensor else title


def _command(task: TaskSpec, published: Published, registry: Registry) -> str:
    """Return what to type for a row that the number may stand beside."""
    sensor = published.sensor
    words = ["tactbench", "run", *(["--sensor", sensor] if sensor else []), "--task", task.name]
    words += ["--protocol", published.protocol]
    if published.split:
        words += ["--split", published.split]
    trivial = published.estimator in task.baselines  # run with any other
    if published.estimator and not trivial:
        words += ["--estimator", published.estimator]
    if _needs_recordings(task, published, registry):
        words += ["--rig", "replay", "--recordings", "DIR"]
    return command_line(*words)


def records(lines: Iterable[Reproduction]) -> list[dict[str, Any]]:
    """Return the lines for programs: flat, the same keys in each."""
    about = ("title", "task", "sensor", "protocol", "estimator", "unit", "published", "reference", "remark")
    found = []
    for line in lines:
        row = line.row or {}
        found.append(
            {name: getattr(line, name) for name in about}
            | {"cell": row.get("cell"), "simulated": bool(row["simulated"]) if row else None}
            | {name: row.get(name) for name in ("score", "ci_low", "ci_high")}
            | {"verdict": line.verdict, "sentence": line.sentence}
        )
    return found


def interval_text(line: Reproduction) -> str:
    """Return the interval of our score as text."""
    return row_interval(line.row) if line.row is not None and line.row["status"] == "done" else "–"


COLUMNS = ("number", "published", "ours", "95 % interval", "verdict")
NUMERIC = ("published", "ours", "95 % interval")


def published_section(subject: ReportData) -> Section:
    """Return the section of published numbers."""
    table = published_table(subject)
    if not table.lines:
        return Section("reproduction", "Published numbers, and ours", missing=("No task installed here states any.",))
    paragraphs = (
        "Each number is held against the 95 % interval of our score over its replicates: inside, it is reproduced as "
        "far as they can tell.",
    )
    return Section("reproduction", "Published numbers, and ours", paragraphs=paragraphs, tables=(table,))


def published_table(subject: ReportData) -> TextTable:
    """Return the reproduction table of all tasks that are installed."""
    lines = reproduce(subject.results.registry, subject.rows)
    titles: dict[str, list[str]] = {}
    for line in lines:
        if line.remark:
            titles.setdefault(line.remark, []).append(line.title)
    notes = [f"{', '.join(dict.fromkeys(whose))}: {remark}." for remark, whose in titles.items()]
    notes += unasked(subject.results.registry, subject.rows)
    return text_table(
        "Reproduction",
        COLUMNS,
        [_entries(line, subject) for line in lines],
        numeric=NUMERIC,
        notes=notes,
        kinds=[line.verdict.replace(" ", "-") for line in lines],
    )


def _entries(line: Reproduction, subject: ReportData) -> tuple[Entry, ...]:
    row = line.row
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
        Entry(line.sentence),
    )
