"""The page: a table and its rows, laid into one HTML text that needs nothing from anywhere."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from string import Template
from typing import Any

import tactbench
from tactbench.core.leaderboard.board.digits import FEW_STEPS, STEPS, write_digits
from tactbench.core.leaderboard.board.fields import MANY, NOTHING, write_fields
from tactbench.core.leaderboard.board.pack import Column, Pack, deflated
from tactbench.core.leaderboard.board.sound import sound, table_of
from tactbench.core.leaderboard.board.still import still
from tactbench.core.leaderboard.board.words import cut, tame, write_words
from tactbench.core.leaderboard.collector import collector_at_rest
from tactbench.core.leaderboard.lines import Shown
from tactbench.core.leaderboard.names import SIMULATED
from tactbench.core.leaderboard.one_file import house_style, own, policy_hash
from tactbench.core.leaderboard.particulars import GROUPS, TITLES
from tactbench.core.leaderboard.sheet import Sheet
from tactbench.core.leaderboard.table import LOWER_IS_BETTER, NUMERIC, Block, Section, Table
from tactbench.core.leaderboard.text import visible
from tactbench.core.leaderboard.values import VALUES
from tactbench.core.matrix.store.sharing import canonical, provenance_id

Row = Mapping[str, Any]

TITLE = "tactbench leaderboard"
LARGEST = 2_000_000
"""Bytes of a page: what does not fit is left to the shards, and the page says so."""
MOST_STILL = 500
"""Lines up to which the page also holds its tables as plain HTML, for readers without scripts."""
LONGEST_NOTE = 4_000
MOST_NOTES = 2_000
MOST_LINES = 500
"""Lines of a table below the blocks."""
_SCRIPTS = ("read.js", "text.js", "cells.js", "tables.js", "matrix.js", "pareto.js", "start.js")
DURATIONS = ("delay", "latency p50", "p95", "fit", "sim", "batch/row")
"""Columns that a score can be drawn against."""
_HOME = "tactbench.core.leaderboard.board"


def to_html(rows: Sequence[Row], provenance: Sequence[Mapping[str, Any]] = ()) -> str:
    """Return the leaderboard of `rows` as one HTML page; the same rows give the same page.

    Parameters
    ----------
    rows
        As a run writes them. What is odd in them is set right or left out, and the page says so.
    provenance
        What made them, one entry a run.
    """
    with collector_at_rest():
        kept, remarks = sound(rows)
        return page_of(table_of(kept, provenance), remarks)


def page_of(table: Table, remarks: Sequence[str] = ()) -> str:
    """Return the page of a table.

    Parameters
    ----------
    table
        With times.
    remarks
        What a reader must know first.
    """
    sheet = table.shown.sheet
    pack = Pack()
    head = _head(pack, table, remarks)
    frame = _frame(sheet, still(table, remarks) if len(sheet.rows) <= MOST_STILL else "")
    taken = len(frame.encode()) + len(deflated(_json(head))) + _ROOM_FOR_FIELDS
    head["fields"], head["leftOut"] = write_fields(pack, sheet, LARGEST - taken)
    written = pack.add(_json(head))
    data = json.dumps({"head": written, "blobs": pack.blobs}, separators=(",", ":"))
    # The last one: a name may say the same.
    before, _, after = frame.rpartition(_DATA_HERE)
    return before + data + after


_ROOM_FOR_FIELDS = 12_000
"""Characters kept for what describes the columns of details, and for what stands between the blobs."""
_DATA_HERE = "{the data}"


def _json(value: Any) -> bytes:
    return json.dumps(value, separators=(",", ":")).encode()


def _head(pack: Pack, table: Table, remarks: Sequence[str]) -> dict[str, Any]:
    """Return all that the page's script must know, the blobs that it is in aside."""
    shown, sheet = table.shown, table.shown.sheet
    firsts = [sheet.rows[block.places[0]] for block in table.blocks]
    notes = [cut(note, LONGEST_NOTE) for note in (*remarks, *table.notes)]
    if len(notes) > MOST_NOTES:
        notes = [*notes[:MOST_NOTES], f"{len(notes) - MOST_NOTES} more notes are not in this page."]
    return {
        "version": tactbench.__version__,
        "rows": len(sheet.rows),
        "order": pack.planes([place for block in table.blocks for place in block.places]),
        "kinds": write_words(pack, shown.kinds) or NOTHING,
        "blocks": [
            {"title": block.title, "verdict": list(block.verdict), "size": len(block.places)}
            | {"lower": first["metric"] in LOWER_IS_BETTER, "metric": first["metric"], "unit": first["unit"]}
            | {"simulated": _is_simulated(block)}
            for block, first in zip(table.blocks, firsts, strict=True)
        ],
        "columns": [
            {"name": name, "numeric": name in NUMERIC, "column": _column(pack, name, shown)} for name in table.columns
        ],
        "sections": [_section(section) for section in table.sections],
        "foot": [cut(text, LONGEST_NOTE) for text in table.foot],
        "roles": _roles(table.columns),
        "groups": GROUPS,
        "titles": TITLES,
        "notes": notes,
        "provenance": [[_id(entry), tame(entry)] for entry in table.provenance],
    }


def _is_simulated(block: Block) -> bool:
    """Tell whether a block stands among simulated ones; a cell that was not begun does not know it of itself."""
    simulated = block.shown.sheet["simulated"]
    return SIMULATED in block.title.split(" · ")[2:] or any(simulated[place] for place in block.places)


def _id(entry: Mapping[str, Any]) -> str:
    """Return what rows call their provenance by (`made_by`); "" if it is no plain data."""
    try:
        return provenance_id(canonical(dict(entry)).encode())
    except (TypeError, ValueError, RecursionError):
        return ""


def _section(section: Section) -> dict[str, Any]:
    """Return a table below the blocks, which no cell is behind."""
    lines = [list(line) for line in section.lines[:MOST_LINES]]
    more = len(section.lines) - len(lines)
    notes = [*section.notes, *([f"{more} more lines are in the tables, not in this page."] if more else [])]
    return {
        "title": section.title,
        "columns": [[name, name in section.numeric] for name in section.columns],
        "lines": lines,
        "alarms": sorted(section.alarms),
        "notes": [cut(note, LONGEST_NOTE) for note in notes],
    }


def _roles(columns: Sequence[str]) -> dict[str, Any]:
    """Return which columns the page's script needs by what they are."""
    first = next((name for name in columns if name in ("#", "rank")), "")
    named = {"rank": first, "sensor": "sensor", "estimator": "estimator", "score": "score", "interval": "95 % interval"}
    return {**named, "times": [name for name in DURATIONS if name in columns]}


def _column(pack: Pack, name: str, shown: Shown) -> Column:
    texts = shown.texts[name]
    if name in NUMERIC:
        values = None
        if name in VALUES:
            # A stopped cell may know a number that the table does not show: it is not sorted by it either.
            values = list(VALUES[name](shown.sheet))
            for place, kind in enumerate(shown.kinds):
                if kind in ("failed", "skipped"):
                    values[place] = None
        column = write_digits(pack, texts, values, FEW_STEPS if len(texts) > MANY else STEPS)
        if column is not None:
            return column
    return write_words(pack, texts) or NOTHING


def _frame(sheet: Sheet, shown: str) -> str:
    """Return the page but for its data."""
    style = house_style() + own(_HOME, "board.css")
    script = '\n"use strict";\n(() => {\n' + own(_HOME, *_SCRIPTS) + "})();\n"
    if not shown:
        shown = (
            f"<p class='missing'>This board has {len(sheet.rows):,} cells: a script of its own draws them, and needs a "
            "browser that allows it. Nothing is fetched from anywhere. Without scripts, read "
            "<code>leaderboard.md</code> or <code>leaderboard.csv</code> in the result folder.</p>"
        )
    return Template(own(_HOME, "board.html")).substitute(
        title=escape(TITLE),
        version=escape(tactbench.__version__),
        style=style,
        script=script,
        style_hash=policy_hash(style),
        script_hash=policy_hash(script),
        summary=escape(_summary(sheet)),
        shown=shown,
        data=_DATA_HERE,
    )


def _summary(sheet: Sheet) -> str:
    """Return how many cells there are, and how they ended."""
    ends = Counter(map(visible, map(str, sheet["status"])))
    told = ", ".join(f"{count:,} {status}" for status, count in ends.most_common())
    sensors, tasks = (len(set(sheet[key])) for key in ("sensor", "task"))
    if not sheet.rows:
        return "No cells."
    return f"{len(sheet.rows):,} cells of {sensors:,} sensors and {tasks:,} tasks: {told}."
