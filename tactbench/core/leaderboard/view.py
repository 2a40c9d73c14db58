"""What of a table is printed for people: eight columns and three notes, or all of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from tactbench.core.errors import UnknownNameError
from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.columns import COLUMNS, INTERVALS, NUMERIC, SHOWN
from tactbench.core.leaderboard.names import Row, metric_name
from tactbench.core.leaderboard.table import Table
from tactbench.core.statistics.replicates import counted, percent
from tactbench.core.tables.numbers import ABSENT
from tactbench.core.tables.text import command_line, visible
from tactbench.core.tables.text_table import Entry, TextTable, finite, text_table

CELL = "cell"
"""The column of cells' names, as `why` and `rerun` take them."""
DEFAULT = ("#", "sensor", "level", "estimator", "score", "95 % interval", "published", "delay", "fit")
OF_FLOOR = ("#", "sensor", "level", "estimator", "score", "beyond floor", "95 % beyond", "published", "delay")
"""Where a block has errors beyond the floor of the reference: what its ranks go by, with its interval."""
MOST_NOTES = 3
_FIRST_TO_GO = (
    "cell", "batch/row", "p95", "sessions", "n test", "sim", "baseline", "latency p50", "rank 95 %", "fit",
    "true error", "level", "95 % interval", "published", "delay", "95 % beyond",
)  # fmt: skip
"""Columns that a terminal does without, in this order; those that were asked for by name are never left out."""


@dataclass(frozen=True)
class View:
    """What is printed of a table."""

    wide: bool = False
    """All columns, and the tables that only give details."""
    notes: bool = False
    """All notes and the whole provenance."""
    columns: tuple[str, ...] = ()
    """These columns instead; see `known_columns`."""
    folder: str = ""
    """The result folder, for commands that are named; empty: the default one."""


DEFAULT_VIEW = View()
WHOLE = View(wide=True, notes=True)


def known_columns(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of columns that a person asks for by these or by their names for programs (``rank``).

    Raises
    ------
    UnknownNameError
        If there is no such column.
    """
    known = {name: name for name in (*COLUMNS, CELL)} | {shown: name for name, shown in SHOWN.items()}
    for name in names:
        if name not in known:
            raise UnknownNameError("column", name, (*COLUMNS, CELL))
    return tuple(dict.fromkeys(known[name] for name in names))


def document(table: Table, view: View) -> list[TextTable | tuple[str, ...]]:
    """Return the tables and notes that are printed, from above."""
    sentences = (*notes(table, view), *commands(table, view))
    parts: list[TextTable | tuple[str, ...]] = [*grids(table, view), sentences, *sections(table, view)]
    return [part for part in (*parts, footer(table, view)) if part]


def grids(table: Table, view: View) -> list[TextTable]:
    """Return what is printed of a table's blocks."""
    return [_grid(block, view) for block in table.blocks]


def _grid(block: Block, view: View) -> TextTable:
    texts = [{**line.texts, CELL: visible(_cell(line.row))} for line in block.lines]
    if all("†" in text["score"] for text, line in zip(texts, block.lines, strict=True) if line.row["status"] == "done"):
        # The title has it: not repeated behind every score.
        texts = [{**text, "score": text["score"].replace(" †", "")} for text in texts]
    if view.columns:
        names = [name for name in view.columns if name in texts[0]]
    elif view.wide:
        names = [name for name in texts[0] if any(text[name].strip(ABSENT) for text in texts)]
    else:
        floor = any(text.get("beyond floor", ABSENT) != ABSENT for text in texts)
        names = [name for name in (OF_FLOOR if floor else DEFAULT) if name in texts[0]]
    rows = [line.row for line in block.lines]
    return TextTable(
        block.title, tuple(names), tuple(tuple(text[name] for name in names) for text in texts), NUMERIC,
        headings=tuple(header(name, rows) for name in names), kinds=tuple(line.kind for line in block.lines),
        summary=block.verdict, first_to_go=() if view.columns else _FIRST_TO_GO, intervals=frozenset(INTERVALS),
        unbroken=frozenset({CELL}),
    )  # fmt: skip


def full_grid(block: Block) -> TextTable:
    """Return a block with every column, what numbers are sorted by, and why cells did not end well."""
    lines = []
    for line in block.lines:
        row = line.row
        texts = [
            text
            if name not in NUMERIC or text in ("", ABSENT)
            else Entry(text, finite(line.value(name)), cell=row["cell"])
            for name, text in line.texts.items()
        ]
        lines.append([*texts, "" if row["status"] == "done" else visible(f"{row['status']}: {row['reason']}")])
    columns, kinds = (*block.lines[0].texts, "reason"), [line.kind for line in block.lines]
    return replace(text_table(block.title, columns, lines, numeric=NUMERIC, kinds=kinds), summary=block.verdict)


def _cell(row: Row) -> str:
    """Return the name of a cell, without the number of its only replicate."""
    name = str(row["cell"])
    return name.removesuffix(f"/{row.get('repeat')}") if row.get("repeats") == 1 else name


def header(name: str, rows: Sequence[Row]) -> str:
    """Return what stands above a column of a block: a score by its metric and unit, an interval by what it is over."""
    first = rows[0]
    if name == "score":
        return metric_name(first)
    if name in ("beyond floor", "true error"):
        return name if first["unit"] == "1" else f"{name} [{visible(str(first['unit']))}]"
    if name == "95 % interval" and all(row.get("n_replicates") and row["ci_low"] is None for row in rows):
        return "range"
    if name not in INTERVALS:
        return name
    end = "ci_low" if name == "95 % interval" else "beyond_floor_ci_low"
    found = {(row.get("n_replicates"), row.get("replicate_unit")) for row in rows if row.get(end) is not None}
    number, unit = found.pop() if len(found) == 1 else (None, None)
    if not number:
        return name  # they differ in what they are over, or do not know it
    level = percent(first.get("n_replicates"), first.get("replicate_unit"))
    over = f"over {counted(number, visible(str(unit or 'replicate')))}"
    return f"{level} {over}" if name == "95 % interval" else f"{name.replace('95 %', level)}, {over}"


def sections(table: Table, view: View) -> tuple[TextTable, ...]:
    """Return the tables to print below the blocks."""
    return tuple(
        replace(section, first_to_go=section.columns[:0:-1], intervals=frozenset(INTERVALS))
        for section in table.sections
        if view.wide or not section.detail
    )


def notes(table: Table, view: View) -> tuple[str, ...]:
    """Return the notes to print, the most important first."""
    return table.notes if view.notes else table.notes[:MOST_NOTES]


def commands(table: Table, view: View) -> tuple[str, ...]:
    """Return the command that shows what is not printed, and the one that tells what a row rests on."""
    hidden = len(table.notes) - len(notes(table, view))
    more, options = [], []
    if hidden or len(footer(table, view)) < len(table.footer):
        more.append(f"{hidden} more note{'s' if hidden != 1 else ''}" if hidden else "the whole provenance")
        options.append("--notes")
    if not view.wide and not view.columns:
        details = [section.title.split(" · ")[0].lower() for section in table.sections if section.detail]
        more += ["all columns", *details]
        options.append("--wide")
    where, out = ((view.folder,), ("--out", view.folder)) if view.folder else ((), ())
    found = []
    if more:
        listed = " and ".join(filter(None, (", ".join(more[:-1]), more[-1])))
        shown = command_line("tactbench", "leaderboard", *where, *options)
        found.append(f"{listed[0].upper()}{listed[1:]}: `{shown}`.")
    first = next((line.row for line in table.lines if line.kind == "result"), None)
    if first is not None:
        why = command_line("tactbench", "why", _cell(first), *out)
        found.append(f"What a row rests on, its delay part by part: `{why}`.")
    return tuple(found)


def footer(table: Table, view: View) -> tuple[str, ...]:
    """Return the provenance to print."""
    return table.footer if view.notes else table.footer[:1]


def best(table: Table, count: int) -> Table:
    """Return the table with the first `count` answers of each sensor in each block; places stay those among all."""
    blocks = []
    for block in table.blocks:
        found: Counter[str] = Counter()
        kept = []
        for line in block.lines:
            found[line.row["sensor"]] += line.kind == "result"
            if line.kind == "result" and found[line.row["sensor"]] <= count:
                kept.append(line)
        blocks.append(replace(block, lines=tuple(kept)))
    which = "the first answer" if count == 1 else f"the first {count} answers"
    note = f"Of each block only {which} of each sensor; places are those among all answers."
    return replace(table, blocks=tuple(block for block in blocks if block.lines), notes=(note, *table.notes))
