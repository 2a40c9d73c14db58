"""The leaderboard in all output formats, with the same digits in each."""

from __future__ import annotations

import importlib
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tactbench.core.errors import UsageError
from tactbench.core.files import replace_file
from tactbench.core.leaderboard.columns import COLUMNS, SHOWN
from tactbench.core.leaderboard.sentences import NO_BETTER
from tactbench.core.leaderboard.table import Block, Table
from tactbench.core.leaderboard.view import WHOLE, View, document, grids
from tactbench.core.spec.row import FORMAT, JSON_KEYS, NESTED, OF_REPLICATES
from tactbench.core.tables import terminal
from tactbench.core.tables.csv_text import csv_text
from tactbench.core.tables.latex import latex_table
from tactbench.core.tables.markdown import markdown
from tactbench.core.tables.numbers import whole
from tactbench.core.tables.text import json_text, visible
from tactbench.core.tables.text_table import TextTable

SUFFIXES = {
    ".json": "json", ".csv": "csv", ".md": "md", ".tex": "latex", ".parquet": "parquet", ".xlsx": "xlsx",
    ".txt": "table",
}  # fmt: skip
"""Output format by suffix of the file."""
_IN_A_PAPER = ("sensor", "estimator", "score", "interval", "range", "against reference", "published")
_LONG = 12
"""Largest number of characters of a name that is not broken into lines in the LaTeX table."""


def latex(table: Table, view: View) -> str:
    """Return the blocks as LaTeX tables one column wide; tables of events and probes span both columns."""
    names = view.columns or _IN_A_PAPER
    blocks = zip(table.blocks, grids(table, replace(view, wide=False, columns=())), strict=True)
    parts = [_in_a_paper(block, grid, names, number) for number, (block, grid) in enumerate(blocks, 1)]
    parts += [latex_table(one, number=number) for number, one in enumerate(table.sections, len(parts) + 1)]
    return "\n".join(parts)


def _in_a_paper(block: Block, grid: TextTable, names: Sequence[str], number: int) -> str:
    """Return a block as a LaTeX table with the columns `names`, trivial answers below a horizontal rule."""
    order = sorted(range(len(grid.lines)), key=lambda place: grid.kinds[place] == "baseline")
    lines = [dict(zip(grid.columns, grid.lines[place], strict=True)) for place in order]
    marked = [line.get("notes") or (NO_BETTER if line.get("place") == NO_BETTER else "") for line in lines]
    names = [name for name in names if name in grid.columns and name != "notes"]
    shown = (tuple(line[name].replace(" … ", "–") for name in names) for line in lines)
    heads = {
        name: head.replace(" over ", "\nover ") if " over " in head else "\n".join(head.rsplit(" ", 1))
        for name, head in zip(grid.columns, grid.headers, strict=True)
    }
    table = replace(
        grid,
        title=_caption(block),
        columns=(*names, "notes"),
        headings=(*(heads[name] for name in names), ""),
        lines=tuple((*line, mark) for line, mark in zip(shown, marked, strict=True)),
        notes=tuple(f"{note.text.rstrip('.')}." for note in block.notes if note.printed),
    ).compact()
    trivial = grid.kinds.count("baseline")
    rule = len(lines) - trivial if 0 < trivial < len(lines) else None
    columns = "".join(map(_column, table.columns, zip(*table.lines, strict=True)))
    return latex_table(table, number=number, columns=f"@{{}}{columns}@{{}}", rule=rule)


def _column(name: str, texts: Sequence[str]) -> str:
    """Return the LaTeX column type for a column: names too long for one line are wrapped."""
    if name not in ("sensor", "estimator", "notes"):
        return "r"
    return r"p{0.23\columnwidth}" if max(map(len, texts)) > _LONG else "l"


def _caption(block: Block) -> str:
    """Return the caption of a block: title, metric, protocol, split, origin and number of test samples."""
    counts = sorted({line.row["n_test"] for line in block.lines if line.row["n_test"] is not None})
    sentences = [block.title, f"Score: {block.setting.replace(' · ', ', ')}", block.origin]
    if counts:
        sentences.append(f"n = {'–'.join(map(whole, dict.fromkeys((counts[0], counts[-1]))))} test samples")
    if any(line.kind == "baseline" for line in block.lines):
        sentences.append("Below the rule: trivial answers")
    return " ".join(sentence if sentence.endswith("?") else f"{sentence}." for sentence in sentences)


def rendered(table: Table, shape: str, view: View = WHOLE, width: int = 240) -> bytes:
    """Return a leaderboard as the content of a file in the format `shape`, one of the values of `SUFFIXES`.

    Parameters
    ----------
    view, width
        Columns and width [characters] of formats for people; formats for programs hold all columns.

    Raises
    ------
    UsageError
        If the library for Parquet or Excel files is not installed.
    """
    if shape in ("parquet", "xlsx"):
        return parquet(table) if shape == "parquet" else xlsx(table)
    if shape == "table":
        return terminal.plain_text(document(table, view), width).encode("utf-8", "backslashreplace")
    if shape == "md":
        text = markdown([*document(table, view), *([table.footer] if table.footer else [])])
    elif shape == "latex":
        text = latex(table, view)
    else:
        text = csv_text(*flat_records(table)) if shape == "csv" else json_array(table)
    return text.encode("utf-8", "replace")


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


_RANKS = {"rank": int, "rank_low": int, "rank_high": int, "rank_tied": bool}
"""Keys and types of a row's rank in its block."""
_KEYS = (*JSON_KEYS, *OF_REPLICATES)
"""Keys of a table's records, without the keys of the ranks."""


def records(table: Table) -> Iterator[tuple[dict[str, Any], dict[str, str]]]:
    """Yield each line's result row with its ranks, and the texts of its columns by their names for programs."""
    for line in table.lines:
        one = line.placing
        ranks = (one.place, one.low, one.high, one.tied) if one else (None, None, None, None)
        row = {key: line.row.get(key) for key in _KEYS} | dict(zip(_RANKS, ranks, strict=True))
        yield row, {SHOWN.get(name, name.replace(" ", "_")): text for name, text in line.texts.items()}


def flat_records(table: Table) -> tuple[list[str], list[list[Any]]]:
    """Return column names and lines for formats with one value in each field; lists and mappings are JSON text."""
    names = [*_KEYS, *_RANKS, *(f"shown_{SHOWN[name]}" for name in COLUMNS)]
    return names, [[*(_flat(*one) for one in row.items()), *shown.values()] for row, shown in records(table)]


def _flat(key: str, value: Any) -> Any:
    if key in NESTED:
        return json_text(value)
    return visible(value) if isinstance(value, str) else value


def json_array(table: Table) -> str:
    """Return a table as a JSON array with one line for each record: all keys, and the texts shown in ``shown``."""
    lines = (json_text(values | {"shown": shown}) for values, shown in records(table))
    return "[\n" + ",\n".join(lines) + "\n]\n"


def parquet(table: Table) -> bytes:
    """Return a table's records as a Parquet file: lists and mappings as JSON text, provenance as metadata.

    Raises
    ------
    UsageError
        If pyarrow is not installed.
    """
    pa, pq = (_library(name, "Parquet", "parquet") for name in ("pyarrow", "pyarrow.parquet"))
    types = {bool: pa.bool_(), float: pa.float64(), int: pa.int64(), str: pa.string()}
    names, lines = flat_records(table)
    metadata = {"tactbench.provenance": json_text(list(table.provenance), sort_keys=True)}
    schema = pa.schema([(name, types[_kind(name)]) for name in names], metadata=metadata)
    out = io.BytesIO()
    columns = [list(column) for column in zip(*lines, strict=True)]
    pq.write_table(pa.table(columns, schema=schema), out, compression="zstd")
    return out.getvalue()


def _library(name: str, what: str, extra: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise UsageError(
            f"{what} needs {name}, which cannot be imported: {error}.",
            hint=f"Install it with `pip install 'tactbench[{extra}]'`.",
        ) from error


def _kind(name: str) -> type:
    """Return the type of a Parquet column: bool, float, int or str; lists and mappings are text."""
    types = FORMAT.get(name) or {_RANKS.get(name, str)}
    return next((one for one in (bool, float, int) if one in types), str)


def xlsx(table: Table) -> bytes:
    """Return a table's records as an Excel workbook without formulas, with a second sheet of notes.

    Raises
    ------
    UsageError
        If openpyxl is not installed.
    """
    book = _library("openpyxl", "An Excel file", "xlsx").Workbook(write_only=True)
    names, lines = flat_records(table)
    notes = [one for block in table.blocks for one in (block.title, block.setting, block.origin, *block.verdict)]
    sheets = {"leaderboard": [names, *lines], "notes": [[one] for one in (*notes, *table.notes, *table.footer)]}
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append([_cell(sheet, value) for value in row])
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def _cell(sheet: Any, value: Any) -> Any:
    from openpyxl.cell import WriteOnlyCell

    if isinstance(value, str):
        cell = WriteOnlyCell(sheet, value=visible(value))
        cell.data_type = "s"  # a text that begins with = is no formula
        return cell
    return None if isinstance(value, float) and not math.isfinite(value) else value
