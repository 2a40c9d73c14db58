"""The page: a table and its rows, laid into one HTML text that needs nothing from anywhere.

Its data are columns: each is a JSON document, deflated, as base64, whose alphabet cannot end a script.
"""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.columns import NUMERIC, Line
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, SIMULATED, Row, metric_name
from tactbench.core.leaderboard.records import APART, GROUPS, TITLES
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.view import full_grid
from tactbench.core.provenance.source import provenance_id
from tactbench.core.spec.row import FORMAT
from tactbench.core.tables.html import render
from tactbench.core.tables.text import visible

LARGEST = 4_000_000
"""Bytes of a page: what does not fit is left to the cells' files, and the page says so."""
MOST_STATIC = 500
"""Lines up to which the page also holds its tables as plain HTML, for readers without scripts."""
LONGEST_NOTE = 4_000
MOST_NOTES = 2_000
MOST_LINES = 500
"""Lines of a table below the blocks; `leaderboard.md` has them all."""
DURATIONS = ("delay after touch", "latency p50", "latency p95", "training", "simulation")
"""Columns that a score can be drawn against."""
_SCRIPTS = ("read.js", "text.js", "cells.js", "tables.js", "matrix.js", "pareto.js", "start.js")
_DATA_HERE = "{the data}"
_SPARE = 4_000
"""Characters for the names of the details and the quotes between the columns."""
MANY = 5_000
"""Cells beyond which numbers are told to few digits, and what is large and each cell's own is left to its file."""
DIGITS, FEW_DIGITS = 17, 5
"""Significant digits of a number: all that a float64 has; where there are many cells."""
KEY_DIGITS = 8
"""Of a key, where there are many: one of 50,000 others shares them once in 86,000 times."""
LONGEST = 65_536
"""Characters of a text: what a cell may print is kept to as many bytes."""
MOST_OTHERS = 200
"""Keys of no format of ours, those that most rows have."""
DEEPEST = 12
"""Levels of lists in lists."""
_LENGTHS = (LONGEST, 8_192, 1_024, 200)
"""Characters that texts are cut to, one after the other, until the column fits."""
_IN_THE_TABLE = (
    "score", "ci_low", "ci_high", "baseline", "published", "n_sessions", "n_test", "sim_s", "fit_s", "predict_s",
    "answer_delay_ms", "latency_ms_p50", "latency_ms_p95",
)  # fmt: skip
"""Where there are many cells, these are told as the table shows them."""
_LARGE = ("scores", "confusion", "search", "replicates")
"""What is large and each cell's own."""
_GROUPED = {*chain.from_iterable(GROUPS.values()), *TITLES, *APART, "log"}
"""Keys that have a place among a cell's details."""
_text = json.JSONEncoder(sort_keys=True).encode


def page_of(table: Table) -> str:
    """Return the page of a table with times; the same table gives the same page."""
    # By name: neighbours are alike, and deflate to less than in the order of the table.
    lines = sorted(table.lines, key=lambda line: str(line.row["cell"]))
    rows = [line.row for line in lines]
    few = len(rows) <= MOST_STATIC
    frame = render(
        "tactbench.core.leaderboard",
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
    others = [key for key in fields if key not in _GROUPED]
    head |= {"fields": list(fields), "leftOut": left_out, "groups": {**GROUPS, "Also": others}}
    head |= {"titles": {**TITLES, **dict(zip(others, others, strict=True))}}
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
        "rows": len(lines),
        "order": [places[id(line)] for line in table.lines],
        "kinds": column([line.kind for line in lines]),
        "blocks": [
            {"title": block.title, "verdict": list(block.verdict), "size": len(block.lines)}
            | {"lower": first["metric"] in LOWER_IS_BETTER, "metric": metric_name(first)}
            | {"simulated": _is_simulated(block)}
            for block, first in zip(table.blocks, firsts, strict=True)
        ],
        "columns": [{"name": name, "numeric": name in NUMERIC} for name in table.columns],
        "times": [name for name in DURATIONS if name in table.columns],
        "notes": notes,
        "provenance": [[provenance_id(entry), plain(entry)] for entry in table.provenance],
    }  # fmt: skip


def _is_simulated(block: Block) -> bool:
    """Return whether a block stands among simulated ones; a cell that was not begun does not know it of itself."""
    return block.origin.startswith(("SIMULATED", SIMULATED)) or any(line.row["simulated"] for line in block.lines)


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


def deflated(document: Any) -> str:
    """Return a JSON document as a zlib stream in base64."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False)
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


def column(values: Sequence[Any], sort: Sequence[float | None] | None = None) -> dict[str, Any]:
    """Return a column, one value a row as `plain` makes them, with what rows are sorted by, if not by their texts.

    It has ``values``; or, of other than numbers that rows share, ``dictionary`` and ``index``, the place in it of each
    row's value.
    """
    if sort is not None:
        return {"values": list(values), "sort": rounded(sort)}
    if float in set(map(type, values)):
        return {"values": list(values)}
    keys = [id(value) if isinstance(value, list | dict) else (type(value), value) for value in values]
    each = dict(zip(keys, values, strict=True))
    texts: dict[str, int] = {}
    places = {key: texts.setdefault(_text(value), len(texts)) for key, value in each.items()}
    if len(texts) == len(values):
        return {"values": list(values)}
    return {"dictionary": list(map(json.loads, texts)), "index": [places[key] for key in keys]}


def rounded(numbers: Sequence[float | None]) -> list[float | None]:
    """Return numbers with the digits that a board of so many rows has; None for those that are not finite."""
    digits = FEW_DIGITS if len(numbers) > MANY else DIGITS
    return [None if one is None or not math.isfinite(one) else float(f"{one:.{digits}g}") for one in numbers]


def keys_of(rows: Sequence[Row]) -> set[str]:
    """Return the keys that rows have: of those of no format of ours the commonest, a stranger's may have a million."""
    counts = Counter(chain.from_iterable(rows))
    others = [key for key, _ in counts.most_common() if key not in FORMAT][:MOST_OTHERS]
    return {*others, *(key for key in FORMAT if key in counts)}


def details(rows: Sequence[Row], room: int) -> tuple[dict[str, str], list[str]]:
    """Return what is known of each cell besides its line in the table, by key, and the keys left out.

    All of it takes at most `room` characters: what does not fit is cut shorter, then left out.
    """
    many = len(rows) > MANY
    known = keys_of(rows)
    # Words before numbers: words are what rows share.
    ours = sorted((key for key in FORMAT if key in known), key=lambda key: (key in _LARGE, float in FORMAT[key]))
    fields: dict[str, str] = {}
    left_out = []
    for key in (*ours, *sorted(known.difference(FORMAT), key=str)):
        values = [row.get(key) for row in rows]
        if (many and key in _IN_THE_TABLE) or not any(
            value is not None and value not in ("", [], {}) for value in values
        ):
            continue
        types = set(map(type, values))
        if many and key == "key":
            values = [str(value or "")[:KEY_DIGITS] for value in values]
        elif many and float in types and types <= {float, int, type(None)}:
            values = rounded(values)
        for longest in () if many and key in _LARGE else _LENGTHS if str in types else _LENGTHS[:1]:
            text = deflated(column(plain_values(values, longest)))
            if len(text) <= room:
                fields[key] = text
                room -= len(text)
                break
        else:
            left_out.append(key)
    return fields, left_out


def plain_values(values: Sequence[Any], longest: int = LONGEST) -> list[Any]:
    """Return values as `plain` does; what rows share is looked at once and stays shared."""
    known = {id(value): plain(value, longest) for value in {id(value): value for value in values}.values()}
    return [known[id(value)] for value in values]


def plain(value: Any, longest: int = LONGEST, depth: int = 0) -> Any:
    """Return a value that JSON and a browser's numbers hold: others become text; what is long or deep is cut."""
    if isinstance(value, str):
        return cut_start(value, longest)
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        return value if abs(value) < 2**53 else str(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if depth >= DEEPEST:
        return "[cut: too deep]"
    if isinstance(value, Mapping):
        return {str(name): plain(one, longest, depth + 1) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one, longest, depth + 1) for one in value]
    return cut_start(str(value), longest)


def cut_start(text: str, longest: int) -> str:
    """Return the end of a text that is too long, with a remark: a traceback says at its end what happened."""
    return text if len(text) <= longest else f"[cut: the last {longest} of {len(text)} characters] {text[-longest:]}"
