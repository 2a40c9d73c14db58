"""Records as CSV, for programs and for spreadsheets.

A spreadsheet runs a cell that begins like a formula. Names and reasons come from plugins and from strangers' folders:
text that begins so is written with an apostrophe before it, numbers never are.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tactbench.core.tables.text import json_text

_FORMULA = re.compile(r"'*[=+\-@＝＋－＠]")
_NUMBER = re.compile(r"[-+]?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?")


def csv_text(names: Iterable[str], lines: Iterable[Iterable[Any]]) -> str:
    """Return lines as CSV with a header; lists and mappings inside a cell are JSON."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(map(_cell, line) for line in lines)
    return out.getvalue()


def csv_of_records(records: Sequence[Mapping[str, Any]]) -> str:
    """Return records, all with the keys of the first, as CSV with a header."""
    return csv_text(records[0] if records else (), (one.values() for one in records))


def guarded(text: str) -> str:
    """Return text that no spreadsheet takes for a formula."""
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def _cell(value: Any) -> Any:
    if isinstance(value, list | tuple | dict):
        return json_text(value)
    return "" if value is None else guarded(value) if isinstance(value, str) else value
