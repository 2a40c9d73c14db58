"""The notes below a leaderboard: what marks mean, what was left out, how intervals came about, what ended badly."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.counts import told_counts
from tactbench.core.leaderboard.marks import mark_notes
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, answer_name, question_name
from tactbench.core.leaderboard.stopped import stopped_notes
from tactbench.core.leaderboard.text import visible

Row = Mapping[str, Any]

RANKS = (
    "A place with = is shared: the data do not tell these answers apart. Rank 95 % holds the places that the data do "
    "not exclude (docs/statistics.md)."
)


def notes_of(blocks: Sequence[Block]) -> list[str]:
    """Return the notes on the lines of `blocks`; those on whose times they are stand elsewhere."""
    rows = [line.row for block in blocks for line in block.lines]
    return [
        *mark_notes(rows),
        *rank_notes(blocks),
        *_chosen_notes(rows),
        *_no_better_notes(rows),
        *_left_out_notes(rows),
        *interval_notes(rows),
        *stopped_notes(rows),
    ]


def rank_notes(blocks: Sequence[Block]) -> list[str]:
    """Return what places and their intervals mean, and where there are none."""
    notes = []
    if any(line.placing and line.placing.low is not None for block in blocks for line in block.lines):
        notes.append(RANKS)
    reasons: dict[str, list[str]] = {}
    for block in blocks:
        if block.unranked and sum(line.kind == "result" for line in block.lines) > 1:
            reasons.setdefault(block.unranked, []).append(block.title)
    everywhere = len(blocks) == sum(len(titles) for titles in reasons.values()) and len(reasons) == 1
    for reason, titles in reasons.items():
        where = "" if everywhere else f"In {'; in '.join(titles)}: "
        notes.append(f"{where}places are by score alone, without intervals, since {reason}.")
    return [note[0].upper() + note[1:] for note in notes]


def interval_notes(rows: Iterable[Row]) -> list[str]:
    """Return one sentence a task and kind of interval; what is in brackets only where it is the same for all."""
    kinds: dict[str, dict[str, None]] = {}
    for task, method in dict.fromkeys((row["task"], row["ci_method"]) for row in rows if not row["is_baseline"]):
        if method:
            told = visible(f"{task}: interval by {method}.")
            kinds.setdefault(re.sub(r" \([^)]*\)", "", told), {})[told] = None
    return [next(iter(told)) if len(told) == 1 else short for short, told in kinds.items()]


def _chosen_notes(rows: Iterable[Row]) -> list[str]:
    """Return one sentence for all answers that chose the same on validation data."""
    names: dict[str, dict[str, None]] = {}
    for row in rows:
        if row["chosen"]:
            picked = ", ".join(f"{key.rstrip('_')} = {_told(value)}" for key, value in sorted(row["chosen"].items()))
            names.setdefault(visible(picked), {})[f"{question_name(row)}/{answer_name(row)}"] = None
    return [f"{', '.join(who)}: chosen on validation data: {picked}." for picked, who in names.items()]


def _told(value: object) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _no_better_notes(rows: Iterable[Row]) -> list[str]:
    """Return one sentence a sensor and task on the answers that are no better than the trivial one."""
    names: dict[str, dict[str, None]] = {}
    for row in rows:
        if _no_better(row):
            names.setdefault(question_name(row), {})[answer_name(row)] = None
    return [
        f"{where}/{', '.join(who)} {'is' if len(who) == 1 else 'are'} no better than the trivial baseline: see how the "
        "recordings differ before blaming the sensor."
        for where, who in names.items()
    ]


def _no_better(row: Row) -> bool:
    if row["status"] != "done" or row["is_baseline"] or row["baseline"] is None:
        return False
    lower = row["metric"] in LOWER_IS_BETTER
    bound = row["ci_high"] if lower else row["ci_low"]
    if bound is None:
        return False
    if not (bound >= row["baseline"] if lower else bound <= row["baseline"]):
        return False
    return not is_probe(row["protocol"])  # no better than trivial is what a probe should be


def _left_out_notes(rows: Iterable[Row]) -> list[str]:
    """Return what was left out of the data, and what their recordings remark; rows share these, each is told once."""
    counted: dict[str, None] = {}
    remarked: dict[str, None] = {}
    told: set[tuple[Any, ...]] = set()
    for row in rows:
        counts = row["counts"]
        mark = (row["sensor"], row["task"], *counts, *counts.values(), *map(type, counts.values()))
        if mark not in told:
            told.add(mark)
            where = question_name(row)
            counted |= dict.fromkeys(visible(f"{where}: {count}.") for count in told_counts(counts))
        if row["remarks"]:
            remarked |= dict.fromkeys(visible(f"{row['sensor']}: {remark}") for remark in row["remarks"])
    return [*counted, *remarked]
