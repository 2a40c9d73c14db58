"""The files of a leaderboard in a result folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tactbench.core.errors import UsageError
from tactbench.core.files import replace_file
from tactbench.core.leaderboard.formats import TEXTS, VIEWED
from tactbench.core.leaderboard.table import Table, build_table
from tactbench.core.leaderboard.view import WHOLE

Row = Mapping[str, Any]

ENDINGS = ("md", "csv", "json", "html")
"""The files are ``leaderboard.ENDING``; LaTeX and Parquet are made when asked for: `leaderboard --to FILE`."""


def write_tables(
    rows: Sequence[Row], folder: Path, provenance: Sequence[Row] = (), table: Table | None = None
) -> tuple[Path, ...]:
    """Write the leaderboard of `rows` in every format that people open, nothing left out; return the files.

    Parameters
    ----------
    rows
        Rows in any order.
    folder
        A result folder.
    provenance
        What is known of the runs that the rows are from.
    table
        The leaderboard of those rows, if it has been made.

    Raises
    ------
    UsageError
        If the folder cannot be written; each of the files is then whole, an old one or a new one.
    """
    table = table or build_table(rows, provenance)
    paths = tuple(folder / f"leaderboard.{ending}" for ending in ENDINGS)
    try:
        for ending, path in zip(ENDINGS, paths, strict=True):
            text = VIEWED[ending](table, WHOLE) if ending in VIEWED else TEXTS[ending](table)
            replace_file(path, text.encode("utf-8", "replace"))
    except OSError as error:
        raise UsageError(
            f"The tables cannot be written to {folder}: {error.strerror or error}.",
            hint="Make room or give another folder; the results themselves are safe.",
        ) from error
    return paths
