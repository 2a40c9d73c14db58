"""A table as records for programs: every row in full, its ranks, and the text of every column as people see it."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from typing import Any

from tactbench.core.leaderboard.columns import SHOWN
from tactbench.core.leaderboard.lines import Line
from tactbench.core.leaderboard.table import Table
from tactbench.core.spec.row import FORMAT

JSON_KEYS = (
    "cell", "sensor", "task", "rig", "protocol", "split", "estimator", "params", "is_baseline", "looks_at",
    "repeat", "repeats", "seed", "status", "reason", "signal", "metric", "unit", "equivalence", "reference_score",
    "score", "ci_low", "ci_high", "ci_method", "reference_floor", "score_beyond_floor", "beyond_floor_ci_low",
    "beyond_floor_ci_high",
    "true_score", "true_ci_low", "true_ci_high", "tare_s", "baseline", "published",
    "published_reference", "published_remark", "n_recordings",
    "n_sessions", "n_train", "n_test", "sim_s", "search_s", "fit_s", "predict_s", "batch_rows", "latency_ms_p50",
    "latency_ms_p95", "latency_ms_max", "latency_n", "answer_delay_ms", "delay_parts_ms", "threads", "peak_rss_mb",
    "wall_s", "concurrency", "host", "made_by", "simulated", "emulated",
    "dagger", "stamps", "remarks", "assumptions", "counts", "chosen", "search", "scores", "fold_sizes", "confusion",
    "classes", "recordings", "key", "replicates",
)  # fmt: skip
"""Keys of a JSON row, in order."""

OF_REPLICATES = (
    "n_replicates",
    "replicate_unit",
    "replicate_scores",
    "seeds",
    "score_min",
    "score_max",
    "recordings_right",
    "recordings_asked",
)
"""Keys of a row that stands for all replicates of its cell; they follow."""

RANK_KEYS = ("rank", "rank_low", "rank_high", "rank_tied")
"""Where a row stands in its block; they follow the keys of the row."""

NESTED = frozenset(key for key in (*JSON_KEYS, *OF_REPLICATES) if not FORMAT[key].types.isdisjoint({list, dict}))
"""Keys whose values are lists or tables: JSON inside a cell of CSV and Parquet."""

OF_THE_MACHINE = frozenset({
    "sim_s", "search_s", "fit_s", "predict_s", "batch_rows", "latency_ms_p50", "latency_ms_p95",
    "latency_ms_max", "latency_n", "answer_delay_ms", "delay_parts_ms", "threads", "peak_rss_mb", "wall_s",
    "concurrency", "host", "made_by", "search", "recordings", "key",
})  # fmt: skip
"""Keys that machine, place or hour decide, not the seed alone."""

_ACTS = re.compile("[\x7f-\x9f\xad\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff]")
"""Controls, marks of direction and lone surrogates."""


def keys(table: Table) -> tuple[str, ...]:
    """Return the keys that a table's records have, before their ranks."""
    every = (*JSON_KEYS, *OF_REPLICATES)
    return every if table.times else tuple(key for key in every if key not in OF_THE_MACHINE)


def records(table: Table) -> Iterator[tuple[dict[str, Any], dict[str, str]]]:
    """Yield each line's row, ranks among it, and its text by column."""
    chosen = keys(table)
    for line in table.lines:
        yield {key: line.row.get(key) for key in chosen} | _ranks(line), shown(line)


def shown(line: Line) -> dict[str, str]:
    """Return the text of a line, by what its columns are called for programs."""
    return {SHOWN[name]: text for name, text in line.texts.items()}


def finite(value: Any) -> Any:
    """Return `value` with None in place of every number that is not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [finite(one) for one in value]
    return value


def json_text(value: Any, **how: Any) -> str:
    """Return `value` as JSON: what acts on a terminal or is no UTF-8 is escaped; a number that is none is null."""
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False, **how)
    except ValueError:
        text = json.dumps(finite(value), ensure_ascii=False, allow_nan=False, **how)
    if text.isascii() and "\x7f" not in text:
        return text
    return _ACTS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def _ranks(line: Line) -> dict[str, Any]:
    one = line.placing
    return dict(
        zip(RANK_KEYS, (one.place, one.low, one.high, one.tied) if one else (None, None, None, None), strict=True)
    )
