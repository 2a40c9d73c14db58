"""Table of event detectors, such as for slip: misses, latency, false alarms."""

from __future__ import annotations

from collections.abc import Sequence

from tactbench.core.leaderboard.names import Row, answer_name
from tactbench.core.tables.numbers import ABSENT
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable, text_table

_FIGURES = {
    "precision": "precision", "recall": "recall", "misses": "misses", "events": "events",
    "latency p50 [ms]": "onset latency p50 ms", "p95 [ms]": "onset latency p95 ms",
    "false alarms/min": "false alarms per minute",
    "compute [s/s]": "compute s per s of signal",
}  # fmt: skip
"""Key of the figure of merit of each column."""
_NOTE = (
    "Latency: from the labelled onset to the alarm, with the detector's computing time, over hits; negative is early. "
    "Compute: computing time per second of signal."
)


def events_table(rows: Sequence[Row]) -> TextTable | None:
    """Return the table of event detection from the finished rows; None if no row is of an event task."""
    finished = [row for row in rows if row["status"] == "done" and row.get("events")]
    if not finished:
        return None
    lines = []
    for row in finished:
        figures = row["events"]
        values = {name: figures.get(key) for name, key in _FIGURES.items()}
        texts = {name: ABSENT if value is None else f"{value:.3g}" for name, value in values.items()}
        if figures.get("alarms") == 0:
            texts["latency p50 [ms]"] = "never alarms"
        lines.append((visible(row["task"]), visible(row["sensor"]), answer_name(row), *texts.values()))
    bound, area = (
        " or ".join(dict.fromkeys(f"{row['events'][key]:g}" for row in finished if key in row["events"]))
        for key in ("bound of false alarms per minute", "area up to false alarms per minute")
    )
    limit = f" for at most {bound} false alarms a minute" if bound else ""
    notes = (f"Recall area: recall, averaged over false alarms a minute from 0 to {area}. " * bool(area) + _NOTE,)
    kinds = ["baseline" if row["is_baseline"] else "result" for row in finished]
    title = f"Events, at the threshold that validation recordings chose{limit}"
    columns = ("task", "sensor", "estimator", *_FIGURES)
    return text_table(title, columns, lines, numeric=_FIGURES, kinds=kinds, notes=notes)
