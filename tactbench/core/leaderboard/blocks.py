"""Rows that may be compared stand in one block; no rank spans two.

Rows under different tasks, protocols or splits, and rows from the twin and from hardware, are not comparable.
The order of blocks and lines depends on the rows alone, never on the order they come in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.column_table import ColumnTable
from tactbench.core.leaderboard.lines import Line, RowTexts, row_texts
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, hardware_name, metric_name
from tactbench.core.leaderboard.placing import Placing, errors, places
from tactbench.core.leaderboard.text import visible
from tactbench.core.leaderboard.verdict import verdict_of

Row = Mapping[str, Any]
_Key = tuple[str, str, str, str]
_ORIGIN = ("task", "protocol", "rig", "simulated", "status", "split")
"""All that says in which block a row stands."""


@dataclass(frozen=True)
class Block:
    """Rows that may be compared."""

    title: str
    shown: RowTexts
    """All rows of the table."""
    places: tuple[int, ...]
    """Those of this block, in order."""
    unranked: str = ""
    """Why there are no rank intervals; empty where there are."""
    verdict: tuple[str, ...] = ()
    """What its rows come to, in sentences."""

    @cached_property
    def lines(self) -> tuple[Line, ...]:
        """Its lines, in order."""
        return tuple(map(self.shown.line, self.places))


def blocks_of(by_key: ColumnTable, letters: Mapping[str, str], times: bool) -> tuple[RowTexts, tuple[Block, ...]]:
    """Arrange rows into blocks, ranked.

    Parameters
    ----------
    by_key
        Rows in the order of their cells' names.
    letters
        The mark of each host.
    times
        Whether lines have times.

    Returns
    -------
    RowTexts, tuple of Block
        All rows as text, and which of them stand together.
    """
    groups = _grouped(by_key)
    placings: list[Placing | None] = [None] * len(by_key.rows)
    arranged = [(key, *_arranged(by_key, groups[key], placings)) for key in sorted(groups, key=_order)]
    shown = row_texts(by_key, placings, letters, times)
    blocks = [
        Block(
            _title(key, [by_key.rows[place] for place in groups[key]]),
            shown,
            members,
            unranked,
            _verdict(by_key, members, placings, times),
        )
        for key, members, unranked in arranged
    ]
    return shown, tuple(blocks)


def _verdict(
    by_key: ColumnTable, members: Sequence[int], placings: Sequence[Placing | None], times: bool
) -> tuple[str, ...]:
    ranked = [(by_key.rows[place], placing) for place in members if (placing := placings[place]) is not None]
    status, trivial = by_key["status"], by_key["is_baseline"]
    below = sum(status[place] == "done" and not trivial[place] and placings[place] is None for place in members)
    baselines = [by_key.rows[place] for place in members if status[place] == "done" and trivial[place]]
    return tuple(map(visible, verdict_of(ranked, below, baselines, times=times)))


def _order(key: _Key) -> tuple[Any, ...]:
    """Return what blocks are sorted by: within a task, what probes or is not kept apart comes after what is."""
    task, protocol, split, _ = key
    return task, split in ("shuffled", "in-session"), is_probe(protocol), key


def _grouped(by_key: ColumnTable) -> dict[_Key, list[int]]:
    """Group the places of rows by what must not be mixed.

    A cell that was not begun knows neither its split, if nobody asked for one, nor whether it would have been
    simulated: it stands with the finished cells of its rig, if these agree.
    """
    origins = list(zip(*(by_key[key] for key in _ORIGIN), strict=True))
    alike = dict(zip(origins, by_key.rows, strict=True))  # one row of each origin: the others are asked nothing
    kinds: dict[str, set[str]] = {}
    splits: dict[tuple[Any, ...], set[str]] = {}
    for row in alike.values():
        if row["status"] == "done":
            kinds.setdefault(row["rig"], set()).add(hardware_name(row))
    for row in alike.values():
        if row["split"] is not None:
            splits.setdefault(_without_split(row, kinds), set()).add(row["split"])
    keys = {origin: _key(row, kinds, splits) for origin, row in alike.items()}
    groups: dict[_Key, list[int]] = {}
    for place, origin in enumerate(origins):
        groups.setdefault(keys[origin], []).append(place)
    return groups


def _key(row: Row, kinds: Mapping[str, set[str]], splits: Mapping[tuple[Any, ...], set[str]]) -> _Key:
    task, protocol, kind = _without_split(row, kinds)
    known = splits.get((task, protocol, kind), set())
    split = row["split"] if row["split"] is not None else next(iter(known)) if len(known) == 1 else ""
    return task, protocol, split, kind


def _without_split(row: Row, kinds: Mapping[str, set[str]]) -> tuple[str, str, str]:
    known = kinds.get(row["rig"], set())
    kind = next(iter(known)) if row["status"] != "done" and len(known) == 1 else hardware_name(row)
    return row["task"], row["protocol"], kind


def _arranged(
    by_key: ColumnTable, members: Sequence[int], placings: list[Placing | None]
) -> tuple[tuple[int, ...], str]:  # fmt: skip
    """Put members of a block in order, and note where its results stand; return why they have no intervals, if so."""
    status, trivial, scores, sensors = (by_key[key] for key in ("status", "is_baseline", "score", "sensor"))
    bars = by_key.known("baseline")
    sign = 1.0 if by_key["metric"][members[0]] in LOWER_IS_BETTER else -1.0
    done = [place for place in members if status[place] == "done"]
    error = {place: sign * scores[place] if math.isfinite(scores[place]) else math.inf for place in done}
    answers: list[int] = []
    below: list[int] = []
    for place in done:
        if not trivial[place]:
            (below if no_better(error[place], sign, bars[place]) else answers).append(place)
    order = dict(zip(answers, errors(by_key.taken(answers)), strict=True))
    # What is equal stays in the order of the names.
    results = sorted(answers, key=lambda place: (order[place], error[place]))
    ranked = by_key.taken(results)
    found, unranked = places(ranked)
    standing = {place: found[cell] for place, cell in zip(results, ranked["cell"], strict=True)}
    for place, placing in standing.items():
        placings[place] = placing
    results.sort(key=lambda place: standing[place].place)  # of equal place stays the better one first
    baselines = sorted((place for place in done if trivial[place]), key=lambda place: (sensors[place], error[place]))
    stopped = sorted((place for place in members if status[place] != "done"), key=status.__getitem__)
    below.sort(key=error.__getitem__)
    return (*results, *below, *baselines, *stopped), unranked


def no_better(error: float, sign: float, baseline: float | None) -> bool:
    """Return whether an answer is no better than the trivial one: it gets no place.

    Parameters
    ----------
    error
        ``sign`` times its score, the lower the better.
    """
    return baseline is not None and error >= sign * baseline


def _title(key: _Key, members: Sequence[Row]) -> str:
    _, protocol, split, kind = key
    first = members[0]
    direction = "lower" if first["metric"] in LOWER_IS_BETTER else "higher"
    dagger = " †" if any(row["dagger"] for row in members) else ""
    parts = [first["task"], f"{metric_name(first)}, {direction} is better", protocol + dagger]
    if split:
        parts.append(f"split {split}")
    parts.append(kind)
    return visible(" · ".join(parts))
