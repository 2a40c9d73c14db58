"""The same question asked in several ways, side by side: protocols, splits, or the folds of one split."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.names import answer_name, hardware_name, metric_name, sensor_name
from tactbench.core.tables.numbers import interval, score
from tactbench.core.tables.text_table import TextTable

Row = Mapping[str, Any]

_NOTE = (
    "Differences are against the first column; intervals are those of each score alone, and two that overlap may still "
    "differ. Δ is the interval of the difference, where both were tested on the same replicates."
)


def compare(rows: Iterable[Row], by: str) -> list[TextTable]:
    """Return a table for each task (and whatever else must not be mixed) that was asked in several ways.

    Parameters
    ----------
    rows
        Rows of a leaderboard.
    by
        One of `tactbench.core.leaderboard.axes.AXES`.
    """
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        if by == "fold":
            groups.setdefault((*_key(row), row["protocol"], row["split"]), []).append(row)
        else:
            groups.setdefault((*_key(row), row["split" if by == "protocol" else "protocol"]), []).append(row)
    found = []
    for members in groups.values():
        shown = _worth_showing(members)
        ways = (
            _folds(shown) if by == "fold" else list(dict.fromkeys(str(row[by]) for row in shown if row[by] is not None))
        )
        if len(ways) > 1:
            found.append(_comparison(shown, by, ways))
    return found


def _key(row: Row) -> tuple[Any, ...]:
    return row["task"], hardware_name(row), row["repeat"]


def _worth_showing(members: Sequence[Row]) -> list[Row]:
    """Return the results, and of the baselines each sensor's first."""
    first: dict[str, str] = {}
    for row in members:
        if row["is_baseline"]:
            first.setdefault(row["sensor"], row["estimator"])
    kept = [row for row in members if not row["is_baseline"] or first[row["sensor"]] == row["estimator"]]
    return sorted(kept, key=lambda row: row["is_baseline"])


def _folds(members: Sequence[Row]) -> list[str]:
    """Return the names of the folds, those that begin with a number in its order."""
    names = dict.fromkeys(_fold(key, row) for row in members for key in row["scores"] if key.startswith("fold "))
    return sorted(names, key=_numbers_first)


def _fold(key: str, row: Row) -> str:
    return key.removeprefix("fold ").removeprefix(f"{row['split']} ")


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
    for row in members:
        by_way[sensor_name(row), answer_name(row), str(row.get(by))] = row
        cells = lines.setdefault((sensor_name(row), answer_name(row)), {})
        if by == "fold":
            cells |= {way: _record(row, by, way, value) for way, value in _scores_of_folds(row)}
        else:
            cells[str(row[by])] = _record(row, by, str(row[by]), row["score"])
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
            (*names, *(_text(cells.get(way), first["unit"]) for way in ways)) for names, cells in lines.items()
        ),
        notes=() if by == "fold" else (_NOTE,),
        records=tuple(cells[way] for cells in lines.values() for way in ways if way in cells),
    )


def _scores_of_folds(row: Row) -> Iterable[tuple[str, float]]:
    return ((_fold(key, row), value) for key, value in row["scores"].items() if key.startswith("fold "))


def _record(row: Row, by: str, way: str, value: float | None) -> dict[str, Any]:
    whole = by != "fold"
    return {
        "task": row["task"],
        "sensor": row["sensor"],
        "estimator": answer_name(row),
        "simulated": row["simulated"],
        "is_baseline": row["is_baseline"],
        "protocol": row["protocol"],
        "split": row["split"],
        "repeat": row["repeat"],
        "compared": by,
        "way": way,
        "status": row["status"],
        "metric": row["metric"],
        "unit": row["unit"],
        "score": value,
        "ci_low": row["ci_low"] if whole else None,
        "ci_high": row["ci_high"] if whole else None,
        "difference": None,
        "difference_low": None,
        "difference_high": None,
    }


def _title(row: Row, by: str) -> str:
    parts = [str(row["task"]), metric_name(row)]
    if by != "protocol":
        parts.append(row["protocol"])
    if by != "split" and row["split"]:
        parts.append(f"split {row['split']}")
    parts.append(hardware_name(row))
    return " · ".join([*parts, f"by {by}"])


def _text(record: Mapping[str, Any] | None, unit: str) -> str:
    if record is None:
        return "–"
    if record["score"] is None:
        return str(record["status"]).upper()
    value = score(record["score"], unit)
    if record["difference"] is not None:
        sign = "+" if record["difference"] >= 0 else "−"
        value += f" ({sign}{score(abs(record['difference']), unit)})"
    if record["ci_low"] is not None:
        value += f"\n{interval(record['ci_low'], record['ci_high'], unit)}"
    if record["difference_low"] is not None:
        value += f"\nΔ {interval(record['difference_low'], record['difference_high'], unit)}"
    return value
