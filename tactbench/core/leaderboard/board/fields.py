"""What the page knows of each cell beside its line: everything while that fits, else the most telling first."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from tactbench.core.leaderboard.board.digits import write_digits
from tactbench.core.leaderboard.board.pack import Column, Pack
from tactbench.core.leaderboard.board.words import LONGEST, write_words
from tactbench.core.leaderboard.numbers import duration
from tactbench.core.leaderboard.sheet import Sheet

MANY = 5_000
"""Cells beyond which what every cell has of its own is told shortly, or left to its shard."""
KEY_DIGITS = 8
"""Of a key, where there are many: enough to find its file by; one of 50,000 others shares them once in 86,000 times."""

_ALWAYS = (
    "status", "reason", "sensor", "task", "estimator", "params", "is_baseline", "rig", "protocol", "split", "repeat",
    "repeats", "seed", "simulated", "emulated", "dagger", "stamps", "metric", "unit", "ci_method", "host", "made_by",
    "concurrency", "threads", "signal", "n_recordings", "n_train", "equivalence", "reference_score",
)  # fmt: skip
_OFTEN = (
    "traceback", "remarks", "assumptions", "plan", "chosen", "counts", "published_reference", "published_remark",
    "batch_rows", "latency_n", "delay_parts_ms", "search_s", "wall_s", "peak_rss_mb", "classes", "log", "fold_sizes",
    "recordings",
)  # fmt: skip
_IN_THE_LINE = (
    "score", "ci_low", "ci_high", "baseline", "published", "n_sessions", "n_test", "sim_s", "fit_s", "predict_s",
    "answer_delay_ms", "latency_ms_p50", "latency_ms_p95",
)  # fmt: skip
"""Where there are many cells, these are told as the line shows them."""
_OWN = ("scores", "confusion", "search", "replicates")
"""What is large and every cell's own, the most telling first."""
_LENGTHS = (LONGEST, 8_192, 1_024, 200)
"""Characters that a text is cut to, one after the other, until the column fits."""
NOTHING: Column = {"kind": "nothing"}
"""A column of empty texts."""
_HEX = re.compile("[0-9a-f]+")


def write_fields(pack: Pack, rows: Sheet, room: int) -> tuple[dict[str, Column], tuple[str, ...]]:
    """Write what is known of the cells into `pack`.

    Parameters
    ----------
    rows
        What is known of the cells.
    room
        Characters that the pack may hold in the end.

    Returns
    -------
    dict, tuple
        The columns by key, and the keys that were left out for want of room.
    """
    names = rows.get("cell", ())
    many = len(names) > MANY
    columns: dict[str, Column] = {"cell": _names(pack, names), "key": _keys(pack, rows.get("key", ()), many)}
    left_out: list[str] = []
    for key in (*_ALWAYS, *_OFTEN):
        _write(pack, rows, key, room, columns, left_out, many)
    others = [*_IN_THE_LINE, *_OWN]
    known = {*columns, *left_out, *others}
    more = sorted(set(rows) - known, key=str)
    if many:
        left_out += [key for key in (*_OWN, *more) if any(rows.get(key, ()))]
    else:
        for key in (*others[: len(_IN_THE_LINE)], *more, *_OWN):
            _write(pack, rows, key, room, columns, left_out, many)
    return columns, tuple(dict.fromkeys(map(str, left_out)))


def _write(
    pack: Pack, rows: Sheet, key: str, room: int, columns: dict[str, Column], left_out: list[str], many: bool
) -> None:
    """Write one column, cut as far as it must be, or not at all; a column that says nothing is not written."""
    if key not in rows:
        return
    values, types = rows[key], rows.types(key)
    before = len(pack.blobs)
    if many and float in types and types <= {float, int, type(None)}:
        column = write_digits(pack, _shortly(key, values))
        if column is not None and pack.size <= room:
            columns[key] = column
            return
    else:
        for longest in _LENGTHS if str in types else _LENGTHS[:1]:
            column = write_words(pack, values, longest, types)
            if column is None:
                return
            if pack.size <= room:
                columns[key] = column
                return
            pack.forget_from(before)
    pack.forget_from(before)
    left_out.append(key)


def _shortly(key: str, values: Sequence[float | None]) -> list[str]:
    if key.endswith("_s"):
        return ["" if value is None else duration(value) for value in values]
    return ["" if value is None else f"{value:.4g}" for value in values]


def _names(pack: Pack, names: Sequence[str]) -> Column:
    """Write names of cells part by part: what stands between their strokes is shared by many."""
    parts = [name.split("/") for name in names]
    if not parts or len({len(one) for one in parts}) > 1:
        return write_words(pack, names) or NOTHING
    return {
        "kind": "joined",
        "by": "/",
        "parts": [write_words(pack, part) or NOTHING for part in zip(*parts, strict=True)],
    }


def _keys(pack: Pack, values: Sequence[Any], many: bool) -> Column:
    keys = [str(value or "") for value in values]
    heads = [key[:KEY_DIGITS] or "0" * KEY_DIGITS for key in keys]
    told = "".join(heads)
    if not many or set(map(len, heads)) != {KEY_DIGITS} or not _HEX.fullmatch(told):
        return write_words(pack, keys) or NOTHING
    import numpy as np

    whole = np.frombuffer(bytes.fromhex(told), dtype=f">u{KEY_DIGITS // 2}")
    return {"kind": "hex", "digits": KEY_DIGITS, "at": pack.planes(whole)}
