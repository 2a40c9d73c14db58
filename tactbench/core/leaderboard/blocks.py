"""Rows that may be compared stand in one block; no rank spans two.

Rows under different tasks, protocols, splits or repeats, and rows from the twin and from hardware, are not comparable.
The order of blocks and lines depends on the rows alone, never on the order they come in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.hosts import timing_mark
from tactbench.core.leaderboard.lines import Line, done_line, stopped_line
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, hardware_name, metric_name
from tactbench.core.leaderboard.placing import places
from tactbench.core.leaderboard.text import visible

Row = Mapping[str, Any]
_Key = tuple[str, str, str, str, int]
_ORIGIN = itemgetter("task", "protocol", "rig", "simulated", "status", "repeat", "split")
"""All that says in which block a row stands."""


@dataclass(frozen=True)
class Block:
    """Rows that may be compared."""

    title: str
    lines: tuple[Line, ...]
    unranked: str = ""
    """Why there are no rank intervals; empty where there are."""


def blocks_of(rows: Sequence[Row], letters: Mapping[str, str], times: bool) -> tuple[Block, ...]:
    """Arrange `rows` into blocks, ranked.

    Parameters
    ----------
    letters
        The mark of each host.
    times
        Whether lines have times.
    """
    groups = _grouped(rows)
    return tuple(_block(key, groups[key], letters, times) for key in sorted(groups, key=_order))


def _order(key: _Key) -> tuple[Any, ...]:
    """Return what blocks are sorted by: within a task, what probes or is not kept apart comes after what is."""
    task, protocol, split, _, _ = key
    return task, split in ("shuffled", "in-session"), is_probe(protocol), key


def _grouped(rows: Sequence[Row]) -> dict[_Key, list[Row]]:
    """Group rows by what must not be mixed.

    A cell that was not begun knows neither its split, if nobody asked for one, nor whether it would have been
    simulated: it stands with the finished cells of its rig, if these agree.
    """
    origins = list(map(_ORIGIN, rows))
    alike = dict(zip(origins, rows, strict=True))  # one row of each origin: the others are asked nothing
    kinds: dict[str, set[str]] = {}
    splits: dict[tuple[Any, ...], set[str]] = {}
    for row in alike.values():
        if row["status"] == "done":
            kinds.setdefault(row["rig"], set()).add(hardware_name(row))
    for row in alike.values():
        if row["split"] is not None:
            splits.setdefault(_without_split(row, kinds), set()).add(row["split"])
    keys = {origin: _key(row, kinds, splits) for origin, row in alike.items()}
    groups: dict[_Key, list[Row]] = {}
    for row, origin in zip(rows, origins, strict=True):
        groups.setdefault(keys[origin], []).append(row)
    return groups


def _key(row: Row, kinds: Mapping[str, set[str]], splits: Mapping[tuple[Any, ...], set[str]]) -> _Key:
    task, protocol, kind, repeat = _without_split(row, kinds)
    known = splits.get((task, protocol, kind, repeat), set())
    split = row["split"] if row["split"] is not None else next(iter(known)) if len(known) == 1 else ""
    return task, protocol, split, kind, repeat


def _without_split(row: Row, kinds: Mapping[str, set[str]]) -> tuple[str, str, str, int]:
    known = kinds.get(row["rig"], set())
    kind = next(iter(known)) if row["status"] != "done" and len(known) == 1 else hardware_name(row)
    return row["task"], row["protocol"], kind, row["repeat"] or 0


def _block(key: _Key, members: Sequence[Row], letters: Mapping[str, str], times: bool) -> Block:
    sign = 1.0 if members[0]["metric"] in LOWER_IS_BETTER else -1.0

    def better(row: Row) -> tuple[Any, ...]:
        value = row["score"]
        return (not math.isfinite(value), sign * value if math.isfinite(value) else 0.0, row["cell"])

    done = [row for row in members if row["status"] == "done"]
    results = sorted((row for row in done if not row["is_baseline"]), key=better)
    placings, unranked = places(results)
    results.sort(key=lambda row: placings[row["cell"]].place)  # of equal place stays the better one first
    baselines = sorted((row for row in done if row["is_baseline"]), key=lambda row: (row["sensor"], *better(row)))
    stopped = sorted((row for row in members if row["status"] != "done"), key=lambda row: (row["status"], row["cell"]))
    lines = (
        *(done_line(row, placings[row["cell"]], timing_mark(row, letters), times) for row in results),
        *(done_line(row, None, timing_mark(row, letters), times) for row in baselines),
        *(stopped_line(row, times) for row in stopped),
    )
    return Block(_title(key, members), lines, unranked)


def _title(key: _Key, members: Sequence[Row]) -> str:
    _, protocol, split, kind, _ = key
    first = min(members, key=lambda row: str(row["cell"]))
    direction = "lower" if first["metric"] in LOWER_IS_BETTER else "higher"
    dagger = " †" if any(row["dagger"] for row in members) else ""
    parts = [first["task"], f"{metric_name(first)}, {direction} is better", protocol + dagger]
    if split:
        parts.append(f"split {split}")
    parts.append(kind)
    if first["repeats"] > 1:
        parts.append(f"repeat {first['repeat']} of {first['repeats']}, seed {first['seed']}")
    return visible(" · ".join(parts))
