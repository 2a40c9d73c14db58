"""What rows say of events besides their F1: a table of its own, below the leaderboard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.names import METRIC_NAMES, answer_name, sensor_name
from tactbench.core.tables.numbers import ABSENT
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable

Row = Mapping[str, Any]

TITLE = "Events · at the threshold that validation recordings chose"
_FIGURES = {
    "precision": ("precision", ".2f"),
    "recall": ("recall", ".2f"),
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
POINTS_TITLE = "Events · where more false alarms are put up with"
POINTS_NOTE = (
    "A column a bound of false alarms a minute, at which validation recordings chose a threshold; each says what test "
    "recordings then have: recall, false alarms a minute, median latency. No score rests on them."
)
NOTE = (
    "Latency: from the labelled onset to the alarm, with the time that the detector computes; negative is early; over "
    "hits alone, so read it beside the misses. Slipped: the median displacement from onset to alarm. Compute: seconds "
    "a second of signal. Definitions: docs/events.md."
)


def events_section(rows: Sequence[Row]) -> TextTable | None:
    """Return what finished rows say of events; None if none says anything.

    Parameters
    ----------
    rows
        In the order of the leaderboard's lines.
    """
    finished = [row for row in rows if row["status"] == "done" and row.get("events")]
    if not finished:
        return None
    lines = []
    for row in finished:
        figures = row["events"]
        texts = [_figure(figures.get(key), form) for key, form in _FIGURES.values()]
        misses = f"{figures['misses']:g} of {figures['events']:g}" if "misses" in figures else ABSENT
        lines.append((visible(row["task"]), sensor_name(row), answer_name(row), *texts[:2], misses, *texts[2:]))
    names = list(_FIGURES)
    columns = ("task", "sensor", "estimator", *names[:2], "misses", *names[2:])
    kinds = tuple("baseline" if row["is_baseline"] else "result" for row in finished)
    notes = (NOTE, *_policies(finished), *_other_labels(finished), *_oracles(finished))
    return TextTable(TITLE, columns, tuple(lines), frozenset(columns[3:]), kinds=kinds, notes=notes)


def operating_points_section(rows: Sequence[Row]) -> TextTable | None:
    """Return what a detector hits, and how late, where more false alarms are put up with; None where nothing is said.

    Parameters
    ----------
    rows
        In the order of the leaderboard's lines.
    """
    finished = [row for row in rows if row["status"] == "done" and row.get("operating_points")]
    bounds = list(dict.fromkeys(point["bound"] for row in finished for point in row["operating_points"]))
    lines = []
    for row in finished:
        points = {point["bound"]: _point(point) for point in row["operating_points"]}
        texts = [points.get(bound, ABSENT) for bound in bounds]
        lines.append((visible(row["task"]), sensor_name(row), answer_name(row), *texts))
    columns = ("task", "sensor", "estimator", *(f"{bound:g}/min" for bound in bounds))
    if not lines:
        return None
    return TextTable(POINTS_TITLE, columns, tuple(lines), frozenset(columns[3:]), notes=(POINTS_NOTE,))


def _point(point: Mapping[str, float]) -> str:
    """Return recall, false alarms a minute and latency of one operating point."""
    late = point.get("onset latency p50 ms")
    recall, rate = (
        _figure(point.get(key), form) for key, form in (("recall", ".2f"), ("false alarms per minute", ".2g"))
    )
    return f"{recall}, {rate}/min" + ("" if late is None else f", {late:.0f} ms")


def _figure(value: float | None, form: str) -> str:
    return ABSENT if value is None else f"{value:{form}}"


def _policies(rows: Sequence[Row]) -> list[str]:
    """Return what counts as an alarm and a hit, once for all tasks that agree."""
    tasks: dict[str, dict[str, None]] = {}
    for row in rows:
        tasks.setdefault(str(row["answer_from"]), {})[str(row["task"])] = None
    return [visible(f"{', '.join(names)}: {policy}.") for policy, names in tasks.items()]


def _other_labels(rows: Sequence[Row]) -> list[str]:
    """Return the F1 of the same alarms under halved and doubled thresholds of the labels."""
    finished = [
        f"{row['sensor']}/{row['task']}/{answer_name(row)} "
        + " … ".join(_figure(row["events"].get(key), ".2f") for key in _OTHER_LABELS)
        for row in rows
        if not row["is_baseline"] and any(key in row["events"] for key in _OTHER_LABELS)
    ]
    return (
        [visible(f"F1 with the thresholds of the labels halved … doubled: {'; '.join(finished)}.")] if finished else []
    )


def label_notes(rows: Sequence[Row]) -> list[str]:
    """Return the scores of answers to frames under halved and doubled thresholds of their labels."""
    notes = []
    for row in rows:
        name = METRIC_NAMES.get(row["metric"], row["metric"])
        found = [row["scores"].get(f"{name} with label thresholds {how}") for how in ("halved", "doubled")]
        if row["status"] == "done" and not row["is_baseline"] and None not in found:
            ends = " … ".join(_figure(one, ".3f") for one in found)
            notes.append(f"{row['sensor']}/{row['task']}/{answer_name(row)} {ends}")
    return [visible(f"With the thresholds of the labels halved … doubled: {'; '.join(notes)}.")] if notes else []


def _oracles(rows: Sequence[Row]) -> list[str]:
    names = dict.fromkeys(answer_name(row) for row in rows if row.get("looks_at") == "reference")
    return [f"{name} reads the reference sensor and knows the friction: an oracle, and no bar." for name in names]
