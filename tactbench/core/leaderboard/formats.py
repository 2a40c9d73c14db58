"""The leaderboard in all output formats, with the same digits in each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from tactbench.core.errors import UsageError
from tactbench.core.files import replace_file
from tactbench.core.leaderboard.columns import COLUMNS, SHOWN
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.view import WHOLE, View, document, grid
from tactbench.core.spec.row import JSON_KEYS, OF_REPLICATES
from tactbench.core.tables import terminal
from tactbench.core.tables.csv_text import csv_text
from tactbench.core.tables.latex import latex as latex_of
from tactbench.core.tables.markdown import markdown
from tactbench.core.tables.text import json_text

SUFFIXES = {".json": "json", ".csv": "csv", ".md": "md", ".tex": "latex", ".txt": "table"}
"""Output format by suffix of the file."""
_IN_A_PAPER = ("place", "sensor", "estimator", "score", "notes", "interval", "range", "against reference", "published")


def latex(table: Table, view: View) -> str:
    """Return the tables as LaTeX, each one column wide, with metric, protocol, split and origin in the caption."""
    names = view.columns or _IN_A_PAPER
    grids = []
    for block in table.blocks:
        shown = grid(block, replace(view, columns=names)).compact()
        grids.append(replace(shown, title=f"{block.title} · {block.setting} · {block.origin}"))
    return latex_of([*grids, *table.sections], wide=False)


def rendered(table: Table, shape: str, view: View = WHOLE, width: int = 240) -> bytes:
    """Return a leaderboard as the content of a file in the format `shape`, one of the values of `SUFFIXES`.

    Parameters
    ----------
    view, width
        Columns and width [characters] of formats for people; formats for programs hold all columns.
    """
    if shape == "table":
        text = terminal.plain_text(document(table, view), width)
    elif shape == "md":
        text = markdown([*document(table, view), *([table.footer] if table.footer else [])])
    elif shape == "latex":
        text = latex(table, view)
    else:
        text = csv_of(table) if shape == "csv" else json_array(table)
    return text.encode("utf-8", "backslashreplace")


def write_tables(table: Table, folder: Path) -> None:
    """Write ``leaderboard.md``, ``.csv`` and ``.json`` into a result folder.

    Raises
    ------
    UsageError
        If the folder cannot be written; every file is then complete, with the old or the new content.
    """
    try:
        for shape in ("md", "csv", "json"):
            replace_file(folder / f"leaderboard.{shape}", rendered(table, shape))
    except OSError as error:
        raise UsageError(
            f"The tables cannot be written to {folder}: {error.strerror or error}.",
            hint="Make room or give another folder; the results themselves are safe.",
        ) from error


_RANKS = ("rank", "rank_low", "rank_high", "rank_tied")
"""Keys of a row's rank in its block."""
_KEYS = (*JSON_KEYS, *OF_REPLICATES)
"""Keys of a table's records, without the keys of the ranks."""


def records(table: Table) -> Iterator[tuple[dict[str, Any], dict[str, str]]]:
    """Yield each line's result row with its ranks, and the texts of its columns by their names for programs."""
    for line in table.lines:
        one = line.placing
        ranks = (one.place, one.low, one.high, one.tied) if one else (None, None, None, None)
        row = {key: line.row.get(key) for key in _KEYS} | dict(zip(_RANKS, ranks, strict=True))
        yield row, {SHOWN.get(name, name.replace(" ", "_")): text for name, text in line.texts.items()}


def csv_of(table: Table) -> str:
    """Return a table as CSV with one line for each record: all keys, and the texts shown in columns ``shown_…``."""
    names = [*_KEYS, *_RANKS, *(f"shown_{SHOWN[name]}" for name in COLUMNS)]
    return csv_text(names, ([*row.values(), *shown.values()] for row, shown in records(table)))


def json_array(table: Table) -> str:
    """Return a table as a JSON array with one line for each record: all keys, and the texts shown in ``shown``."""
    lines = (json_text(values | {"shown": shown}) for values, shown in records(table))
    return "[\n" + ",\n".join(lines) + "\n]\n"
