"""The files of a leaderboard in a result folder, written when what decides them has changed and not otherwise."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tactbench
from tactbench.core.errors import UsageError
from tactbench.core.leaderboard import memo
from tactbench.core.leaderboard.formats import TEXTS, VIEWED
from tactbench.core.leaderboard.table import Table, build_table
from tactbench.core.leaderboard.view import WHOLE
from tactbench.core.matrix.files import replace_file

Row = Mapping[str, Any]

ENDINGS = ("md", "csv", "json", "html")
"""The files are ``leaderboard.ENDING``; LaTeX and Parquet are made when asked for: `leaderboard --to FILE`."""
STATE = Path("cache") / "tables.json"
"""What decided the files that lie there, and their digests."""

_NESTED = (dict, list, tuple)


def write_tables(
    rows: Sequence[Row], folder: Path, provenance: Sequence[Row] = (), table: Table | None = None
) -> tuple[Path, ...]:
    """Write the leaderboard of `rows` in every format that people open, nothing left out; return the files.

    Parameters
    ----------
    rows
        Rows in any order.
    folder
        A result folder. Files that are there and were made from the same rows by the same code are left alone.
    provenance
        What is known of the runs that the rows are from.
    table
        The leaderboard of those rows, if it has been made.

    Raises
    ------
    UsageError
        If the folder cannot be written; the files are then the old ones, each of them whole.
    """
    paths = tuple(folder / f"leaderboard.{ending}" for ending in ENDINGS)
    inputs = _digest(rows, provenance)
    if inputs is not None and _as_left(folder, inputs, paths):
        return paths
    table = table or table_of(rows, folder, provenance)
    try:
        made = {}
        for ending, path in zip(ENDINGS, paths, strict=True):
            text = VIEWED[ending](table, WHOLE) if ending in VIEWED else TEXTS[ending](table)
            content = text.encode("utf-8", "replace")
            replace_file(path, content)
            made[path.name] = hashlib.sha256(content).hexdigest()
        if inputs is not None:
            (folder / STATE).parent.mkdir(exist_ok=True)
            replace_file(folder / STATE, json.dumps({"inputs": inputs, "files": made}).encode())
    except OSError as error:
        raise UsageError(
            f"The tables cannot be written to {folder}: {error.strerror or error}.",
            hint="Make room or give another folder; the results themselves are safe.",
        ) from error
    return paths


def table_of(rows: Sequence[Row], folder: Path, provenance: Sequence[Row] = (), *, times: bool = True) -> Table:
    """Return the leaderboard of `rows`; what the statistics came to is recalled from `folder`, and kept there."""
    memo.load(folder)
    table = build_table(rows, provenance, times=times)
    memo.save(folder)
    return table


def _digest(rows: Sequence[Row], provenance: Sequence[Row]) -> str | None:
    """Return a digest of all that decides the files; None if the rows hold what is not plain as JSON is.

    Rows share their keys, and big values such as what was assumed of a recording: each is looked at once.
    """
    shared: dict[int, str] = {}
    in_order: dict[tuple[str, ...], Sequence[str]] = {}

    def of(value: Any) -> str:
        if id(value) not in shared:
            shared[id(value)] = memo.digest_of(memo.ordered(value))
        return shared[id(value)]

    def told(row: Row) -> str:
        keys = tuple(row)
        if keys not in in_order:
            in_order[keys] = sorted(keys)
        values = [row[key] for key in in_order[keys]]
        return memo.digest_of(
            of(in_order[keys]), [of(value) if isinstance(value, _NESTED) else value for value in values]
        )

    code = [memo.source_digest(f"tactbench.core.{package}") for package in ("leaderboard", "statistics")]
    try:
        every = sorted(map(told, rows))
        return memo.digest_of([tactbench.__version__, code, every, [dict(one) for one in provenance]])
    except (TypeError, ValueError):
        return None


def _as_left(folder: Path, inputs: str, paths: Sequence[Path]) -> bool:
    """Tell whether the files are those that were made from `inputs`, byte for byte."""
    try:
        state = json.loads((folder / STATE).read_text(encoding="utf-8"))
        if state["inputs"] != inputs:
            return False
        return all(hashlib.sha256(path.read_bytes()).hexdigest() == state["files"][path.name] for path in paths)
    except (OSError, ValueError, KeyError, TypeError):
        return False
