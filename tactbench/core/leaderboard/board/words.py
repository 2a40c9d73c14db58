"""Values that many rows share: each written once, and where it stands.

What a page is handed may be anything: values that JSON has no word for become text, endless ones are cut, and so is
what is longer than anybody reads; each says so in its place.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.board.pack import Column, Pack
from tactbench.core.leaderboard.sheet import marks_of

LONGEST = 65_536
"""Characters of a text: what a cell may print is kept to as many bytes."""
DEEPEST = 12
"""Levels of lists in lists."""
MOST_FIGURES = 100
_LONG_WHOLE = re.compile(r"(?<![\d.])\d{16}")
"""What may be a whole number that a browser rounds."""
_ENCODER = json.JSONEncoder(allow_nan=False)
_EMPTY: dict[type, str] = {list: "[]", tuple: "[]", dict: "{}"}
_NOTHING = type(None)
_PLAIN = frozenset({str, int, bool, float, _NOTHING})
_SILENT = frozenset({"null", '""', "[]", "{}"})


def write_words(
    pack: Pack, values: Sequence[Any], longest: int = LONGEST, types: Collection[type] | None = None
) -> Column | None:
    """Write a column of any values; None if none of them says anything.

    Parameters
    ----------
    longest
        Characters that a text is cut to.
    types
        The types of the values, if known already.
    """
    types = frozenset(map(type, values) if types is None else types)
    if types <= _EMPTY.keys() and not any(values):
        return None
    if types == {_NOTHING} or not values:
        return None
    # By value where that is safe: 1, 1.0 and True are equal.
    alike = len(types - {_NOTHING}) <= 1 and types <= _PLAIN
    keys = values if alike else marks_of(values)
    texts: dict[str, int] = {}
    places = {
        key: texts.setdefault(written(value, longest), len(texts))
        for key, value in dict(zip(keys, values, strict=True)).items()
    }
    if texts.keys() <= _SILENT:
        return None
    at = pack.zeros(len(values)) if len(texts) == 1 else pack.planes(list(map(places.__getitem__, keys)))
    return _column(pack, texts, at)


def _column(pack: Pack, texts: Iterable[str], at: list[int]) -> Column:
    return {"kind": "words", "words": pack.add(("[" + ",".join(texts) + "]").encode()), "at": at}


def written(value: Any, longest: int = LONGEST) -> str:
    """Return a value as JSON of ASCII only, whatever it is."""
    if isinstance(value, str) and len(value) <= longest:
        return json.dumps(value)
    if type(value) in _EMPTY and not value:
        return _EMPTY[type(value)]
    try:
        text = _ENCODER.encode(value)
        if len(text) <= longest and not _LONG_WHOLE.search(text):
            return text
    except (TypeError, ValueError, RecursionError):
        pass
    return json.dumps(tame(value, longest))


def tame(value: Any, longest: int = LONGEST, depth: int = 0) -> Any:
    """Return a value that JSON has words for, cut where it is too long or too deep, saying so."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        if abs(value) < 2**53:  # beyond that a browser rounds
            return int(value)
        return str(value) if abs(value) < 10**MOST_FIGURES else f"a whole number of more than {MOST_FIGURES} digits"
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(value)
    if isinstance(value, str):
        return cut(str(value), longest)
    if depth >= DEEPEST:
        return "[cut: too deep]"
    if isinstance(value, Mapping):
        most = max(1, longest // 16)
        found = {tame_text(name): tame(one, longest, depth + 1) for name, one in list(value.items())[:most]}
        return found | {"[cut]": f"{len(value) - most} more"} if len(value) > most else found
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray):
        most = max(1, longest // 4)
        listed = [tame(one, longest, depth + 1) for one in value[:most]]
        return [*listed, f"[cut: {len(value) - most} more]"] if len(value) > most else listed
    return cut(tame_text(value), longest)


def tame_text(value: Any) -> str:
    """Return what a value calls itself, even if that fails."""
    try:
        return value if type(value) is str else str(value)
    except Exception as error:
        return f"[a {type(value).__name__} that cannot be shown: {type(error).__name__}]"


def cut(text: str, longest: int) -> str:
    """Return the end of a text that is too long, with a remark; the end is where a traceback says what happened."""
    return text if len(text) <= longest else f"[cut: the last {longest} of {len(text)} characters] {text[-longest:]}"
