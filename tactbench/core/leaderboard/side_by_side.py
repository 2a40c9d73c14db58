"""The same question asked in several ways, side by side: protocols, splits, or the folds of one split."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
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
    tables = (_comparison(members, by) for members in groups.values())
    return [table for table in tables if len(table.columns) > 3]


def _comparison(members: Sequence[Row], by: str) -> TextTable:
    first = {row["sensor"]: row["estimator"] for row in reversed(members) if row["is_baseline"]}
    shown = [row for row in members if not row["is_baseline"] or first[row["sensor"]] == row["estimator"]]
    lines = grouped(sorted(shown, key=lambda row: row["is_baseline"]), lambda row: (sensor_name(row), answer_name(row)))
    records = {names: _records(same, by) for names, same in lines.items()}
    ways = list(dict.fromkeys(way for found in records.values() for way in found if way != "None"))
    if by == "fold":
        ways.sort(key=_numbers_first)
    else:
        for names, same in lines.items():
            _add_differences(records[names], {str(row[by]): row for row in same}, ways[:1])
    cells = {
        names: {str(row[by]) if by != "fold" else "": row["cell"] for row in same} for names, same in lines.items()
    }
    return TextTable(
        title=_title(members[0], by),
        columns=("sensor", "estimator", *ways),
        numeric=frozenset(ways),
        lines=tuple(
            (*names, *(_entry(found.get(way), cells[names].get(way, cells[names].get("", ""))) for way in ways))
            for names, found in records.items()
        ),
        notes=() if by == "fold" else (_NOTE,),
        records=tuple(found[way] for found in records.values() for way in ways if way in found),
    )


def _records(rows: Sequence[Row], by: str) -> dict[str, dict[str, Any]]:
    """Return the records of one answer by the way it was asked; of its folds all scores, by their names."""
    found = {}
    for row in rows:
        scores = {str(row[by]): row["score"]} if by != "fold" else _folds(row)
        for way, value in scores.items():
            found[way] = {
                "task": row["task"], "sensor": row["sensor"], "estimator": answer_name(row),
                **{key: row[key] for key in ("simulated", "is_baseline", "protocol", "split", "repeat")},
                "compared": by, "way": way, **{key: row[key] for key in ("status", "metric", "unit")}, "score": value,
                **{end: None if by == "fold" else row[end] for end in ("ci_low", "ci_high")},
                **dict.fromkeys(("difference", "difference_low", "difference_high")),
            }  # fmt: skip
    return found


def _folds(row: Row) -> dict[str, float]:
    start = f"{row['split']} "
    folds = {key.removeprefix("fold "): value for key, value in row["scores"].items() if key.startswith("fold ")}
    return {name.removeprefix(start): value for name, value in folds.items()}


def _add_differences(records: dict[str, dict[str, Any]], rows: dict[str, Row], first: Sequence[str]) -> None:
    """Write beside each score how it differs from that of the first way."""
    from tactbench.core.statistics.paired import difference  # numerics, for who compares

    start = next((records[way] for way in first if way in records), None)
    for way, record in records.items():
        if start is None or record is start or start["score"] is None or record["score"] is None:
            continue
        record["difference"] = record["score"] - start["score"]
        found = difference(rows[way], rows[start["way"]])
        if found.paired:
            record["difference_low"], record["difference_high"] = found.low, found.high


def _numbers_first(name: str) -> tuple[bool, float]:
    number = re.match(r"[-+]?\d+(\.\d+)?", name)
    return (False, float(number[0])) if number else (True, 0.0)


def _title(row: Row, by: str) -> str:
    protocol = [] if by == "protocol" else [row["protocol"]]
    split = [f"split {row['split']}"] if by != "split" and row["split"] else []
    return " · ".join([str(row["task"]), metric_name(row), *protocol, *split, hardware_name(row), f"by {by}"])


def _entry(record: dict[str, Any] | None, cell: str) -> Entry:
    if record is None:
        return Entry(ABSENT)
    unit = record["unit"]
    if record["score"] is None:
        return Entry(str(record["status"]).upper(), cell=cell)
    text = score(record["score"], unit)
    if record["difference"] is not None:
        text += f" ({signed(record['difference'], unit)})"
    if record["ci_low"] is not None:
        text += f"\n{interval(record['ci_low'], record['ci_high'], unit)}"
    if record["difference_low"] is not None:
        text += f"\nΔ {interval(record['difference_low'], record['difference_high'], unit)}"
    return Entry(text, finite(record["score"]), cell=cell)
