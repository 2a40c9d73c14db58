"""Rows turned into columns in one pass: every later look at a column is then at a list, not at each row again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import Any

Columns = Mapping[str, Sequence[Any]]


def columns_of(rows: Sequence[Mapping[str, Any]]) -> Columns:
    """Return one value a row under each key that some row has, None where a row lacks it; keys in order."""
    keys = sorted(rows[0] if len(set(map(len, rows))) == 1 else set().union(*rows), key=str)
    try:
        return dict(zip(keys, zip(*map(itemgetter(*keys), rows), strict=True), strict=True))
    except (KeyError, TypeError, ValueError):  # keys differ, or there is one, or none
        known = sorted(set().union(*rows), key=str)
        return {key: [row.get(key) for row in rows] for key in known}
