"""The page: a table and its rows, laid into one HTML text that needs nothing from anywhere."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import tactbench
from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.board.columns import column, cut_start, deflated, details, plain, plain_values
from tactbench.core.leaderboard.columns import NUMERIC
from tactbench.core.leaderboard.lines import Line
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, SIMULATED
from tactbench.core.leaderboard.row_groups import GROUPS, TITLES
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.view import full_grid
from tactbench.core.matrix.store.sharing import canonical, provenance_id
from tactbench.core.tables.html import render
from tactbench.core.tables.text import visible

Row = Mapping[str, Any]

LARGEST = 4_000_000
"""Bytes of a page: what does not fit is left to the cells' files, and the page says so."""
MOST_STATIC = 500
"""Lines up to which the page also holds its tables as plain HTML, for readers without scripts."""
LONGEST_NOTE = 4_000
MOST_NOTES = 2_000
MOST_LINES = 500
"""Lines of a table below the blocks; `leaderboard.md` has them all."""
DURATIONS = ("delay", "latency p50", "p95", "fit", "sim", "batch/row")
"""Columns that a score can be drawn against."""
_SCRIPTS = ("read.js", "text.js", "cells.js", "tables.js", "matrix.js", "pareto.js", "start.js")
_DATA_HERE = "{the data}"
_SPARE = 4_000
"""Characters for the names of the details and the quotes between the columns."""


def page_of(table: Table) -> str:
    """Return the page of a table with times; the same table gives the same page."""
    # By name: neighbours are alike, and deflate to less than in the order of the table.
    lines = sorted(table.lines, key=lambda line: str(line.row["cell"]))
    rows = [line.row for line in lines]
    few = len(rows) <= MOST_STATIC
    frame = render(
        "tactbench.core.leaderboard.board",
        "board.html",
        title="tactbench leaderboard",
        styles=["board.css"],
        scripts=_SCRIPTS,
        summary=_summary(rows),
        rows=len(rows),
        tables=[full_grid(block) for block in table.blocks] if few else [],
        notes=table.notes if few else (),
        sections=[replace(section, lines=section.lines[:MOST_LINES]) for section in table.sections],
        footer=[cut_start(text, LONGEST_NOTE) for text in table.footer],
        data=_DATA_HERE,
    )
    columns = [deflated(_column(name, lines)) for name in table.columns]
    head = _head(table, lines)
    taken = len(frame.encode()) + sum(map(len, columns)) + len(deflated(head)) + _SPARE
    fields, left_out = details(rows, LARGEST - taken)
    head |= {"fields": list(fields), "leftOut": left_out}
    data = json.dumps([deflated(head), *columns, *fields.values()])
    # The last one: a name may say the same.
    before, _, after = frame.rpartition(_DATA_HERE)
    return before + data + after


def _head(table: Table, lines: Sequence[Line]) -> dict[str, Any]:
    """Return all that the page's script must know beside its columns, of these lines."""
    places = {id(line): place for place, line in enumerate(lines)}
    firsts = [block.lines[0].row for block in table.blocks]
    notes = [cut_start(note, LONGEST_NOTE) for note in table.notes]
    if len(notes) > MOST_NOTES:
        notes = [*notes[:MOST_NOTES], f"{len(notes) - MOST_NOTES} more notes are not in this page."]
    return {
        "version": tactbench.__version__,
        "rows": len(lines),
        "order": [places[id(line)] for line in table.lines],
        "kinds": column([line.kind for line in lines]),
        "blocks": [
            {"title": block.title, "verdict": list(block.verdict), "size": len(block.lines)}
            | {"lower": first["metric"] in LOWER_IS_BETTER, "metric": first["metric"], "unit": first["unit"]}
            | {"simulated": _is_simulated(block)}
            for block, first in zip(table.blocks, firsts, strict=True)
        ],
        "columns": [{"name": name, "numeric": name in NUMERIC} for name in table.columns],
        "roles": {"rank": "#", "sensor": "sensor", "estimator": "estimator", "score": "score",
                  "interval": "95 % interval", "times": [name for name in DURATIONS if name in table.columns]},
        "groups": GROUPS,
        "titles": TITLES,
        "notes": notes,
        "provenance": [[_id(entry), plain(entry)] for entry in table.provenance],
    }  # fmt: skip


def _is_simulated(block: Block) -> bool:
    """Return whether a block stands among simulated ones; a cell that was not begun does not know it of itself."""
    return SIMULATED in block.title.split(" · ")[2:] or any(line.row["simulated"] for line in block.lines)


def _id(entry: Mapping[str, Any]) -> str:
    """Return what rows call their provenance by (`made_by`); "" if it is no plain data."""
    try:
        return provenance_id(canonical(dict(entry)).encode())
    except (TypeError, ValueError, RecursionError):
        return ""


def _column(name: str, lines: Sequence[Line]) -> dict[str, Any]:
    """Return a column of the table: its texts, and of numbers what they are sorted by."""
    texts = [line.texts[name] for line in lines]
    return column(texts, [line.value(name) for line in lines]) if name in NUMERIC else column(plain_values(texts))


def _summary(rows: Sequence[Row]) -> str:
    """Return how many cells there are, and how they ended."""
    if not rows:
        return "No cells."
    ends = Counter(visible(str(row["status"])) for row in rows)
    statuses = ", ".join(f"{count:,} {status}" for status, count in ends.most_common())
    sensors, tasks = (len({row[key] for row in rows}) for key in ("sensor", "task"))
    return f"{len(rows):,} cells of {sensors:,} sensors and {tasks:,} tasks: {statuses}."
