"""The page: a table and its rows, laid into one HTML text that needs nothing from anywhere."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from string import Template
from typing import Any

import tactbench
from tactbench.core.leaderboard.board.columns import column, cut_start, deflated, details, plain, plain_values
from tactbench.core.leaderboard.board.static import static_tables
from tactbench.core.leaderboard.column_table import ColumnTable
from tactbench.core.leaderboard.columns import VALUES
from tactbench.core.leaderboard.lines import RowTexts
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, SIMULATED
from tactbench.core.leaderboard.one_file import house_style, own, policy_hash
from tactbench.core.leaderboard.row_groups import GROUPS, TITLES
from tactbench.core.leaderboard.table import NUMERIC, Block, Table
from tactbench.core.leaderboard.text import visible
from tactbench.core.leaderboard.text_table import TextTable
from tactbench.core.matrix.store.sharing import canonical, provenance_id

TITLE = "tactbench leaderboard"
LARGEST = 4_000_000
"""Bytes of a page: what does not fit is left to the cells' files, and the page says so."""
MOST_STATIC = 500
"""Lines up to which the page also holds its tables as plain HTML, for readers without scripts."""
LONGEST_NOTE = 4_000
MOST_NOTES = 2_000
MOST_LINES = 500
"""Lines of a table below the blocks."""
DURATIONS = ("delay", "latency p50", "p95", "fit", "sim", "batch/row")
"""Columns that a score can be drawn against."""
_SCRIPTS = ("read.js", "text.js", "cells.js", "tables.js", "matrix.js", "pareto.js", "start.js")
_HOME = "tactbench.core.leaderboard.board"
_DATA_HERE = "{the data}"
_SPARE = 4_000
"""Characters for the names of the details and the quotes between the columns."""


def page_of(table: Table) -> str:
    """Return the page of a table with times; the same table gives the same page."""
    by_key = table.shown.by_key
    frame = _frame(by_key, static_tables(table) if len(by_key.rows) <= MOST_STATIC else "")
    columns = [deflated(_column(name, table.shown)) for name in table.columns]
    head = _head(table)
    taken = len(frame.encode()) + sum(map(len, columns)) + len(deflated(head)) + _SPARE
    fields, left_out = details(by_key, LARGEST - taken)
    head |= {"fields": list(fields), "leftOut": left_out}
    data = json.dumps([deflated(head), *columns, *fields.values()])
    # The last one: a name may say the same.
    before, _, after = frame.rpartition(_DATA_HERE)
    return before + data + after


def _head(table: Table) -> dict[str, Any]:
    """Return all that the page's script must know beside its columns."""
    shown, by_key = table.shown, table.shown.by_key
    firsts = [by_key.rows[block.places[0]] for block in table.blocks]
    notes = [cut_start(note, LONGEST_NOTE) for note in table.notes]
    if len(notes) > MOST_NOTES:
        notes = [*notes[:MOST_NOTES], f"{len(notes) - MOST_NOTES} more notes are not in this page."]
    return {
        "version": tactbench.__version__,
        "rows": len(by_key.rows),
        "order": [place for block in table.blocks for place in block.places],
        "kinds": column(shown.kinds),
        "blocks": [
            {"title": block.title, "verdict": list(block.verdict), "size": len(block.places)}
            | {"lower": first["metric"] in LOWER_IS_BETTER, "metric": first["metric"], "unit": first["unit"]}
            | {"simulated": _is_simulated(block)}
            for block, first in zip(table.blocks, firsts, strict=True)
        ],
        "columns": [{"name": name, "numeric": name in NUMERIC} for name in table.columns],
        "sections": [_section(section) for section in table.sections],
        "footer": [cut_start(text, LONGEST_NOTE) for text in table.footer],
        "roles": {"rank": "#", "sensor": "sensor", "estimator": "estimator", "score": "score",
                  "interval": "95 % interval", "times": [name for name in DURATIONS if name in table.columns]},
        "groups": GROUPS,
        "titles": TITLES,
        "notes": notes,
        "provenance": [[_id(entry), plain(entry)] for entry in table.provenance],
    }  # fmt: skip


def _is_simulated(block: Block) -> bool:
    """Return whether a block stands among simulated ones; a cell that was not begun does not know it of itself."""
    simulated = block.shown.by_key["simulated"]
    return SIMULATED in block.title.split(" · ")[2:] or any(simulated[place] for place in block.places)


def _id(entry: Mapping[str, Any]) -> str:
    """Return what rows call their provenance by (`made_by`); "" if it is no plain data."""
    try:
        return provenance_id(canonical(dict(entry)).encode())
    except (TypeError, ValueError, RecursionError):
        return ""


def _section(section: TextTable) -> dict[str, Any]:
    """Return a table below the blocks, which no cell is behind."""
    lines = [list(line) for line in section.lines[:MOST_LINES]]
    more = len(section.lines) - len(lines)
    notes = [*section.notes, *([f"{more} more lines are in the tables, not in this page."] if more else [])]
    return {
        "title": section.title,
        "columns": [[name, name in section.numeric] for name in section.columns],
        "lines": lines,
        "alarms": [place for place, kind in enumerate(section.kinds) if kind == "alarm"],
        "notes": [cut_start(note, LONGEST_NOTE) for note in notes],
    }


def _column(name: str, shown: RowTexts) -> dict[str, Any]:
    """Return a column of the table: its texts, and of numbers what they are sorted by."""
    if name not in NUMERIC:
        return column(plain_values(shown.texts[name]))
    values: Sequence[float | None]
    if name == "#":
        values = [placing and placing.place for placing in shown.placings]
    elif name == "rank 95 %":
        values = [(one.low + one.high) / 2 if one and one.low and one.high else None for one in shown.placings]
    else:
        values = list(map(VALUES[name], shown.by_key.rows))
    # A stopped cell may know a number that the table does not show: it is not sorted by it either.
    values = [None if kind in ("failed", "skipped") else one for one, kind in zip(values, shown.kinds, strict=True)]
    return column(shown.texts[name], values)


def _frame(by_key: ColumnTable, tables: str) -> str:
    """Return the page but for its data."""
    style = house_style() + own(_HOME, "board.css")
    script = '\n"use strict";\n(() => {\n' + own(_HOME, *_SCRIPTS) + "})();\n"
    if not tables:
        tables = (
            f"<p class='missing'>This board has {len(by_key.rows):,} cells: a script of its own draws them, and needs "
            "a browser that allows it. Nothing is fetched from anywhere. Without scripts, read "
            "<code>leaderboard.md</code> or <code>leaderboard.csv</code> in the result folder.</p>"
        )
    return Template(own(_HOME, "board.html")).substitute(
        title=escape(TITLE),
        version=escape(tactbench.__version__),
        style=style,
        script=script,
        style_hash=policy_hash(style),
        script_hash=policy_hash(script),
        summary=escape(_summary(by_key)),
        tables=tables,
        data=_DATA_HERE,
    )


def _summary(by_key: ColumnTable) -> str:
    """Return how many cells there are, and how they ended."""
    ends = Counter(map(visible, map(str, by_key["status"])))
    statuses = ", ".join(f"{count:,} {status}" for status, count in ends.most_common())
    sensors, tasks = (len(set(by_key[key])) for key in ("sensor", "task"))
    if not by_key.rows:
        return "No cells."
    return f"{len(by_key.rows):,} cells of {sensors:,} sensors and {tasks:,} tasks: {statuses}."
