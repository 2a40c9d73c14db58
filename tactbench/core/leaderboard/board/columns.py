"""The columns of the page's data: each is a JSON document, deflated, as base64, whose alphabet cannot end a script."""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

from tactbench.core.spec.row import FORMAT

Row = Mapping[str, Any]

MANY = 5_000
"""Cells beyond which numbers are told to few digits, and what is large and each cell's own is left to its file."""
DIGITS, FEW_DIGITS = 17, 5
"""Significant digits of a number: all that a float64 has; where there are many cells."""
KEY_DIGITS = 8
"""Of a key, where there are many: one of 50,000 others shares them once in 86,000 times."""
LONGEST = 65_536
"""Characters of a text: what a cell may print is kept to as many bytes."""
MOST_OTHERS = 200
"""Keys of no format of ours, those that most rows have."""
DEEPEST = 12
"""Levels of lists in lists."""
_LENGTHS = (LONGEST, 8_192, 1_024, 200)
"""Characters that texts are cut to, one after the other, until the column fits."""
_FIRST = (
    "cell", "key", "status", "reason", "sensor", "task", "estimator", "params", "is_baseline", "rig", "protocol",
    "split", "repeat", "repeats", "seed", "simulated", "emulated", "dagger", "stamps", "metric", "unit", "ci_method",
    "host", "made_by", "concurrency", "threads", "signal", "n_recordings", "n_train", "equivalence", "reference_score",
    "traceback", "remarks", "assumptions", "plan", "chosen", "counts", "published_reference", "published_remark",
    "batch_rows", "latency_n", "delay_parts_ms", "search_s", "wall_s", "peak_rss_mb", "classes", "log", "fold_sizes",
    "recordings",
)  # fmt: skip
"""Keys of all boards, the most telling first."""
_IN_THE_TABLE = (
    "score", "ci_low", "ci_high", "baseline", "published", "n_sessions", "n_test", "sim_s", "fit_s", "predict_s",
    "answer_delay_ms", "latency_ms_p50", "latency_ms_p95",
)  # fmt: skip
"""Where there are many cells, these are told as the table shows them."""
_LARGE = ("scores", "confusion", "search", "replicates")
"""What is large and each cell's own."""
_text = json.JSONEncoder(sort_keys=True).encode


def deflated(document: Any) -> str:
    """Return a JSON document as a zlib stream in base64."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False)
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


def column(values: Sequence[Any], sort: Sequence[float | None] | None = None) -> dict[str, Any]:
    """Return a column, one value a row.

    Parameters
    ----------
    values
        As JSON holds them; see `plain`.
    sort
        What the rows are sorted by, if not by their texts.

    Returns
    -------
    dict
        ``values``; or, of other than numbers that rows share, ``dictionary`` and ``index``, the place in it of each
        row's value.
    """
    if sort is not None:
        return {"values": list(values), "sort": rounded(sort)}
    if float in set(map(type, values)):
        return {"values": list(values)}
    keys = [id(value) if isinstance(value, list | dict) else (type(value), value) for value in values]
    texts: dict[str, int] = {}
    places = {
        key: texts.setdefault(_text(value), len(texts)) for key, value in dict(zip(keys, values, strict=True)).items()
    }
    if len(texts) == len(values):
        return {"values": list(values)}
    return {"dictionary": list(map(json.loads, texts)), "index": [places[key] for key in keys]}


def rounded(numbers: Sequence[float | None]) -> list[float | None]:
    """Return numbers with the digits that a board of so many rows has; None for those that are not finite."""
    digits = FEW_DIGITS if len(numbers) > MANY else DIGITS
    return [None if one is None or not math.isfinite(one) else float(f"{one:.{digits}g}") for one in numbers]


def keys_of(rows: Sequence[Row]) -> set[str]:
    """Return the keys that rows have: of those of no format of ours the commonest, a stranger's may have a million."""
    counts = Counter(chain.from_iterable(rows))
    others = [key for key, _ in counts.most_common() if key not in FORMAT][:MOST_OTHERS]
    return {*others, *(key for key in FORMAT if key in counts)}


def details(rows: Sequence[Row], room: int) -> tuple[dict[str, str], list[str]]:
    """Return what is known of each cell besides its line in the table, by key, and the keys left out.

    Parameters
    ----------
    room
        Characters for all of it. What does not fit is cut shorter, then left out, the least telling first.
    """
    many = len(rows) > MANY
    others = sorted(keys_of(rows) - {*_FIRST, *_IN_THE_TABLE, *_LARGE}, key=str)
    kept = _FIRST if many else (*_FIRST, *_IN_THE_TABLE, *others, *_LARGE)
    fields: dict[str, str] = {}
    left_out = [key for key in (*others, *_LARGE) if key not in kept and any(row.get(key) for row in rows)]
    for key in kept:
        values = [row.get(key) for row in rows]
        if all(value in (None, "") or value == [] or value == {} for value in values):
            continue
        if many and key == "key":
            values = [str(value or "")[:KEY_DIGITS] for value in values]
        elif many and set(map(type, values)) <= {float, int, type(None)} and float in set(map(type, values)):
            values = rounded(values)
        for longest in _LENGTHS if str in set(map(type, values)) else _LENGTHS[:1]:
            text = deflated(column(plain_values(values, longest)))
            if len(text) <= room:
                fields[key] = text
                room -= len(text)
                break
        else:
            left_out.append(key)
    return fields, left_out


def plain_values(values: Sequence[Any], longest: int = LONGEST) -> list[Any]:
    """Return values as `plain` does; what rows share is looked at once and stays shared."""
    known = {id(value): plain(value, longest) for value in {id(value): value for value in values}.values()}
    return [known[id(value)] for value in values]


def plain(value: Any, longest: int = LONGEST, depth: int = 0) -> Any:
    """Return a value that JSON and a browser's numbers hold: others become text; what is long or deep is cut."""
    if isinstance(value, str):
        return cut_start(value, longest)
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        return value if abs(value) < 2**53 else str(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if depth >= DEEPEST:
        return "[cut: too deep]"
    if isinstance(value, Mapping):
        return {str(name): plain(one, longest, depth + 1) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one, longest, depth + 1) for one in value]
    return cut_start(str(value), longest)


def cut_start(text: str, longest: int) -> str:
    """Return the end of a text that is too long, with a remark: a traceback says at its end what happened."""
    return text if len(text) <= longest else f"[cut: the last {longest} of {len(text)} characters] {text[-longest:]}"
