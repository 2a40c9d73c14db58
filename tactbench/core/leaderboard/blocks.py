"""Rows that may be compared stand in one block; no rank spans two.

Rows under different tasks, protocols or splits, and rows from the twin and from hardware, are not comparable.
The order of blocks and lines depends on the rows alone, never on the order they come in.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.columns import Line, line_of
from tactbench.core.leaderboard.names import Row, distinct, grouped, hardware_name, metric_name, sign_of
from tactbench.core.leaderboard.verdict import verdict_of
from tactbench.core.statistics.rank import Rank, beyond_floor, excess_of
from tactbench.core.statistics.replicates import FEWEST
from tactbench.core.tables.text import visible

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
    finished = distinct((row["rig"], hardware_name(row)) for row in rows if row["status"] == "done")

    def without_split(row: Row) -> tuple[str, str, str]:
        known = finished.get(row["rig"], [])
        return row["task"], row["protocol"], known[0] if len(known) == 1 else hardware_name(row)

    splits = distinct((without_split(row), row["split"]) for row in rows if row["split"] is not None)

    def key(row: Row) -> _Key:
        task, protocol, hardware = without_split(row)
        known = splits.get((task, protocol, hardware), [])
        split = row["split"] if row["split"] is not None else known[0] if len(known) == 1 else ""
        return task, protocol, split, hardware

    return grouped(rows, key)


def _arranged(members: Sequence[Row]) -> tuple[list[tuple[Row, Rank | None]], str]:
    """Return the rows of a block in order with their places, and why places have no intervals, if so."""
    finished = [row for row in members if row["status"] == "done"]
    answers = [row for row in finished if not row["is_baseline"] and not no_better(row)]
    # What is equal stays in the order of the names.
    ordered = sorted(zip(errors(answers), answers, strict=True), key=lambda one: (one[0], _error(one[1])))
    found, unranked = places([row for _, row in ordered])
    # Of equal place stays the better one first.
    results = sorted(((row, found[row["cell"]]) for _, row in ordered), key=lambda one: one[1].place)
    unplaced = [
        *sorted((row for row in finished if not row["is_baseline"] and no_better(row)), key=_error),
        *sorted((row for row in finished if row["is_baseline"]), key=lambda row: (row["sensor"], _error(row))),
        *sorted((row for row in members if row["status"] != "done"), key=lambda row: row["status"]),
    ]
    return [*results, *((row, None) for row in unplaced)], unranked


def _error(row: Row) -> float:
    """Return a score as a number that is the lower the better; one that is no finite number is the worst."""
    return sign_of(row) * row["score"] if math.isfinite(row["score"]) else math.inf


def no_better(row: Row) -> bool:
    """Return whether an answer is no better than the trivial one and gets no place."""
    baseline = row.get("baseline")
    return baseline is not None and _error(row) >= sign_of(row) * baseline


def places(results: Sequence[Row]) -> tuple[dict[str, Rank], str]:
    """Return where each of `results` stands, by the name of its cell, and why there are no rank intervals, if so.

    They are the finished answers of one block, no baselines, the best score first. A row without replicates enters
    with its own interval.
    """
    if any(row.get("n_replicates") is not None and row["n_replicates"] < FEWEST for row in results):
        shared = Rank(1, None, None, len(results) > 1)
        return dict.fromkeys((row["cell"] for row in results), shared), f"fewer than {FEWEST} replicates carry them"
    if not results:
        return {}, ""
    if not any(row.get("replicates") for row in results):
        unranked = "rows keep no replicates"
    elif len(results) > MOST_RANKED:
        unranked = f"there are more than {MOST_RANKED} answers"
    elif not all(math.isfinite(row["score"]) for row in results):
        unranked = "a score is no finite number"
    else:
        from tactbench.core.statistics.ranking import ranks  # numerics

        try:
            return ranks(results), ""
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:
            # Rows of a stranger's folder: their replicates may be anything.
            unranked = f"their replicates cannot be used ({type(error).__name__})"
    ordered = errors(results)
    spans = [(bisect_left(ordered, error), bisect_right(ordered, error)) for error in ordered]
    by_score = [Rank(first + 1, None, None, after - first > 1) for first, after in spans]
    return dict(zip((row["cell"] for row in results), by_score, strict=True)), unranked


def errors(results: Sequence[Row]) -> list[float]:
    """Return what answers of one metric are ordered by, the lower the better.

    The score; of errors of force the mean square beyond the floor of the reference, if all of them have one. It may be
    below zero, where the error beyond the floor is 0: two answers of one sensor differ by more than its floor tells.
    """
    if beyond_floor(results):
        return [one if math.isfinite(one) else math.inf for one in map(excess_of, results)]
    return list(map(_error, results))


def _title(key: _Key, members: Sequence[Row]) -> str:
    task, protocol, split, hardware = key
    direction = "lower" if sign_of(members[0]) > 0 else "higher"
    dagger = " †" if any(row["dagger"] for row in members) else ""
    metric = f"{metric_name(members[0])}, {direction} is better"
    return visible(" · ".join([task, metric, f"{protocol}{dagger}", *([f"split {split}"] if split else []), hardware]))
