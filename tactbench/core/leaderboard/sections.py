"""Tables below the blocks: events, means over tasks, published figures of others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.names import Row, answer_name, distinct, grouped, metric_name, sensor_name
from tactbench.core.tables.numbers import ABSENT, interval, score
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable

if TYPE_CHECKING:
    from tactbench.core.statistics.aggregate import Aggregate


_FIGURES = {
    "precision": ("precision", ".2f"),
    "recall": ("recall", ".2f"),
    "misses": ("misses", "g"),
    "latency p50 [ms]": ("onset latency p50 ms", ".0f"),
    "p95 [ms]": ("onset latency p95 ms", ".0f"),
    "false alarms/min": ("false alarms per minute", ".2g"),
    "slipped [mm]": ("displacement at detection p50 mm", ".2f"),
    "frames: balanced accuracy": ("frame balanced accuracy", ".2f"),
    "macro F1": ("frame macro F1", ".2f"),
    "compute [s/s]": ("compute s per s of signal", ".2g"),
}
"""Columns, and which figure each shows how."""
_OTHER_LABELS = ("F1 with label thresholds halved", "F1 with label thresholds doubled")
_EVENTS = (
    "Latency: from the labelled onset to the alarm, with the time that the detector computes; negative is early; over "
    "hits alone, so read it beside the misses. Slipped: the median displacement from onset to alarm. Compute: seconds "
    "a second of signal. Definitions: docs/events.md."
)
_POINTS = (
    "A column a bound of false alarms a minute, at which validation recordings chose a threshold; each says what test "
    "recordings then have: recall, false alarms a minute, median latency. No score rests on them."
)
_MEANS = (
    "Over tasks: compare means of the same tasks only. The interval is over replicates; the tasks are those given, not "
    "a sample of all (docs/statistics.md)."
)
MOST_ROWS = 2000
"""Rows beyond which resampling all of them takes too long for a table."""
_OTHERS = "another model than ours"


def sections_of(rows: Sequence[Row], *, times: bool) -> tuple[TextTable | None, ...]:
    """Return the tables that rows in the order of the leaderboard's lines make; those on events hold times."""
    events = (events_section(rows), operating_points_section(rows)) if times else ()
    return (*events, over_tasks(rows), published_section(rows))


def events_section(rows: Sequence[Row]) -> TextTable | None:
    """Return what finished rows say of events besides their F1; None if none says anything."""
    finished = [row for row in rows if row["status"] == "done" and row.get("events")]
    lines = []
    for row in finished:
        figures = row["events"]
        texts = {name: _figure(figures, key, form) for name, (key, form) in _FIGURES.items()}
        if "misses" in figures:
            texts["misses"] += f" of {figures['events']:g}"
        lines.append((*_whose(row), *texts.values()))
    policies = distinct((str(row["answer_from"]), str(row["task"])) for row in finished)
    labels = [
        f"{row['sensor']}/{row['task']}/{answer_name(row)} "
        + " … ".join(_figure(row["events"], key, ".2f") for key in _OTHER_LABELS)
        for row in finished
        if not row["is_baseline"] and any(key in row["events"] for key in _OTHER_LABELS)
    ]
    oracles = dict.fromkeys(answer_name(row) for row in finished if row.get("looks_at") == "reference")
    notes = [
        _EVENTS,
        *(visible(f"{', '.join(tasks)}: {policy}.") for policy, tasks in policies.items()),
        *([visible(f"F1 with the thresholds of the labels halved … doubled: {'; '.join(labels)}.")] if labels else []),
        *(f"{name} reads the reference sensor and knows the friction: an oracle, and no bar." for name in oracles),
    ]
    title = "Events · at the threshold that validation recordings chose"
    kinds = ["baseline" if row["is_baseline"] else "result" for row in finished]
    return _section(title, tuple(_FIGURES), lines, notes, kinds)


def operating_points_section(rows: Sequence[Row]) -> TextTable | None:
    """Return what a detector hits, and how late, where more false alarms are allowed; None where nothing is said."""
    finished = [row for row in rows if row["status"] == "done" and row.get("operating_points")]
    bounds = list(dict.fromkeys(point["bound"] for row in finished for point in row["operating_points"]))
    lines = []
    for row in finished:
        points = {point["bound"]: _point(point) for point in row["operating_points"]}
        lines.append((*_whose(row), *(points.get(bound, ABSENT) for bound in bounds)))
    title = "Events · where more false alarms are put up with"
    return _section(title, tuple(f"{bound:g}/min" for bound in bounds), lines, [_POINTS])


def _whose(row: Row) -> tuple[str, str, str]:
    return visible(row["task"]), sensor_name(row), answer_name(row)


def _section(
    title: str, figures: tuple[str, ...], lines: Sequence[tuple[str, ...]], notes: Sequence[str],
    kinds: Sequence[str] = (),
) -> TextTable | None:  # fmt: skip
    """Return a table of figures, with whose they are before them; None without lines."""
    columns = ("task", "sensor", "estimator", *figures)
    table = TextTable(title, columns, tuple(lines), frozenset(figures), kinds=tuple(kinds), notes=tuple(notes))
    return table if lines else None


def _point(point: Mapping[str, float]) -> str:
    """Return recall, false alarms a minute and latency of one operating point."""
    late = point.get("onset latency p50 ms")
    recall, rate = _figure(point, "recall", ".2f"), _figure(point, "false alarms per minute", ".2g")
    return f"{recall}, {rate}/min" + ("" if late is None else f", {late:.0f} ms")


def _figure(figures: Mapping[str, float | None], key: str, form: str) -> str:
    value = figures.get(key)
    return ABSENT if value is None else f"{value:{form}}"


def over_tasks(rows: Sequence[Row]) -> TextTable | None:
    """Return the mean of each answer that two tasks or more were given: no ranking, and none of single scores.

    A task that was asked under several splits is left out: none of them stands for it.
    """
    groups = grouped(
        filter(_is_averaged, rows),
        lambda row: (sensor_name(row), answer_name(row), visible(row["protocol"]), row["rig"]),
    )
    several = {}
    for key, members in sorted(groups.items()):
        alone = [same[0] for _, same in sorted(grouped(members, itemgetter("task")).items()) if len(same) == 1]
        if len(alone) > 1:
            several[key] = alone
    if sum(map(len, several.values())) > MOST_ROWS:
        return None
    lines = []
    notes: dict[str, None] = {_MEANS: None}
    for (sensor, answer, protocol, _), members in several.items():
        found = _mean(members)
        if found is None:
            continue
        absent = {reason.partition(":")[0] for reason in found.left_out}
        names = ", ".join(visible(row["task"]) for row in members if row["task"] not in absent)
        mean, between = score(found.value, "1"), interval(found.low, found.high, "1")
        lines.append((sensor, answer, protocol, mean, between, names))
        notes |= dict.fromkeys(visible(f"Not in the mean of {sensor}/{answer}: {reason}.") for reason in found.left_out)
    if not lines:
        return None
    title = "Over tasks · interquartile mean between the trivial baseline, 0, and the reference of each task, 1"
    columns = ("sensor", "estimator", "protocol", "mean", "95 % interval", "tasks")
    return TextTable(title, columns, tuple(lines), frozenset(columns[3:5]), notes=tuple(notes))


def _is_averaged(row: Row) -> bool:
    """Return whether a row is an answer that is averaged."""
    return bool(
        row["status"] == "done"
        and not row["is_baseline"]
        and not is_probe(row["protocol"])
        and row["split"] not in ("shuffled", "in-session")
        and row.get("replicates")
        and math.isfinite(row["score"])
    )


def _mean(members: Sequence[Row]) -> Aggregate | None:
    """Return the mean; None where fewer than two tasks are in it, or nothing can be told."""
    from tactbench.core.statistics.aggregate import aggregate

    try:
        found = aggregate(members)
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return None  # rows of a stranger's folder: their replicates may be anything
    return found if found and found.tasks > 1 else None


def published_section(rows: Sequence[Row]) -> TextTable | None:
    """Return the published figures that stand beside some of the rows, each once; None if there is none."""
    lines: dict[tuple[str, ...], None] = {}
    for row in rows:
        if row["published"] is None:
            continue
        remark = str(row["published_remark"])
        whose = _OTHERS if remark.startswith(_OTHERS) else f"their {answer_name(row)}"
        texts = (row["task"], metric_name(row), row["sensor"], row["protocol"], row["split"] or "", whose,
                 row["published_reference"], remark.removeprefix(_OTHERS).removeprefix("; "))  # fmt: skip
        lines[(score(row["published"], row["unit"]), *(visible(str(text)) for text in texts))] = None
    title = "Published figures · by others, with their sensors and data; not ranked with ours"
    about = ("task", "metric", "beside sensor", "protocol", "split", "whose model", "reference", "remark")
    ordered = tuple(sorted(lines, key=lambda line: (line[1:], line[0])))
    return TextTable(title, ("published", *about), ordered, frozenset({"published"}), detail=True) if lines else None
