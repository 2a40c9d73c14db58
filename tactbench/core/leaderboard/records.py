"""The keys of rows, in order and in groups; a table as records for programs, with the texts that people see."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tactbench.core.leaderboard.columns import SHOWN
from tactbench.core.leaderboard.table import Table
from tactbench.core.spec.row import FORMAT, ReplicatedRow, RowModel
from tactbench.core.tables.text import json_text, visible

_ELSEWHERE = ("simulation", "traceback", "log", "plan", "digests")
"""What is large or of no use to a program: `why`, the page and the cell's own file have it."""
_OF_CELL = [key for key in RowModel.model_fields if key not in _ELSEWHERE]
JSON_KEYS = (*_OF_CELL[:-1], "key", _OF_CELL[-1])
"""Keys of a JSON row, in order."""
OF_REPLICATES = tuple(key for key in ReplicatedRow.model_fields if key not in ("key", *RowModel.model_fields))
"""Keys of a row that stands for all replicates of its cell; they follow."""
RANK_KEYS = ("rank", "rank_low", "rank_high", "rank_tied")
"""Where a row stands in its block; they follow the keys of the row."""

NESTED = frozenset(key for key in (*JSON_KEYS, *OF_REPLICATES) if not FORMAT[key].isdisjoint({list, dict}))
"""Keys whose values are lists or tables: JSON inside a cell of CSV and Parquet."""

GROUPS: dict[str, tuple[str, ...]] = {
    "Configuration": (
        "cell", "key", "sensor", "task", "rig", "simulated", "emulated", "protocol", "dagger", "split", "estimator",
        "is_baseline", "looks_at", "answer_per", "answer_from", "declared_task", "repeat", "repeats", "seed",
        "threads",
    ),
    "Answer": (
        "status", "reason", "signal", "metric", "unit", "score", "ci_low", "ci_high", "ci_method",
        "reference_floor", "score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high", "true_score",
        "true_ci_low", "true_ci_high", "tare_s", "baseline",
        "published", "published_reference", "published_remark", "equivalence", "reference_score", "n_recordings",
        "n_sessions", "n_train", "n_test",
    ),
    "Times and memory": (
        "sim_s", "search_s", "fit_s", "predict_s", "batch_rows", "latency_ms_p50", "latency_ms_p95",
        "latency_ms_max", "latency_n", "answer_delay_ms",
        "wall_s", "peak_rss_mb", "host", "concurrency", "made_by",
    ),
}  # fmt: skip
"""Single values; a key that is in no group comes last, so that none is ever left out."""

OF_THE_MACHINE = frozenset(GROUPS["Times and memory"]) | {
    "delay_parts_ms", "threads", "search", "recordings", "key", "events", "operating_points",
}  # fmt: skip
"""Keys that machine, place or hour decide, not the seed alone."""

TITLES = {
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
    "replicates": "What the interval is over",
}
"""Lists and tables."""

APART = ("traceback", "classes")
"""Shown in places of their own."""


def keys(table: Table) -> tuple[str, ...]:
    """Return the keys that a table's records have, before their ranks."""
    every = (*JSON_KEYS, *OF_REPLICATES)
    return every if table.times else tuple(key for key in every if key not in OF_THE_MACHINE)


def records(table: Table) -> Iterator[tuple[dict[str, Any], dict[str, str]]]:
    """Yield each line's row, ranks among it, and its texts by what their columns are called for programs."""
    chosen = keys(table)
    for line in table.lines:
        one = line.placing
        ranks = (one.place, one.low, one.high, one.tied) if one else (None, None, None, None)
        row = {key: line.row.get(key) for key in chosen} | dict(zip(RANK_KEYS, ranks, strict=True))
        yield row, {SHOWN[name]: text for name, text in line.texts.items()}


def flat_records(table: Table) -> tuple[list[str], Iterator[list[Any]]]:
    """Return names of columns and lines for formats whose cells hold one value: lists and tables are JSON."""
    names = [*keys(table), *RANK_KEYS, *(f"shown_{SHOWN[name]}" for name in table.columns)]
    lines = ([*(_flat(*one) for one in row.items()), *shown.values()] for row, shown in records(table))
    return names, lines


def _flat(key: str, value: Any) -> Any:
    if key in NESTED:
        return json_text(value)
    return visible(value) if isinstance(value, str) else value
