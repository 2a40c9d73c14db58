"""What a run leaves behind besides its rows: the baselines beside them, and what a seed decides as comparable text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tactbench.core.matrix.store import Row
from tactbench.core.matrix.store.sharing import canonical

SEED_DECIDES = (
    "cell", "status", "metric", "score", "ci_low", "ci_high", "ci_method", "reference_floor",
    "score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high", "true_score", "tare_s", "n_recordings",
    "n_train", "n_test",
    "counts", "chosen", "scores", "confusion", "classes", "split", "stamps", "dagger",
)  # fmt: skip
"""Keys of a row that do not depend on machine or hour: ``scores.json`` holds these."""


def fill_baselines(rows: Sequence[Row]) -> None:
    """Write the score of the first baseline of each group beside every row of the group."""
    by_group: dict[tuple[Any, ...], float] = {}
    for row in rows:
        if row.get("is_baseline") and row["status"] == "done":
            by_group.setdefault(_group(row), row["score"])
    for row in rows:
        row["baseline"] = by_group.get(_group(row))


def _group(row: Row) -> tuple[Any, ...]:
    get = row.get
    return get("sensor"), get("task"), get("rig"), get("protocol"), get("split"), get("repeat")


def scores_text(rows: Sequence[Row]) -> str:
    """Return what a seed decides, as text that may be compared byte by byte: JSON, one row a line."""
    lines = (canonical({key: row[key] for key in SEED_DECIDES}) for row in rows)
    return "[\n" + ",\n".join(lines) + "\n]\n"
