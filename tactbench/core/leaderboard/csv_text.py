"""The table as CSV, for programs and for spreadsheets.

A spreadsheet runs a cell that begins like a formula. Names and reasons come from plugins and from strangers' folders:
text that begins so is written with an apostrophe before it, numbers never are. `unguarded` takes it off again.
"""

from __future__ import annotations

import csv
import io
import re
from typing import Any

from tactbench.core.leaderboard.columns import SHOWN
from tactbench.core.leaderboard.records import NESTED, RANK_KEYS, json_text, keys, records
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.text import visible

_FORMULA = re.compile(r"'*[=+\-@＝＋－＠]")
_NUMBER = re.compile(r"[-+]?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?")


def csv_text(table: Table) -> str:
    """Return a table's records as CSV with a header; lists and tables inside a cell are JSON."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*keys(table), *RANK_KEYS, *(f"shown_{SHOWN[name]}" for name in table.columns)])
    for values, shown in records(table):
        writer.writerow([*(_cell(key, value) for key, value in values.items()), *map(guarded, shown.values())])
    return out.getvalue()


def guarded(text: str) -> str:
    """Return text that no spreadsheet takes for a formula."""
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def unguarded(text: str) -> str:
    """Return what was written before `guarded` was applied."""
    return text[1:] if text.startswith("'") and _FORMULA.match(text) else text


def _cell(key: str, value: Any) -> Any:
    if key in NESTED:
        return json_text(value)
    return "" if value is None else guarded(visible(value)) if isinstance(value, str) else value
