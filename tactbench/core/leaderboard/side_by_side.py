"""The same question asked in several ways, side by side: protocols, splits, or the folds of one split."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.names import answer_name, hardware_name, metric_name, sensor_name
from tactbench.core.tables.numbers import ABSENT, interval, score, signed
from tactbench.core.tables.text_table import Entry, TextTable, finite

Row = Mapping[str, Any]

_NOTE = (
    "Differences are against the first column; intervals are those of each score alone, and two that overlap may still "
    "differ. Δ is the interval of the difference, where both were tested on the same replicates."
)


def compare(rows: Iterable[Row], by: str) -> list[TextTable]:
    """Return a table for each task (and whatever else must not be mixed) that was asked in several ways of `AXES`."""
    groups: dict[tuple[Any, ...], list[Row]] = {}
    alike = [key for key in ("protocol", "split") if key != by]
    for row in rows:
        key = (row["task"], hardware_name(row), row["repeat"], *(row[key] for key in alike))
        groups.setdefault(key, []).append(row)
    found = []
    for members in groups.values():
        shown = _worth_showing(members)
        if by == "fold":
            ways = sorted(dict.fromkeys(name for row in shown for name in _folds(row)), key=_numbers_first)
        else:
            ways = list(dict.fromkeys(str(row[by]) for row in shown if row[by] is not None))
        if len(ways) > 1:
            found.append(_comparison(shown, by, ways))
    return found


def _worth_showing(members: Sequence[Row]) -> list[Row]:
    """Return the results, and of the baselines each sensor's first."""
    first: dict[str, str] = {}
    for row in members:
        if row["is_baseline"]:
            first.setdefault(row["sensor"], row["estimator"])
    kept = [row for row in members if not row["is_baseline"] or first[row["sensor"]] == row["estimator"]]
    return sorted(kept, key=lambda row: row["is_baseline"])


def _folds(row: Row) -> dict[str, float]:
    """Return the scores of a row's folds by their names."""
    split = f"{row['split']} "
    return {
        key.removeprefix("fold ").removeprefix(split): value
        for key, value in row["scores"].items()
        if key.startswith("fold ")
    }


def _numbers_first(name: str) -> tuple[bool, float]:
    number = re.match(r"[-+]?[0-9.]+", name)
    try:
        return (False, float(number[0])) if number else (True, 0.0)
    except ValueError:
        return True, 0.0


def _comparison(members: Sequence[Row], by: str, ways: Sequence[str]) -> TextTable:
    from tactbench.core.statistics.paired import difference  # numerics, for who compares

    lines: dict[tuple[str, str], dict[str, dict[str, Any]]] = {}
    by_way: dict[tuple[str, str, str], Row] = {}
    cells_of: dict[tuple[str, str, str], str] = {}
    for row in members:
        names = sensor_name(row), answer_name(row)
        by_way[*names, str(row.get(by))] = row
        scores = _folds(row) if by == "fold" else {str(row[by]): row["score"]}
        lines.setdefault(names, {}).update({way: _record(row, by, way, value) for way, value in scores.items()})
        cells_of.update(dict.fromkeys(((*names, way) for way in scores), str(row["cell"])))
    for names, cells in lines.items():
        start = cells.get(ways[0], {}).get("score")
        for way, record in cells.items():
            if way != ways[0] and by != "fold" and start is not None and record["score"] is not None:
                record["difference"] = record["score"] - start
                found = difference(by_way[(*names, way)], by_way[(*names, ways[0])])
                if found.paired:
                    record["difference_low"], record["difference_high"] = found.low, found.high
    first = members[0]
    return TextTable(
        title=_title(first, by),
        columns=("sensor", "estimator", *ways),
        numeric=frozenset(ways),
        lines=tuple(
            (*names, *(_entry(cells.get(way), cells_of.get((*names, way), "")) for way in ways))
            for names, cells in lines.items()
        ),
        notes=() if by == "fold" else (_NOTE,),
        records=tuple(cells[way] for cells in lines.values() for way in ways if way in cells),
    )


def _record(row: Row, by: str, way: str, value: float | None) -> dict[str, Any]:
    whole = by != "fold"
    return {
        **{key: row[key] for key in ("task", "sensor")},
        "estimator": answer_name(row),
        **{key: row[key] for key in ("simulated", "is_baseline", "protocol", "split", "repeat")},
        "compared": by,
        "way": way,
        **{key: row[key] for key in ("status", "metric", "unit")},
        "score": value,
        "ci_low": row["ci_low"] if whole else None,
        "ci_high": row["ci_high"] if whole else None,
        **dict.fromkeys(("difference", "difference_low", "difference_high")),
    }


def _title(row: Row, by: str) -> str:
    parts = [str(row["task"]), metric_name(row)]
    if by != "protocol":
        parts.append(row["protocol"])
    if by != "split" and row["split"]:
        parts.append(f"split {row['split']}")
    return " · ".join([*parts, hardware_name(row), f"by {by}"])


def _entry(record: Mapping[str, Any] | None, cell: str) -> Entry:
    return Entry(_text(record), finite(record["score"]), cell=cell) if record else Entry(ABSENT)


def _text(record: Mapping[str, Any]) -> str:
    if record["score"] is None:
        return str(record["status"]).upper()
    unit = record["unit"]
    text = score(record["score"], unit)
    if record["difference"] is not None:
        text += f" ({signed(record['difference'], unit)})"
    if record["ci_low"] is not None:
        text += f"\n{interval(record['ci_low'], record['ci_high'], unit)}"
    if record["difference_low"] is not None:
        text += f"\nΔ {interval(record['difference_low'], record['difference_high'], unit)}"
    return text
