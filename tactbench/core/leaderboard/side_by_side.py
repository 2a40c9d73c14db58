"""The same question asked in several ways, side by side: protocols, splits, or the folds of one split."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.names import Row, answer_name, grouped, hardware_name, metric_name, sensor_name
from tactbench.core.tables.numbers import ABSENT, interval, score, signed
from tactbench.core.tables.text_table import Entry, TextTable, finite

_NOTE = (
    "Differences are against the first column; intervals are those of each score alone, and two that overlap may still "
    "differ. Δ is the interval of the difference, where both were tested on the same replicates."
)


def compare(rows: Iterable[Row], by: str) -> list[TextTable]:
    """Return a table for each task (and whatever else must not be mixed) that was asked in several ways of `AXES`."""
    alike = ("task", "repeat", *(key for key in ("protocol", "split") if key != by))
    groups = grouped(rows, lambda row: (hardware_name(row), *(row[key] for key in alike)))
    found = []
    for members in groups.values():
        shown = _worth_showing(members)
        ways = list(dict.fromkeys(way for row in shown for way in _scores(row, by) if way != "None"))
        if by == "fold":
            ways.sort(key=_numbers_first)
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


def _scores(row: Row, by: str) -> dict[str, float | None]:
    """Return the score of a row by the way it was asked; of its folds all scores, by their names."""
    if by != "fold":
        return {str(row[by]): row["score"]}
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

    lines: dict[tuple[str, str], dict[str, tuple[Row, dict[str, Any]]]] = {}
    for row in members:
        cells = lines.setdefault((sensor_name(row), answer_name(row)), {})
        cells |= {way: (row, _record(row, by, way, value)) for way, value in _scores(row, by).items()}
    for cells in lines.values():
        if by == "fold" or ways[0] not in cells:
            continue
        first, start = cells[ways[0]]
        for row, record in cells.values():
            if record is start or start["score"] is None or record["score"] is None:
                continue
            record["difference"] = record["score"] - start["score"]
            found = difference(row, first)
            if found.paired:
                record["difference_low"], record["difference_high"] = found.low, found.high
    return TextTable(
        title=_title(members[0], by),
        columns=("sensor", "estimator", *ways),
        numeric=frozenset(ways),
        lines=tuple(
            (*names, *(_entry(*cells[way]) if way in cells else Entry(ABSENT) for way in ways))
            for names, cells in lines.items()
        ),
        notes=() if by == "fold" else (_NOTE,),
        records=tuple(cells[way][1] for cells in lines.values() for way in ways if way in cells),
    )


def _record(row: Row, by: str, way: str, value: float | None) -> dict[str, Any]:
    ends = ("ci_low", "ci_high")
    return {
        **{key: row[key] for key in ("task", "sensor")},
        "estimator": answer_name(row),
        **{key: row[key] for key in ("simulated", "is_baseline", "protocol", "split", "repeat")},
        "compared": by,
        "way": way,
        **{key: row[key] for key in ("status", "metric", "unit")},
        "score": value,
        **(dict.fromkeys(ends) if by == "fold" else {end: row[end] for end in ends}),
        **dict.fromkeys(("difference", "difference_low", "difference_high")),
    }


def _title(row: Row, by: str) -> str:
    protocol = [] if by == "protocol" else [row["protocol"]]
    split = [f"split {row['split']}"] if by != "split" and row["split"] else []
    return " · ".join([str(row["task"]), metric_name(row), *protocol, *split, hardware_name(row), f"by {by}"])


def _entry(row: Row, record: Mapping[str, Any]) -> Entry:
    unit = record["unit"]
    if record["score"] is None:
        return Entry(str(record["status"]).upper(), cell=str(row["cell"]))
    text = score(record["score"], unit)
    if record["difference"] is not None:
        text += f" ({signed(record['difference'], unit)})"
    if record["ci_low"] is not None:
        text += f"\n{interval(record['ci_low'], record['ci_high'], unit)}"
    if record["difference_low"] is not None:
        text += f"\nΔ {interval(record['difference_low'], record['difference_high'], unit)}"
    return Entry(text, finite(record["score"]), cell=str(row["cell"]))
