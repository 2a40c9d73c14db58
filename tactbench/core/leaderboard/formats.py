"""The one table in the formats that papers, pages and programs read; each shows the same digits."""

from __future__ import annotations

from collections.abc import Callable

from tactbench.core.leaderboard.csv_text import csv_text
from tactbench.core.leaderboard.latex import latex
from tactbench.core.leaderboard.markdown import markdown
from tactbench.core.leaderboard.records import JSON_KEYS as JSON_KEYS
from tactbench.core.leaderboard.records import json_text, records
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.view import View


def json_array(table: Table) -> str:
    """Return a table's records as a JSON array, one a line: every key, and the text of its columns in ``shown``."""
    lines = (json_text(values | {"shown": shown}) for values, shown in records(table))
    return "[\n" + ",\n".join(lines) + "\n]\n"


def page(table: Table) -> str:
    """Return the page of a table: one HTML file, every cell behind its numbers, times among them."""
    from tactbench.core.leaderboard.board.page import page_of

    return page_of(table)


TEXTS: dict[str, Callable[[Table], str]] = {
    "json": json_array,
    "csv": csv_text,
    "md": markdown,
    "latex": latex,
    "html": page,
}
"""How a table is written, by the name of the format on the command line; all but Parquet and Excel: no text."""

VIEWED: dict[str, Callable[[Table, View], str]] = {"md": markdown, "latex": latex}
"""Those of them that print less than everything, as a view says."""

SUFFIXES = {
    ".json": "json", ".csv": "csv", ".md": "md", ".tex": "latex", ".html": "html", ".parquet": "parquet",
    ".xlsx": "xlsx", ".txt": "table",
}  # fmt: skip
"""The format that a file is meant to have, by how its name ends."""
