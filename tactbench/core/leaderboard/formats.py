"""Selection of a leaderboard's rows and columns, and its output in all formats, with the same digits in each."""

from __future__ import annotations

import importlib
import io
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.files import replace_file
from tactbench.core.leaderboard.names import COLUMNS, DEFAULT, NUMERIC, SHOWN, Line, held_out, metric_name
from tactbench.core.leaderboard.table import Block, Table
from tactbench.core.spec.row import JSON_KEYS, OF_REPLICATES
from tactbench.core.statistics.replicates import against_reference, count_range, percent
from tactbench.core.tables import terminal
from tactbench.core.tables.markup import latex as latex_of
from tactbench.core.tables.markup import markdown
from tactbench.core.tables.text import TextTable, csv_text, in_a_field, json_text, visible

CELL, REASON = "cell", "reason"
"""Names of the columns for cell names, and for reasons why cells did not finish."""
ALL = (*COLUMNS, CELL)
"""All columns that can be chosen by name."""
_FIRST_TO_GO = (
    "cell", "latency p95", "latency p50", "simulation", "test samples", "interval beyond floor",
    "training", "published", "delay after touch",
)  # fmt: skip
"""Columns to leave out on a narrow terminal, in this order; columns selected by name are never left out."""


def known_columns(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of columns given by name (``place``) or by name for programs (``rank``).

    Raises
    ------
    UnknownNameError
        If a name is not the name of a column.
    """
    known = {name: name for name in ALL} | {shown: name for name, shown in SHOWN.items()}
    names = [name.strip() for name in names]
    for name in names:
        if name not in known:
            raise UnknownNameError("column", name, ALL)
    return tuple(dict.fromkeys(known[name] for name in names))


def document(table: Table, columns: tuple[str, ...] = DEFAULT) -> list[TextTable]:
    """Return the tables to print: one for each block, then events."""
    return [*grids(table, columns), *table.sections]


def grids(table: Table, columns: tuple[str, ...] = DEFAULT) -> list[TextTable]:
    """Return the table to print for each block."""
    return [grid(block, columns) for block in table.blocks]


def grid(block: Block, columns: tuple[str, ...] = DEFAULT) -> TextTable:
    """Return the table to print for a block; columns that were chosen by name are printed though they are empty."""
    chosen = columns not in (DEFAULT, ALL, _IN_A_PAPER)
    # A note states why trivial answers were skipped.
    shown = [one for one in block.lines if one.kind != "skipped" or not one.row["is_baseline"]] or list(block.lines)
    texts = list(map(_texts, shown))
    names = tuple(name for name in columns if name in texts[0])
    table = TextTable(
        block.title,
        names,
        tuple(tuple(one[name] for name in names) for one in texts),
        NUMERIC - {"place"},
        headings=headings(names, block),
        kinds=tuple(line.kind for line in shown),
        origin=block.origin,
        summary=(block.setting, *block.verdict),
        notes=block.notes,
        first_to_go=() if chosen else _FIRST_TO_GO,
        unbroken=frozenset({CELL}),
    )
    # A column of dashes shows that no answer has a place.
    keep = ("place",) if any(one["place"] for one in texts) else ()
    return table if chosen else table.compact(keep)


def _texts(line: Line) -> dict[str, str]:
    row = line.row
    why = "" if row["status"] == "done" else visible(f"{row['status']}: {row['reason']}")
    return {**line.texts, CELL: visible(str(row["cell"])), REASON: why}


def headings(names: Sequence[str], block: Block) -> tuple[str, ...]:
    """Return the headings of columns, such as metric and unit for a score, and confidence level for an interval."""
    row = block.lines[0].row
    unit = "" if row["unit"] == "1" else visible(f" [{row['unit']}]")
    interval = "interval"
    results = [line.row for line in block.lines if line.kind == "result"]
    known = [one for one in results if one["ci_low"] is not None and one.get("n_replicates")]
    if known:
        levels = {percent(one["n_replicates"], one.get("replicate_unit")) for one in known}
        of = str(known[0]["replicate_unit"]) if held_out(known[0]) else "campaign"
        over = visible(count_range([one["n_replicates"] for one in known], of))
        interval = f"{levels.pop()} interval over {over}" if len(levels) == 1 else f"interval over {over}"
    shown = {"score": metric_name(row), "interval": interval, "notes": ""}
    shown |= {"beyond floor": f"beyond floor{unit}", "against reference": metric_name(against_reference(row))}
    return tuple(shown.get(name, name) for name in names)


def best(table: Table, count: int) -> Table:
    """Return the table with the best `count` answers of each sensor in each block, with places among all answers."""
    blocks = []
    for block in table.blocks:
        found: Counter[str] = Counter()
        kept = []
        for line in block.lines:
            found[line.row["sensor"]] += line.kind == "result"
            if line.kind == "result" and found[line.row["sensor"]] <= count:
                kept.append(line)
        setting = f"{block.setting} · of each sensor the first {count}, places among all"
        blocks.append(replace(block, lines=tuple(kept), setting=setting))
    return replace(table, blocks=tuple(block for block in blocks if block.lines))


SUFFIXES = {".json": "json", ".csv": "csv", ".md": "md", ".tex": "latex", ".txt": "table",
            ".parquet": "parquet", ".xlsx": "xlsx"}  # fmt: skip
"""Output format by suffix of the file."""
_IN_A_PAPER = ("place", "sensor", "estimator", "score", "notes", "interval", "range", "against reference", "published")


def latex(table: Table, columns: tuple[str, ...]) -> str:
    """Return the tables as LaTeX, each one column wide, with metric, protocol, split and origin in the caption."""
    names = _IN_A_PAPER if columns in (DEFAULT, ALL) else columns
    titles = [f"{block.title} · {block.setting} · {block.origin}" for block in table.blocks]
    titled = [replace(grid(block, names), title=title) for block, title in zip(table.blocks, titles, strict=True)]
    return latex_of([*titled, *table.sections], wide=False)


def rendered(table: Table, shape: str, columns: tuple[str, ...] = ALL, width: int = terminal.WITHOUT_EDGE) -> bytes:
    """Return a leaderboard as the content of a file in the format `shape`, one of the values of `SUFFIXES`.

    Parameters
    ----------
    columns, width
        Columns and width [characters] of formats for people; formats for programs hold all columns.

    Raises
    ------
    UsageError
        If the library for Parquet or Excel files is not installed.
    """
    if shape in ("parquet", "xlsx"):
        return parquet(table) if shape == "parquet" else xlsx(table)
    if shape == "table":
        text = terminal.plain_text(document(table, columns), width)
    elif shape == "md":
        text = markdown([*document(table, columns), *([table.footer] if table.footer else [])])
    elif shape == "latex":
        text = latex(table, columns)
    else:
        text = csv_text(*_flat(table)) if shape == "csv" else json_array(table)
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


def _flat(table: Table) -> tuple[list[str], list[list[Any]]]:
    """Return the names of the columns, all keys and ``shown_…``, and the lines, with lists and mappings as JSON."""
    names = [*_KEYS, *_RANKS, *(f"shown_{SHOWN[name]}" for name in COLUMNS)]
    return names, [[*map(_field, row.values()), *shown.values()] for row, shown in records(table)]


def _field(value: Any) -> Any:
    return visible(value) if isinstance(value, str) else in_a_field(value)


def parquet(table: Table) -> bytes:
    """Return the columns of CSV, typed, as a Parquet file; raises UsageError without pyarrow."""
    arrow, writer = (_library(name, "parquet") for name in ("pyarrow", "pyarrow.parquet"))
    names, lines = _flat(table)
    out = io.BytesIO()
    writer.write_table(arrow.table({name: [line[place] for line in lines] for place, name in enumerate(names)}), out)
    return out.getvalue()


def xlsx(table: Table) -> bytes:
    """Return the lines of CSV as a sheet of an Excel workbook; raises UsageError without openpyxl."""
    book = _library("openpyxl", "xlsx").Workbook(write_only=True)
    sheet = book.create_sheet("leaderboard")
    names, lines = _flat(table)
    for line in (names, *lines):
        sheet.append([None if isinstance(one, float) and not math.isfinite(one) else one for one in line])
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def _library(name: str, extra: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise UsageError(
            f"A file .{extra} needs {name}, which cannot be imported: {error}.",
            hint=f"Install it with `pip install 'tactbench[{extra}]'`.",
        ) from error


def json_array(table: Table) -> str:
    """Return a table as a JSON array with one line for each record: all keys, and the texts shown in ``shown``."""
    lines = (json_text(values | {"shown": shown}) for values, shown in records(table))
    return "[\n" + ",\n".join(lines) + "\n]\n"
