"""Figures that others have published, in a table of their own: no rank, no interval of ours, no place among ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.names import answer_name, metric_name
from tactbench.core.tables.numbers import score
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable

Row = Mapping[str, Any]

COLUMNS = ("published", "task", "metric", "beside sensor", "protocol", "split", "whose model", "reference", "remark")
NUMERIC = frozenset({"published"})
TITLE = "Published figures · by others, with their sensors and data; not ranked with ours"
_OTHERS = "another model than ours"


def published_section(rows: Sequence[Row]) -> TextTable | None:
    """Return the published figures that stand beside some of the rows, each once; None if there is none."""
    lines: dict[tuple[str, ...], None] = {}
    for row in rows:
        if row["published"] is None:
            continue
        whose, remark = _whose(row)
        texts = (row["task"], metric_name(row), row["sensor"], row["protocol"], row["split"] or "", whose,
                 row["published_reference"], remark)  # fmt: skip
        lines[(score(row["published"], row["unit"]), *(visible(str(text)) for text in texts))] = None
    if not lines:
        return None
    ordered = sorted(lines, key=lambda line: (line[1:], line[0]))
    return TextTable(TITLE, COLUMNS, tuple(ordered), NUMERIC, detail=True)


def _whose(row: Row) -> tuple[str, str]:
    """Return whose model a figure is of, and what else is remarked on it."""
    remark = str(row["published_remark"])
    if remark.startswith(_OTHERS):
        return _OTHERS, remark.removeprefix(_OTHERS).removeprefix("; ")
    return f"their {answer_name(row)}", remark
