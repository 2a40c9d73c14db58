"""Selection of the rows and columns of a leaderboard that are printed for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from tactbench.core.errors import UnknownNameError
from tactbench.core.leaderboard.columns import COLUMNS, DEFAULT, NUMERIC, SHOWN, Line
from tactbench.core.leaderboard.names import held_out, metric_name
from tactbench.core.leaderboard.table import Block, Table
from tactbench.core.statistics.replicates import against_reference, count_range, percent
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable

CELL, REASON = "cell", "reason"
"""Names of the columns for cell names, and for reasons why cells did not finish."""
_FIRST_TO_GO = (
    "cell", "latency p95", "latency p50", "simulation", "test samples", "interval beyond floor",
    "training", "published", "delay after touch",
)  # fmt: skip
"""Columns to leave out on a narrow terminal, in this order; columns selected by name are never left out."""


@dataclass(frozen=True)
class View:
    """Selection of the leaderboard columns to print."""

    wide: bool = False
    """True to print all columns."""
    columns: tuple[str, ...] = ()
    """Names of the columns to print instead of the default columns; see `known_columns`."""


DEFAULT_VIEW = View()
WHOLE = View(wide=True)


def known_columns(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of columns given by name (``place``) or by name for programs (``rank``).

    Raises
    ------
    UnknownNameError
        If a name is not that of a column.
    """
    known = {name: name for name in (*COLUMNS, CELL)} | {shown: name for name, shown in SHOWN.items()}
    names = [name.strip() for name in names]
    for name in names:
        if name not in known:
            raise UnknownNameError("column", name, (*COLUMNS, CELL))
    return tuple(dict.fromkeys(known[name] for name in names))


def document(table: Table, view: View = DEFAULT_VIEW) -> list[TextTable]:
    """Return the tables to print: one for each block, then events and probes."""
    return [*grids(table, view), *table.sections]


def grids(table: Table, view: View = DEFAULT_VIEW) -> list[TextTable]:
    """Return the table to print for each block."""
    return [grid(block, view) for block in table.blocks]


def grid(block: Block, view: View = DEFAULT_VIEW) -> TextTable:
    """Return the table to print for a block, with the columns of `view`."""
    # A note states why trivial answers were skipped.
    shown = [one for one in block.lines if one.kind != "skipped" or not one.row["is_baseline"]] or list(block.lines)
    texts = list(map(_texts, shown))
    names = view.columns or ((*COLUMNS, CELL) if view.wide else DEFAULT)
    names = tuple(name for name in names if name in texts[0])
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
        first_to_go=() if view.columns else _FIRST_TO_GO,
        unbroken=frozenset({CELL}),
    )
    # A column of dashes shows that no answer has a place.
    keep = ("place",) if any(one["place"] for one in texts) else ()
    return table if view.columns else table.compact(keep)


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
