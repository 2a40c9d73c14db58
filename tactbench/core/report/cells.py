"""Details of a cell for the report: the values of its row, and the scores of its recordings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.leaderboard.names import METRIC_NAMES, Row
from tactbench.core.report.results import Details
from tactbench.core.samples import Answers
from tactbench.core.spec.row import TRUE, Asked, Cost, Ended, RestsOn, Scored
from tactbench.core.tables.text_table import field_text, records_table

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
