"""Two sensors, two estimators or two result folders, cell by cell: what may be compared, and what it shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from tactbench.core.errors import UnknownNameError
from tactbench.core.leaderboard.names import EMULATED, SIMULATED, answer_name, hardware_name
from tactbench.core.spec.matrix import ComparisonChoice
from tactbench.core.statistics.holm import holm
from tactbench.core.statistics.over_folds import FoldDifference, over_folds
from tactbench.core.statistics.paired import Difference, difference

Row = Mapping[str, Any]
Kind = Literal["sensors", "estimators", "folders"]
Key = tuple[Any, ...]


@dataclass(frozen=True)
class PairwiseComparison:
    """Two cells that ask the same question, or why they are not compared."""

    kind: Kind
    first: str
    """name of the first sensor, estimator or folder"""
    second: str
    of: str
    """what both have: the estimator of two sensors, the sensor of two estimators, both of two folders"""
    first_row: Row | None
    second_row: Row | None
    difference: Difference | None
    folds: FoldDifference | None
    """the same over folds whose training data overlap, where there are several"""
    refused: str
    """why there is no difference; empty if there is one"""
    declared: bool = False
    """the matrix says that it is run to compare these"""
    p_corrected: float | None = None
    """p corrected for all declared comparisons; None: exploratory"""

    @property
    def row(self) -> Row:
        """Return one of the rows, for what both have."""
        found = self.first_row if self.first_row is not None else self.second_row
        assert found is not None, "a comparison has one row at least"
        return found


def comparisons(rows: Sequence[Row], first: str, second: str, task: str | None = None) -> list[PairwiseComparison]:
    """Compare two sensors or two estimators of one leaderboard, wherever both have answered the same question.

    Raises
    ------
    UnknownNameError
        If these rows have no such task, no sensor and no estimator of such a name, or not both names are of one kind.
    """
    rows = _in_task(rows, task)
    sensors = list(dict.fromkeys(str(row["sensor"]) for row in rows))
    estimators = list(dict.fromkeys(answer_name(row) for row in rows))
    if first in sensors and second in sensors:
        chosen = [row for row in rows if not row["is_baseline"]]
        return _compared("sensors", first, second, *_of(chosen, lambda row: str(row["sensor"]), first, second))
    if first in estimators and second in estimators:
        return _compared("estimators", first, second, *_of(rows, answer_name, first, second))
    known = estimators if first in estimators else sensors if first in sensors else [*sensors, *estimators]
    wrong = second if first in (*sensors, *estimators) else first
    kind = "estimator" if known is estimators else "sensor" if known is sensors else "sensor or estimator"
    raise UnknownNameError(f"{kind} in these results", wrong, known)


def folder_comparisons(
    first_rows: Iterable[Row], second_rows: Iterable[Row], first: str, second: str, task: str | None = None
) -> list[PairwiseComparison]:
    """Compare the same cells of two result folders; raises UnknownNameError for a task that one has not."""
    one, other = ([row for row in _in_task(rows, task) if not row["is_baseline"]] for rows in (first_rows, second_rows))
    return _compared("folders", first, second, one, other)


def _in_task(rows: Iterable[Row], task: str | None) -> list[Row]:
    rows = list(rows)
    tasks = list(dict.fromkeys(str(row["task"]) for row in rows))
    if task is not None and task not in tasks:
        raise UnknownNameError("task in these results", task, tasks)
    return [row for row in rows if task is None or row["task"] == task]


def with_declared(
    found: Sequence[PairwiseComparison], rows: Sequence[Row], declared: Iterable[ComparisonChoice]
) -> list[PairwiseComparison]:
    """Return comparisons with p-values corrected for all comparisons that were declared, whichever of them are shown.

    Parameters
    ----------
    found
        What is shown.
    rows
        The whole leaderboard: the family of tests is every declared pair of cells in it.
    """
    family: dict[frozenset[str], float | None] = {}
    for choice in declared:
        for pair in _declared(rows, choice):
            if pair.difference is not None:
                family.setdefault(_cells(pair), pair.difference.p)
    corrected = dict(zip(family, holm(list(family.values())), strict=True))
    return [
        replace(pair, declared=_cells(pair) in corrected, p_corrected=corrected.get(_cells(pair)))
        if pair.kind != "folders" and pair.difference is not None
        else pair
        for pair in found
    ]


def _declared(rows: Sequence[Row], choice: ComparisonChoice) -> list[PairwiseComparison]:
    pair = choice.sensors or choice.estimators
    assert pair is not None, "a comparison is of two"
    try:
        found = comparisons(rows, *pair, choice.task)
    except UnknownNameError:
        return []  # this run had one of them only
    return [pair for pair in found if pair.kind == ("sensors" if choice.sensors else "estimators")]


def _cells(pair: PairwiseComparison) -> frozenset[str]:
    return frozenset(str(row["cell"]) for row in (pair.first_row, pair.second_row) if row is not None)


def _of(rows: Sequence[Row], name: Callable[[Row], str], first: str, second: str) -> tuple[list[Row], list[Row]]:
    return [row for row in rows if name(row) == first], [row for row in rows if name(row) == second]


def _compared(
    kind: Kind, first: str, second: str, first_rows: Sequence[Row], second_rows: Sequence[Row]
) -> list[PairwiseComparison]:
    keys = [{_key(kind, row): row for row in rows} for rows in (first_rows, second_rows)]
    found = []
    for key in dict.fromkeys([*keys[0], *keys[1]]):
        one, other = keys[0].get(key), keys[1].get(key)
        if one is None or other is None:
            missing, there = (first, other) if one is None else (second, one)
            assert there is not None, "the key is of one of the two"
            refused = _why_alone(kind, there, missing, keys[0] if one is None else keys[1])
        else:
            refused = _why_not(one, other, first, second)
        shown = one if one is not None else other
        assert shown is not None, "the key is of one of the two"
        result = difference(one, other) if one is not None and other is not None and not refused else None
        folds = over_folds([(one, other)]) if one is not None and other is not None and result is not None else None
        found.append(PairwiseComparison(kind, first, second, _common(kind, shown), one, other, result, folds, refused))
    return found


def _key(kind: Kind, row: Row) -> Key:
    """Return what two rows must have in common: hardware first, then protocol, then all else."""
    return (hardware_name(row), row["protocol"], row["split"], row["task"], row["repeat"], _common(kind, row))


def _common(kind: Kind, row: Row) -> str:
    if kind == "sensors":
        return answer_name(row)
    return str(row["sensor"]) if kind == "estimators" else f"{row['sensor']}, {answer_name(row)}"


def _why_alone(kind: Kind, row: Row, missing: str, others: Mapping[Key, Row]) -> str:
    """Return why `row` has nothing to stand against."""
    hardware, protocol, split, *rest = _key(kind, row)
    near = [key for key in others if list(key[3:]) == rest]
    elsewhere = {key[0] for key in near if key[1:3] == (protocol, split)} - {hardware}
    if any(name.startswith(EMULATED) for name in (*elsewhere, hardware)) and elsewhere:
        return "EMULATED is never compared with SIM or hardware"
    if any((name == SIMULATED) != (hardware == SIMULATED) for name in elsewhere):
        return "SIM is never compared with hardware"
    if any(key[:2] == (hardware, protocol) for key in near):
        return f"{missing} was asked with another split"
    if any(key[0] == hardware for key in near):
        return f"{missing} was asked under another protocol"
    return f"{missing} has no such cell"


def _why_not(one: Row, other: Row, first: str, second: str) -> str:
    for name, row in ((first, one), (second, other)):
        if row["status"] != "done":
            return f"{name} {row['status']}: {row['reason']}"
    if (one["metric"], list(one["classes"])) != (other["metric"], list(other["classes"])):
        return "they were scored by other metrics or classes"
    return ""
