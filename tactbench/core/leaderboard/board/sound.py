"""Rows that a page can be made of, whatever was handed in: what is odd is set right in a copy, and told.

A row that a run has written is always sound. One from elsewhere may lack keys, hold text where a number belongs, or say
``done`` with a score that is no number; such a row stays a row of the page, and says what is wrong with it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.board.words import tame, tame_text
from tactbench.core.leaderboard.sheet import columns_of
from tactbench.core.leaderboard.table import Table, build_table

Row = Mapping[str, Any]

LONGEST_NAME = 300
"""Characters of a name: longer ones are cut."""
_NOTHING = type(None)
_TEXT = (
    "cell", "sensor", "task", "rig", "protocol", "estimator", "status", "reason", "traceback", "log", "metric", "unit",
    "ci_method", "published_reference", "published_remark", "host", "made_by", "key",
)  # fmt: skip
_NAMES = frozenset(
    {"cell", "sensor", "task", "rig", "protocol", "split", "estimator", "status", "metric", "unit", "host"}
)
_NUMBER = (
    "score", "ci_low", "ci_high", "baseline", "published", "sim_s", "search_s", "fit_s", "predict_s", "latency_ms_p50",
    "latency_ms_p95", "peak_rss_mb", "wall_s", "equivalence", "reference_score",
)  # fmt: skip
_WHOLE = (
    "repeat", "repeats", "seed", "signal", "n_recordings", "n_sessions", "n_train", "n_test", "batch_rows", "latency_n",
    "threads", "concurrency",
)  # fmt: skip
_FLAG = ("is_baseline", "simulated", "dagger")
_LIST = ("stamps", "remarks", "plan", "search", "recordings", "classes")
_TABLE = ("params", "assumptions", "counts", "chosen", "scores", "replicates", "fold_sizes")

# What a key may hold, and what stands for it where it holds anything else.
_KINDS: dict[str, tuple[frozenset[type], Callable[[Any], Any]]] = {
    **dict.fromkeys(_TEXT, (frozenset({str}), lambda value: "" if value is None else tame_text(value))),
    "split": (frozenset({str, _NOTHING}), lambda value: None if value is None else tame_text(value)),
    **dict.fromkeys(_NUMBER, (frozenset({int, float, _NOTHING}), lambda value: _finite(value))),
    **dict.fromkeys(_WHOLE, (frozenset({int, _NOTHING}), lambda value: _whole(value))),
    **dict.fromkeys(_FLAG, (frozenset({bool}), lambda value: value is True)),
    **dict.fromkeys(_LIST, (frozenset({list, tuple}), lambda value: [])),
    **dict.fromkeys(_TABLE, (frozenset({dict}), lambda value: {})),
    "confusion": (frozenset({list, tuple, _NOTHING}), lambda value: None),
}
_FALLBACK = {"repeat": 1, "repeats": 1}


def sound(rows: Sequence[Any]) -> tuple[list[Row], tuple[str, ...]]:
    """Return the rows with what is odd set right, and a sentence on what that was; none if nothing was."""
    kept: list[Row] = [row for row in rows if isinstance(row, Mapping)]
    told = [f"{len(rows) - len(kept)} entries are no rows and are left out."] if len(kept) < len(rows) else []
    odd: Counter[str] = Counter()
    columns, _ = columns_of(kept)
    present = set(columns).intersection(*{tuple(row) for row in kept})
    copies: dict[int, dict[str, Any]] = {}
    for key, (kinds, mend) in _KINDS.items():
        places = _odd_places(kept, columns.get(key, ()), key, kinds, key not in present)
        for place in places:
            if place not in copies:
                copies[place] = dict(kept[place])
            copies[place][key] = _mended(kept[place], key, kinds, mend)
        if places:
            odd[key] = len(places)
    for place, copy in copies.items():
        kept[place] = copy
    for place, row in enumerate(kept):
        if row["status"] == "done" and row["score"] is None:
            kept[place] = {**row, "status": "failed", "reason": "This row says done and holds no finite score."}
            odd["score of a cell that is done"] += 1
    if odd:
        listed = ", ".join(f"{key} ({count} rows)" for key, count in odd.items())
        told.append(f"Not as a run writes them, set right or left out here: {listed}.")
    return kept, tuple(told)


def _odd_places(
    rows: Sequence[Row], values: Sequence[Any], key: str, kinds: frozenset[type], missing: bool
) -> list[int]:
    """Return the places of rows that lack `key` (some do if it is `missing`), or hold what does not belong there."""
    types = set(map(type, values))
    if types <= kinds and not missing and not _limited(values, key, types):
        return []
    return [place for place, row in enumerate(rows) if key not in row or not _fits(row[key], key, kinds)]


def _limited(values: Sequence[Any], key: str, types: Collection[type]) -> bool:
    """Tell whether some value of the right type may still be odd."""
    if key in _NAMES:
        return any(value is not None and len(value) > LONGEST_NAME for value in set(values))
    if float in types:
        return not math.isfinite(sum(filter(None, values)))
    if key in ("counts", "chosen", "stamps", "remarks"):
        return not all(
            _fits(value, key, types) for value in {id(value): value for value in filter(None, values)}.values()
        )
    return False


def _fits(value: Any, key: str, kinds: Collection[type]) -> bool:
    if type(value) not in kinds:
        return False
    if key in _NAMES:
        return value is None or len(value) <= LONGEST_NAME
    if type(value) is float:
        return math.isfinite(value)
    if key in ("counts", "chosen"):
        return all(type(name) is str and _finite(one) is not None for name, one in value.items())
    if key in ("stamps", "remarks"):
        return all(type(one) is str for one in value)
    return True


def _mended(row: Row, key: str, kinds: Collection[type], mend: Callable[[Any], Any]) -> Any:
    if key not in row:
        return _FALLBACK.get(key, mend(None))
    value = row[key]
    if key in ("counts", "chosen") and type(value) is dict:
        return {name: one for name, one in value.items() if type(name) is str and _finite(one) is not None}
    if key in ("stamps", "remarks") and type(value) in kinds:
        return [one if type(one) is str else tame_text(tame(one)) for one in value]
    mended = mend(value)
    if key in _NAMES and mended is not None and len(mended) > LONGEST_NAME:
        return f"{mended[:LONGEST_NAME]}… [cut: {len(mended)} characters]"
    return _FALLBACK.get(key) if mended is None and key in _FALLBACK else mended


def _finite(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return value if math.isfinite(value) else None
    except OverflowError:  # a whole number beyond any float
        return None


def _whole(value: Any) -> int | None:
    found = _finite(value)
    return int(found) if found is not None and found == int(found) else None


def table_of(rows: Sequence[Row], provenance: Sequence[Row]) -> Table:
    """Return the table of rows; a row that no table can be made of says so in its place."""
    known = [entry for entry in provenance if isinstance(entry, Mapping)]
    try:
        return build_table(rows, known)
    except Exception:
        return build_table([_alone(row) for row in rows], known)


def _alone(row: Row) -> Row:
    """Return a row that a table can be made of: this one, or one that says why not."""
    try:
        build_table([row])
    except Exception as error:
        plain = {key: mend(None) for key, (_, mend) in _KINDS.items()} | _FALLBACK
        kept = {key: row[key] for key in ("cell", "sensor", "task", "rig", "protocol", "estimator", "metric", "unit")}
        reason = f"This row cannot be shown: {type(error).__name__}: {error}"
        return {**plain, **kept, "status": "failed", "reason": reason}
    return row
