"""Collects everything that is known about a cell, for the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.leaderboard.names import METRIC_NAMES, Row
from tactbench.core.report.results import Details, Results
from tactbench.core.samples import Answers
from tactbench.core.spec.row import TRUE, Asked, Cost, Ended, RestsOn, Scored
from tactbench.core.tables.text_table import field_text, records_table

_GROUPS = {
    **dict.fromkeys(Asked.model_fields, "Configuration"),
    **dict.fromkeys((*Ended.model_fields, *Scored.model_fields), "Answer"),
    **dict.fromkeys(Cost.model_fields, "Times and memory"),
    **dict.fromkeys(RestsOn.model_fields, "What it rests on"),
}
"""Titles of groups of single values, by key."""
_TITLES = {
    "params": "Parameters other than the defaults",
    "chosen": "Chosen on validation data",
    "search": "Every candidate that was compared",
    "scores": "Other scores: by class, by fold, by other metrics",
    "events": "Events: at the threshold that validation recordings chose",
    "operating_points": "Events at thresholds for other bounds of false alarms",
    "delay_parts_ms": "Parts of the answer delay [ms]",
    "counts": "What was counted",
    "assumptions": "Assumed by the simulation",
    "plan": "Effects of the first recording: included and left out, with reasons",
    "confusion": "Confusion: true class down, answer across [rows]",
    "recordings": "Recordings",
    "remarks": "Remarks of the recordings",
    "stamps": "Stamps",
    "findings": "Found in the recordings",
    "replicates": "What the interval is over",
}
"""Titles of lists and tables, by key."""
_TEXTS = ("traceback", "log")
_APART = ("classes", "confusion", "fold_sizes")
"""Keys of a row that are shown together with others."""


def details(row: Row, results: Results) -> Details:
    """Return the values of a cell's row that are not empty, and the scores of its folds and recordings."""
    known = {name: value for name, value in row.items() if value not in (None, "", [], {}, ())}
    of = f", replicate with seed {row['seed']}" if row["repeats"] > 1 else ""
    tested = results.answers(row).get("test") if row["status"] == "done" else None
    classes = list(map(str, row.get("classes") or ()))
    counts = zip(classes, known.get("confusion", ()), strict=False)
    records: dict[str, Sequence[Mapping[str, Any]]] = {
        "Score of each fold": _folds(row),
        f"Score of each recording{of}": recording_scores(row, tested),
        _TITLES["confusion"]: [
            {"true": true} | dict(zip(classes, answered, strict=False)) for true, answered in counts
        ],
    }
    pairs: dict[str, dict[str, str]] = {}
    for name in dict.fromkeys((*_GROUPS, *known)):
        value, title = known.get(name), _TITLES.get(name, name)
        if name not in known or name in (*_TEXTS, *_APART):
            continue
        if isinstance(value, Mapping):
            pairs[title] = {str(key): _text(one) for key, one in value.items() if not str(key).startswith("fold ")}
        elif isinstance(value, list | tuple) and isinstance(value[0], Mapping):
            records[title] = value
        else:
            pairs.setdefault(_GROUPS.get(name, "Also"), {})[title] = _text(value)
    return Details(
        cell=str(row["cell"]),
        status=str(row["status"]),
        pairs={title: own for title, own in pairs.items() if own},
        tables=tuple(records_table(title, own) for title, own in records.items() if own),
        texts={name: str(known[name]) for name in _TEXTS if name in known},
    )


def _folds(row: Row) -> list[dict[str, Any]]:
    """Return the score of each fold, of replicates their mean, and how many rows it learned from and answered."""
    sizes = row.get("fold_sizes") or {}
    return [
        {"fold": name.removeprefix("fold "), "score": value}
        | dict(zip(("training rows", "test rows"), sizes.get(name, ()), strict=False))
        for name, value in (row.get("scores") or {}).items()
        if name.startswith("fold ")
    ]


def recording_scores(row: Row, tested: Answers | None) -> list[dict[str, Any]]:
    """Return name, number of rows and score of each test recording that a cell was answered from.

    Of classes the share of right answers, since a recording may hold one class alone; of events nothing, since a
    recording may hold none.
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
        name = METRIC_NAMES.get(metric.name, metric.name)
        recording = PurePosixPath(row["recordings"][number]).stem
        found.append({"recording": recording, "test rows": int(own.sum()), name: value})
    return found


def _text(value: Any) -> str:
    """Return the text of a value, with one line for each text of a list."""
    lines = isinstance(value, list | tuple) and any(isinstance(one, str) for one in value)
    return "\n".join(map(field_text, value)) if lines else field_text(value)
