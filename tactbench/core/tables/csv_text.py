"""Output of tables as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from typing import Any

from tactbench.core.tables.text import json_text


def csv_text(names: Iterable[str], lines: Iterable[Iterable[Any]]) -> str:
    """Return lines as CSV text with a header of `names`; lists and mappings in a field become JSON."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(
        [json_text(value) if isinstance(value, list | tuple | dict) else value for value in line] for line in lines
    )
    return out.getvalue()
