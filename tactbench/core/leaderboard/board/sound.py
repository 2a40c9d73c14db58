"""Rows that a page can be made of, whatever was handed in: what is odd is set right in a copy, and told.

A row that a run has written is always sound. One from elsewhere may lack keys, hold text where a number belongs, or say
``done`` with a score that is no number; such a row stays a row of the page, and says what is wrong with it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.board.words import tame, tame_text
from tactbench.core.leaderboard.records import JSON_KEYS
from tactbench.core.leaderboard.sheet import Sheet, columns_of
from tactbench.core.leaderboard.table import Table, build_table
from tactbench.core.spec.row import FORMAT, Held

Row = Mapping[str, Any]

LONGEST_NAME = 300
"""Characters of a name: longer ones are cut."""
_NAMES = frozenset(
    {"cell", "sensor", "task", "rig", "protocol", "split", "estimator", "status", "metric", "unit", "host"}
)
_NEEDED = frozenset({*JSON_KEYS, "traceback", "log", "plan"})
"""Keys that a page cannot do without."""
_FALLBACK = {"repeat": 1, "repeats": 1}


def sound(rows: Sequence[Any]) -> tuple[Sheet, tuple[str, ...]]:
    """Return the rows with what is odd set right, and a sentence on what that was; none if nothing was."""
    kept: list[Row] = sorted((row for row in rows if isinstance(row, Mapping)), key=_name)
    told = [f"{len(rows) - len(kept)} entries are no rows and are left out."] if len(kept) < len(rows) else []
    odd: Counter[str] = Counter()
    columns, everywhere = columns_of(kept)
    sheet = Sheet(kept, columns)
    copies: dict[int, dict[str, Any]] = {}
    for key, held in FORMAT.items():
        if not kept or (key not in columns and key not in _NEEDED):
            continue
        places = _odd_places(sheet, key, held, key in everywhere)
        for place in places:
            if place not in copies:
                copies[place] = dict(kept[place])
            copies[place][key] = _mended(kept[place], key, held)
        if places:
            odd[key] = len(places)
    if copies:
        sheet = Sheet.by_name([copies.get(place, row) for place, row in enumerate(kept)])
    if kept:
        sheet = _with_scores(sheet, odd)
    if odd:
        listed = ", ".join(f"{key} ({count} rows)" for key, count in odd.items())
        told.append(f"Not as a run writes them, set right or left out here: {listed}.")
    return sheet, tuple(told)


def _name(row: Row) -> str:
    name = row.get("cell")
    return name if type(name) is str else ""


def _with_scores(sheet: Sheet, odd: Counter[str]) -> Sheet:
    """Let rows that say done and have no score say failed."""
    ends = zip(sheet["status"], sheet["score"], strict=True)
    places = [place for place, (status, score) in enumerate(ends) if status == "done" and score is None]
    if not places:
        return sheet
    odd["score of a cell that is done"] = len(places)
    rows = list(sheet.rows)
    for place in places:
        rows[place] = {**rows[place], "status": "failed", "reason": "This row says done and holds no finite score."}
    return Sheet(rows)


def _odd_places(sheet: Sheet, key: str, held: Held, everywhere: bool) -> list[int]:
    """Return the places of rows that lack `key` (none does if it is `everywhere`), or hold what does not belong."""
    kinds = _kinds(held)
    if everywhere:
        types = sheet.types(key)
        if types <= kinds and not _limited(sheet[key], key, types):
            return []
    return [place for place, row in enumerate(sheet.rows) if key not in row or not _fits(row[key], key, kinds)]


def _kinds(held: Held) -> frozenset[type]:
    return held.types | {tuple} if list in held.types else held.types


def _limited(values: Sequence[Any], key: str, types: Collection[type]) -> bool:
    """Tell whether some value of the right type may still be odd."""
    if key in _NAMES:
        return any(value is not None and len(value) > LONGEST_NAME for value in set(values))
    if float in types:
        return not math.isfinite(sum(filter(None, values)))
    if key in ("counts", "chosen", "stamps", "remarks"):
        return not all(
            _fits(value, key, types) for value in {id(value): value for value in filter(None, values)}.values()
        )
    return False


def _fits(value: Any, key: str, kinds: Collection[type]) -> bool:
    if type(value) not in kinds:
        return False
    if key in _NAMES:
        return value is None or len(value) <= LONGEST_NAME
    if type(value) is float:
        return math.isfinite(value)
    if key in ("counts", "chosen"):
        return all(type(name) is str and _finite(one) is not None for name, one in value.items())
    if key in ("stamps", "remarks"):
        return all(type(one) is str for one in value)
    return True


def _mended(row: Row, key: str, held: Held) -> Any:
    if key not in row:
        return _plain(None, key, held)
    value = row[key]
    if key in ("counts", "chosen") and type(value) is dict:
        return {name: one for name, one in value.items() if type(name) is str and _finite(one) is not None}
    if key in ("stamps", "remarks") and type(value) in _kinds(held):
        return [one if type(one) is str else tame_text(tame(one)) for one in value]
    mended = _plain(value, key, held)
    if key in _NAMES and mended is not None and len(mended) > LONGEST_NAME:
        return f"{mended[:LONGEST_NAME]}… [cut: {len(mended)} characters]"
    return mended


def _plain(value: Any, key: str, held: Held) -> Any:
    """Return what stands for a value that does not belong there."""
    if bool in held.types:
        return value is True
    if float in held.types:
        return _finite(value)
    if int in held.types:
        found = _whole(value)
        return _FALLBACK.get(key) if found is None else found
    if value is None and type(None) in held.types:
        return None
    if str in held.types:
        return "" if value is None else tame_text(value)
    return None if type(None) in held.types else {} if dict in held.types else []


def _finite(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return value if math.isfinite(value) else None
    except OverflowError:  # a whole number beyond any float
        return None


def _whole(value: Any) -> int | None:
    found = _finite(value)
    return int(found) if found is not None and found == int(found) else None


def table_of(sheet: Sheet, provenance: Sequence[Row]) -> Table:
    """Return the table of rows; a row that no table can be made of says so in its place."""
    known = [entry for entry in provenance if isinstance(entry, Mapping)]
    try:
        return build_table(sheet, known)
    except Exception:
        return build_table([_alone(row) for row in sheet.rows], known)


def _alone(row: Row) -> Row:
    """Return a row that a table can be made of: this one, or one that says why not."""
    try:
        build_table([row])
    except Exception as error:
        plain = {key: _plain(None, key, held) for key, held in FORMAT.items()}
        kept = {key: row[key] for key in ("cell", "sensor", "task", "rig", "protocol", "estimator", "metric", "unit")}
        reason = f"This row cannot be shown: {type(error).__name__}: {error}"
        return {**plain, **kept, "status": "failed", "reason": reason}
    return row
