"""Rows that may be compared stand in one block; no rank spans two.

Rows under different tasks, protocols or splits, and rows from the twin and from hardware, are not comparable.
The order of blocks and lines depends on the rows alone, never on the order they come in.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.columns import Line, line_of
from tactbench.core.leaderboard.names import hardware_name, metric_name, sign_of
from tactbench.core.leaderboard.verdict import verdict_of
from tactbench.core.statistics.excess import beyond_floor, excess_of
from tactbench.core.statistics.median import FEWEST
from tactbench.core.statistics.rank import Rank
from tactbench.core.tables.text import visible

Row = Mapping[str, Any]
_Key = tuple[str, str, str, str]
MOST_RANKED = 20_000
"""Answers of one block beyond which comparing all pairs takes too long."""


@dataclass(frozen=True)
class Block:
    """Rows that may be compared."""

    title: str
    lines: tuple[Line, ...]
    unranked: str = ""
    """Why there are no rank intervals; empty where there are."""
    verdict: tuple[str, ...] = ()
    """What its rows come to, in sentences."""


def blocks_of(
    rows: Sequence[Row], columns: Sequence[str], letters: Mapping[str, str], times: bool
) -> tuple[Block, ...]:
    """Arrange rows, in the order of their cells' names, into ranked blocks; verdicts name costs only with `times`."""
    blocks = []
    for key, members in sorted(_grouped(rows).items(), key=lambda group: _order(group[0])):
        arranged, unranked = _arranged(members)
        lines = tuple(line_of(row, placing, columns, letters) for row, placing in arranged)
        ranked = [(row, placing) for row, placing in arranged if placing is not None]
        below = sum(line.kind == "result" and line.placing is None for line in lines)
        trivial = [line.row for line in lines if line.kind == "baseline"]
        verdict = tuple(map(visible, verdict_of(ranked, below, trivial, times=times)))
        blocks.append(Block(_title(key, members), lines, unranked, verdict))
    return tuple(blocks)


def _order(key: _Key) -> tuple[Any, ...]:
    """Return what blocks are sorted by: within a task, what probes or is not kept apart comes after what is."""
    task, protocol, split, _ = key
    return task, split in ("shuffled", "in-session"), is_probe(protocol), key


def _grouped(rows: Sequence[Row]) -> dict[_Key, list[Row]]:
    """Group rows by what must not be mixed.

    A cell that was not begun knows neither its split, if nobody asked for one, nor whether it would have been
    simulated: it stands with the finished cells of its rig, if these agree.
    """
    kinds: dict[str, set[str]] = {}
    for row in rows:
        if row["status"] == "done":
            kinds.setdefault(row["rig"], set()).add(hardware_name(row))
    splits: dict[tuple[str, str, str], set[str]] = {}
    for row in rows:
        if row["split"] is not None:
            splits.setdefault(_without_split(row, kinds), set()).add(row["split"])
    groups: dict[_Key, list[Row]] = {}
    for row in rows:
        task, protocol, kind = _without_split(row, kinds)
        known = splits.get((task, protocol, kind), set())
        split = row["split"] if row["split"] is not None else next(iter(known)) if len(known) == 1 else ""
        groups.setdefault((task, protocol, split, kind), []).append(row)
    return groups


def _without_split(row: Row, kinds: Mapping[str, set[str]]) -> tuple[str, str, str]:
    known = kinds.get(row["rig"], set())
    kind = next(iter(known)) if row["status"] != "done" and len(known) == 1 else hardware_name(row)
    return row["task"], row["protocol"], kind


def _arranged(members: Sequence[Row]) -> tuple[list[tuple[Row, Rank | None]], str]:
    """Return the rows of a block in order with their places, and why places have no intervals, if so."""
    sign = sign_of(members[0])

    def error(row: Row) -> float:
        return sign * row["score"] if math.isfinite(row["score"]) else math.inf

    answers: list[Row] = []
    below: list[Row] = []
    for row in members:
        if row["status"] == "done" and not row["is_baseline"]:
            (below if no_better(error(row), sign, row.get("baseline")) else answers).append(row)
    # What is equal stays in the order of the names.
    ordered = sorted(zip(errors(answers), answers, strict=True), key=lambda one: (one[0], error(one[1])))
    found, unranked = places([row for _, row in ordered])
    # Of equal place stays the better one first.
    results = sorted(((row, found[row["cell"]]) for _, row in ordered), key=lambda one: one[1].place)
    baselines = [row for row in members if row["status"] == "done" and row["is_baseline"]]
    stopped = [row for row in members if row["status"] != "done"]
    unplaced = [
        *sorted(below, key=error),
        *sorted(baselines, key=lambda row: (row["sensor"], error(row))),
        *sorted(stopped, key=lambda row: row["status"]),
    ]
    return [*results, *((row, None) for row in unplaced)], unranked


def no_better(error: float, sign: float, baseline: float | None) -> bool:
    """Return whether an answer is no better than the trivial one and gets no place; its error is ``sign`` x score."""
    return baseline is not None and error >= sign * baseline


def places(results: Sequence[Row]) -> tuple[dict[str, Rank], str]:
    """Return where each of `results` stands, by the name of its cell, and why there are no rank intervals, if so.

    They are the finished answers of one block, no baselines, the best score first.
    """
    counts = [row.get("n_replicates") for row in results]
    if any(n is not None and n < FEWEST for n in counts):
        shared = Rank(1, None, None, len(results) > 1)
        return dict.fromkeys((row["cell"] for row in results), shared), f"fewer than {FEWEST} replicates carry them"
    reason = _unrankable(results)
    if not results or reason:
        return _by_score(results), reason
    from tactbench.core.statistics.ranking import ranks  # numerics

    try:
        return ranks(results), ""
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        # Rows of a stranger's folder: their replicates may be anything.
        return _by_score(results), f"their replicates cannot be used ({type(error).__name__})"


def errors(results: Sequence[Row]) -> list[float]:
    """Return what answers of one metric are ordered by, the lower the better.

    The score; of errors of force the mean square beyond the floor of the reference, if all of them have one. It may be
    below zero, where the error beyond the floor is 0: two answers of one sensor differ by more than its floor tells.
    """
    if beyond_floor(results):
        return [one if math.isfinite(one) else math.inf for one in map(excess_of, results)]
    return [sign_of(row) * row["score"] if math.isfinite(row["score"]) else math.inf for row in results]


def _unrankable(results: Sequence[Row]) -> str:
    """Return why places have no intervals, if they have none; a row without replicates enters with its own interval."""
    if not any(row.get("replicates") for row in results):
        return "rows keep no replicates" if results else ""
    if len(results) > MOST_RANKED:
        return f"there are more than {MOST_RANKED} answers"
    return "" if all(math.isfinite(row["score"]) for row in results) else "a score is no finite number"


def _by_score(results: Sequence[Row]) -> dict[str, Rank]:
    ordered = errors(results)
    many = Counter(ordered)
    first = {error: place for place, error in reversed(list(enumerate(ordered, 1)))}
    return {
        row["cell"]: Rank(first[error], None, None, many[error] > 1)
        for row, error in zip(results, ordered, strict=True)
    }


def _title(key: _Key, members: Sequence[Row]) -> str:
    _, protocol, split, kind = key
    first = members[0]
    direction = "lower" if sign_of(first) > 0 else "higher"
    dagger = " †" if any(row["dagger"] for row in members) else ""
    parts = [first["task"], f"{metric_name(first)}, {direction} is better", protocol + dagger]
    return visible(" · ".join([*parts, *([f"split {split}"] if split else []), kind]))
