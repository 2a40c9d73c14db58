"""The leaderboard in the formats that people, papers, pages and programs read; each shows the same digits."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from tactbench.core.leaderboard.columns import SHOWN
from tactbench.core.leaderboard.latex import latex
from tactbench.core.leaderboard.records import NESTED, RANK_KEYS, keys, records
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.view import DEFAULT_VIEW, View, document
from tactbench.core.tables import markdown as markdown_format
from tactbench.core.tables import terminal
from tactbench.core.tables.csv_text import csv_text as csv_lines
from tactbench.core.tables.text import json_text, visible

if TYPE_CHECKING:
    from rich.console import Console


def show(table: Table, console: Console, view: View = DEFAULT_VIEW) -> None:
    """Print a leaderboard on a terminal."""
    terminal.show(document(table, view), console)


def plain_text(table: Table, width: int = 240, view: View = DEFAULT_VIEW) -> str:
    """Return what a terminal without colours shows."""
    return terminal.plain_text(document(table, view), width)


def markdown(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return a leaderboard as Markdown, a heading a block."""
    return markdown_format.markdown(document(table, view))


def csv_text(table: Table) -> str:
    """Return a leaderboard's records as CSV."""
    names = [*keys(table), *RANK_KEYS, *(f"shown_{SHOWN[name]}" for name in table.columns)]
    lines = ([*(_stored(*one) for one in values.items()), *shown.values()] for values, shown in records(table))
    return csv_lines(names, lines)


def _stored(key: str, value: Any) -> Any:
    if key in NESTED:
        return json_text(value)
    return visible(value) if isinstance(value, str) else value


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
