"""The one table in the formats that papers, pages and programs read; each shows the same digits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.csv_text import csv_text
from tactbench.core.leaderboard.latex import latex
from tactbench.core.leaderboard.markdown import markdown, markdown_grid, markdown_note, markdown_text
from tactbench.core.leaderboard.parquet import parquet
from tactbench.core.leaderboard.records import JSON_KEYS, json_text, records
from tactbench.core.leaderboard.table import Table, build_table
from tactbench.core.leaderboard.view import DEFAULT_VIEW, View

__all__ = [
    "FORMATS",
    "JSON_KEYS",
    "SUFFIXES",
    "TEXTS",
    "VIEWED",
    "json_array",
    "markdown_grid",
    "markdown_note",
    "markdown_text",
    "page",
    "to_csv",
    "to_json",
    "to_latex",
    "to_markdown",
    "to_page",
    "to_parquet",
]

Row = Mapping[str, Any]


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


def to_json(rows: Sequence[Row], provenance: Sequence[Row] = (), *, times: bool = True) -> str:
    """Return the rows as a JSON array, in the order of the table."""
    return json_array(build_table(rows, provenance, times=times))


def to_csv(rows: Sequence[Row], provenance: Sequence[Row] = (), *, times: bool = True) -> str:
    """Return the rows as CSV, in the order of the table."""
    return csv_text(build_table(rows, provenance, times=times))


def to_markdown(
    rows: Sequence[Row], provenance: Sequence[Row] = (), *, times: bool = True, view: View = DEFAULT_VIEW
) -> str:
    """Return the table as Markdown, a heading a block."""
    return markdown(build_table(rows, provenance, times=times), view)


def to_latex(
    rows: Sequence[Row], provenance: Sequence[Row] = (), *, times: bool = True, view: View = DEFAULT_VIEW
) -> str:
    """Return the table as LaTeX for the booktabs package, a table a block."""
    return latex(build_table(rows, provenance, times=times), view)


def to_parquet(rows: Sequence[Row], provenance: Sequence[Row] = (), *, times: bool = True) -> bytes:
    """Return the rows as a Parquet file; raises UsageError without pyarrow."""
    return parquet(build_table(rows, provenance, times=times))


def to_page(rows: Sequence[Row], provenance: Sequence[Row] = ()) -> str:
    """Return the leaderboard as one HTML file, every cell behind its numbers."""
    return page(build_table(rows, provenance))


FORMATS: dict[str, Callable[..., str]] = {
    "json": to_json,
    "csv": to_csv,
    "md": to_markdown,
    "latex": to_latex,
    "html": to_page,
}
"""From rows (and their provenance) to text, by the name of the format on the command line."""
