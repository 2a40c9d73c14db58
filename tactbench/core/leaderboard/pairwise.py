"""Comparison of two sensors, estimators, protocols, splits or result folders, cell by cell."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Literal

from tactbench.core.errors import UnknownNameError
from tactbench.core.leaderboard.names import Row, answer_name, grouped, hardware_name, metric_name, split_name
from tactbench.core.statistics.paired import Difference, difference, holm
from tactbench.core.tables.text import ABSENT, Entry, TextTable, finite, score, signed, suffix, text_table, visible

Kind = Literal["sensors", "estimators", "protocols", "splits", "folders"]
Key = tuple[Any, ...]
COLUMNS = ("of", "A", "B", "A − B", "95 % interval", "p", "p Holm", "n", "verdict")
_NOTE = (
    "A − B is in the metric's unit; of campaigns it is the mean of their differences, while A and B are medians. "
    "p: of no difference at all, by exchanging A and B within replicates; p Holm: corrected for all "
    "pairs of this comparison. n counts replicates."
)
_NAMES: dict[Kind, Callable[[Row], str]] = {
    "sensors": lambda row: str(row["sensor"]),
    "estimators": answer_name,
    "protocols": lambda row: str(row["protocol"]),
    "splits": lambda row: str(row["split"]),
}


@dataclass(frozen=True)
class PairwiseComparison:
    """Comparison of two cells that differ in one respect, or the reason why they cannot be compared."""

    kind: Kind
    first: str
    """Name of the first of the compared sensors, estimators, protocols, splits or folders."""
    second: str
    first_row: Row | None
    second_row: Row | None
    refused: str = ""
    """Reason why the cells are not compared; empty if they are."""
    difference: Difference | None = None
    p_corrected: float | None = None
    """p-value corrected for all pairs of cells that were compared at once."""

    @property
    def row(self) -> Row:
        """One of the two rows, for values that are equal in both."""
        return next(row for row in (self.first_row, self.second_row) if row is not None)

    @property
    def of(self) -> str:
        """Name that both rows share: the estimator of two sensors, the sensor of two estimators, else both names."""
        return str(_key(self.kind, self.row)[-1])


def comparisons(rows: Sequence[Row], first: str, second: str, task: str | None = None) -> list[PairwiseComparison]:
    """Compare the cells of one leaderboard that differ only in two sensors, estimators, protocols or splits.

    Raises
    ------
    UnknownNameError
        If `rows` lack the task or one of the names, or the two names are of different kinds.
    """
    rows = _in_task(rows, task)
    known = {kind: grouped(rows if kind == "estimators" else _answers(rows), name) for kind, name in _NAMES.items()}
    for kind, named in known.items():
        if first in named and second in named:
            return _compared(kind, first, second, named[first], named[second])
    for kind, named in known.items():
        if first in named:
            raise UnknownNameError(f"{kind[:-1]} in these results", second, named)
    raise UnknownNameError("sensor, estimator, protocol or split in these results", first, chain(*known.values()))


def folder_comparisons(
    first_rows: Iterable[Row], second_rows: Iterable[Row], first: str, second: str, task: str | None = None
) -> list[PairwiseComparison]:
    """Compare equal cells of two result folders; raises UnknownNameError if a folder has no results of `task`."""
    return _compared("folders", first, second, *(_answers(_in_task(rows, task)) for rows in (first_rows, second_rows)))


def _answers(rows: Iterable[Row]) -> list[Row]:
    return [row for row in rows if not row["is_baseline"]]


def _in_task(rows: Iterable[Row], task: str | None) -> list[Row]:
    if task is None:
        return list(rows)
    tasks = grouped(rows, lambda row: str(row["task"]))
    if task not in tasks:
        raise UnknownNameError("task in these results", task, tasks)
    return tasks[task]


def _compared(
    kind: Kind, first: str, second: str, first_rows: Iterable[Row], second_rows: Iterable[Row]
) -> list[PairwiseComparison]:
    ones, others = ({_key(kind, row): row for row in rows} for rows in (first_rows, second_rows))
    keys = dict.fromkeys([*ones, *others])
    pairs = [_pair(kind, first, second, ones.get(key), others.get(key)) for key in keys]
    corrected = holm([pair.difference.p if pair.difference else None for pair in pairs])
    return [replace(pair, p_corrected=p) for pair, p in zip(pairs, corrected, strict=True)]


def _pair(kind: Kind, first: str, second: str, one: Row | None, other: Row | None) -> PairwiseComparison:
    refused = ""
    for name, row in ((first, one), (second, other)):
        if row is None:
            refused = f"{name} has no such cell on this rig, protocol and split"
        elif row["status"] != "done":
            refused = f"{name} {row['status']}: {row['reason']}"
    if one and other and (one["metric"], len(one["classes"])) != (other["metric"], len(other["classes"])):
        refused = refused or "the two cells were scored by different metrics or classes"
    found = difference(one, other) if one and other and not refused else None
    return PairwiseComparison(kind, first, second, one, other, refused, found)


def _key(kind: Kind, row: Row) -> Key:
    """Return the values that two compared rows share: hardware, protocol, split, task, and sensor or estimator."""
    sensor, answer = str(row["sensor"]), answer_name(row)
    of = {"sensors": answer, "estimators": sensor}.get(kind, f"{sensor}, {answer}")
    protocol = "" if kind == "protocols" else row["protocol"]
    split = "" if kind == "splits" else row["split"]
    return (hardware_name(row), protocol, split, row["task"], of)


def tables_of(comparisons: Sequence[PairwiseComparison]) -> list[TextTable]:
    """Return one table for each combination of task, metric, protocol, split and hardware; the last has the notes."""
    tables = [
        text_table(title, COLUMNS, map(_line, pairs), numeric=COLUMNS[1:-1])
        for title, pairs in grouped(comparisons, _title).items()
    ]
    return [*tables[:-1], *(replace(one, notes=notes_of(comparisons)) for one in tables[-1:])]


def _title(pair: PairwiseComparison) -> str:
    row = pair.row
    names = f"A = {pair.first}, B = {pair.second}"
    protocol = f"{row['protocol']}{' †' if row['dagger'] else ''}" if pair.kind != "protocols" else ""
    split = split_name(row["split"]) if row["split"] and pair.kind != "splits" else ""
    data = visible(row.get("data") or "")
    parts = (data, names, row["task"], metric_name(row), protocol, split, hardware_name(row))
    return " · ".join(filter(None, parts))


def _line(pair: PairwiseComparison) -> tuple[str, ...]:
    unit, found = pair.row["unit"], pair.difference
    scores = [
        Entry(score(row["score"], unit), finite(row["score"]), cell=row["cell"]) if row else ABSENT
        for row in (pair.first_row, pair.second_row)
    ]
    if found is None:
        return (pair.of, *scores, *(ABSENT for _ in COLUMNS[4:]), f"not compared: {pair.refused}")
    verdict = {"better": f"{pair.first} better", "worse": f"{pair.second} better"}.get(found.verdict, found.verdict)
    return (
        pair.of,
        *scores,
        signed(found.value, unit),
        " … ".join(signed(end, unit) for end in (found.low, found.high) if end is not None) or ABSENT,
        _probability(found.p),
        _probability(pair.p_corrected),
        f"{found.replicates}{'' if found.paired else ' unpaired'}" if found.replicates else ABSENT,
        verdict,
    )


def _probability(p: float | None) -> str:
    """Return a p-value as text with two significant digits."""
    return ABSENT if p is None else "< 0.001" if p < 0.001 else f"{p:.2g}"


def notes_of(comparisons: Sequence[PairwiseComparison]) -> tuple[str, ...]:
    """Return notes that explain the columns and the statistical methods of the tables."""
    notes = []
    for pair in comparisons:
        if pair.difference is not None:
            region, unit = pair.row["equivalence"], suffix(pair.row["unit"])
            same = f"; scores within {region:g}{unit} count as equal" if region else ""
            notes.append(f"{pair.row['task']}: {pair.difference.method}{same}.")
    return tuple(dict.fromkeys([_NOTE, *notes])) if notes else ()


def record_of(pair: PairwiseComparison) -> dict[str, Any]:
    """Return a comparison as a flat record; all records have the same keys."""
    row = pair.row
    found: Mapping[str, Any] = {} if pair.difference is None else vars(pair.difference)
    shared = ("task", "rig", "simulated", "protocol", "split", "metric", "unit")
    return {
        "compared": pair.kind, "a": pair.first, "b": pair.second, "of": pair.of, **{key: row[key] for key in shared},
        "score_a": pair.first_row and pair.first_row["score"], "score_b": pair.second_row and pair.second_row["score"],
        "difference": found.get("value"), **{key: found.get(key) for key in ("low", "high", "p", "smallest_p")},
        "p_holm": pair.p_corrected, **{key: found.get(key) for key in ("verdict", "paired", "replicates")},
        "method": found.get("method"), "equivalence": row.get("equivalence"), "replicate_unit": found.get("unit"),
        "refused": pair.refused,
    }  # fmt: skip
