"""The leaderboard in the formats that people, papers, pages and programs read; each shows the same digits."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tactbench.core.errors import UsageError
from tactbench.core.files import replace_file
from tactbench.core.leaderboard.latex import latex
from tactbench.core.leaderboard.names import Row
from tactbench.core.leaderboard.records import csv_text, json_array, parquet, xlsx
from tactbench.core.leaderboard.table import Table, build_table
from tactbench.core.leaderboard.view import DEFAULT_VIEW, WHOLE, View, document
from tactbench.core.tables import markdown as markdown_format
from tactbench.core.tables import terminal

if TYPE_CHECKING:
    from rich.console import Console


SUFFIXES = {
    ".json": "json", ".csv": "csv", ".md": "md", ".tex": "latex", ".html": "html", ".parquet": "parquet",
    ".xlsx": "xlsx", ".txt": "table",
}  # fmt: skip
"""The format that a file is meant to have, by how its name ends."""
IN_FOLDER = ("md", "csv", "json", "html")
"""A run's result folder has these, ``leaderboard.md`` and so on; the others are made when asked for."""


def show(table: Table, console: Console, view: View = DEFAULT_VIEW) -> None:
    """Print a leaderboard on a terminal."""
    terminal.show(document(table, view), console)


def plain_text(table: Table, width: int = 240, view: View = DEFAULT_VIEW) -> str:
    """Return what a terminal without colours shows."""
    return terminal.plain_text(document(table, view), width)


def markdown(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return a leaderboard as Markdown, a heading a block."""
    return markdown_format.markdown(document(table, view))


def page(table: Table) -> str:
    """Return the page of a table: one HTML file, every cell behind its numbers, times among them."""
    from tactbench.core.leaderboard.board import page_of

    return page_of(table)


def rendered(table: Table, shape: str, view: View = WHOLE, width: int = 240) -> bytes:
    """Return a leaderboard in a format that `SUFFIXES` names.

    Parameters
    ----------
    view, width
        What is printed of it for people, and how wide a terminal is; the formats for programs hold everything.

    Raises
    ------
    UsageError
        If Parquet or Excel is asked for and its library is not installed.
    """
    if shape == "table":
        return plain_text(table, width, view).encode("utf-8", "backslashreplace")
    if shape in ("parquet", "xlsx"):
        return parquet(table) if shape == "parquet" else xlsx(table)
    if shape in ("md", "latex"):
        text = markdown(table, view) if shape == "md" else latex(table, view)
    else:
        text = {"csv": csv_text, "json": json_array, "html": page}[shape](table)
    return text.encode("utf-8", "replace")


def write_tables(
    rows: Sequence[Row], folder: Path, provenance: Sequence[Row] = (), table: Table | None = None
) -> tuple[Path, ...]:
    """Write the leaderboard of `rows`, or `table` where it has been made, into a result folder; return the files.

    Raises
    ------
    UsageError
        If the folder cannot be written; each of the files is then whole, an old one or a new one.
    """
    table = table or build_table(rows, provenance)
    paths = {folder / f"leaderboard.{shape}": shape for shape in IN_FOLDER}
    try:
        for path, shape in paths.items():
            replace_file(path, rendered(table, shape))
    except OSError as error:
        raise UsageError(
            f"The tables cannot be written to {folder}: {error.strerror or error}.",
            hint="Make room or give another folder; the results themselves are safe.",
        ) from error
    return tuple(paths)
