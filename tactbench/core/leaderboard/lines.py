"""Rows as the texts that stand in a table, column by column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from operator import add
from typing import Any

from tactbench.core.leaderboard.column_table import ColumnTable
from tactbench.core.leaderboard.columns import TIMED_COLUMNS, columns
from tactbench.core.leaderboard.hosts import timing_marks
from tactbench.core.leaderboard.numbers import ABSENT, delay, duration, intervals, scores, tail, whole
from tactbench.core.leaderboard.placing import Placing
from tactbench.core.leaderboard.text_table import Kind
from tactbench.core.leaderboard.values import VALUES
from tactbench.core.spec.status import STOPPED

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Line:
    """One row as text, one string a column."""

    cells: tuple[str, ...]
    kind: Kind
    cell: str = ""
    """Name of the cell."""
    placing: Placing | None = None
    """Where it stands in its block; results better than the trivial answer only."""
    row: Row = field(default_factory=dict, repr=False, compare=False)
    """The row itself: numbers in full."""


@dataclass(frozen=True)
class Shown:
    """All rows of a table as text."""

    by_key: ColumnTable = field(repr=False, compare=False)
    texts: Mapping[str, Sequence[str]]
    """One text a row, by the name of the column."""
    kinds: Sequence[Kind]
    placings: Sequence[Placing | None]

    def line(self, place: int) -> Line:
        """Return the line of the row at this place of the by_key."""
        row = self.by_key.rows[place]
        cells = tuple(column[place] for column in self.texts.values())
        return Line(cells, self.kinds[place], row["cell"], self.placings[place], row)


def shown_of(by_key: ColumnTable, placings: Sequence[Placing | None], letters: Mapping[str, str], times: bool) -> Shown:
    """Return what stands in the lines of a table.

    Parameters
    ----------
    placings
        Where each row stands in its block; None: a baseline, or a cell that did not end well.
    letters
        The mark of each host.
    times
        Whether the table has times.
    """
    units = by_key["unit"]
    texts = {
        "#": _places(placings, by_key["is_baseline"]),
        "sensor": by_key.sensors,
        "estimator": by_key.answers,
        "score": list(map(add, scores(by_key["score"], units), _score_marks(by_key))),
        "95 % interval": row_intervals(by_key, units),
        "beyond floor": scores(by_key.known("score_beyond_floor"), units),
        "95 % beyond": intervals(by_key.known("beyond_floor_ci_low"), by_key.known("beyond_floor_ci_high"), units),
        "true error": scores(by_key.known("true_score"), units),
        "rank 95 %": _ranges(placings),
        "recordings right": _right(by_key),
        "published": scores(by_key["published"], units),
        "baseline": scores(by_key["baseline"], units),
        "n test": list(map(whole, by_key["n_test"])),
        "sessions": list(map(whole, by_key["n_sessions"])),
    }
    texts = {name: texts[name] for name in columns(by_key, times=False)}
    if times:
        marks = timing_marks(by_key, letters)
        told = {name: list(map(duration, VALUES[name](by_key))) for name in TIMED_COLUMNS}
        told["delay"] = list(map(delay, by_key.known("answer_delay_ms"), by_key.known("delay_parts_ms")))
        told["p95"] = list(map(tail, *map(by_key.known, ("latency_ms_p95", "latency_ms_max", "latency_n"))))
        texts |= {name: _marked(column, marks) for name, column in told.items()}
    status = by_key["status"]
    for place in [place for place, ended in enumerate(status) if ended != "done"]:
        for name, column in texts.items():
            if name not in ("sensor", "estimator"):
                column[place] = ABSENT
        texts["#"][place], texts["score"][place] = "", status[place].upper()
    return Shown(by_key, texts, list(map(_kind, status, by_key["is_baseline"])), placings)


def _right(by_key: ColumnTable) -> list[str]:
    """Return how many recordings were classified rightly, the mean over replicates: ``3.1 of 5``."""
    told = zip(by_key.known("recordings_right"), by_key.known("recordings_asked"), strict=True)
    return [ABSENT if right is None or of is None else f"{right:.3g} of {of:.3g}" for right, of in told]


def row_intervals(by_key: ColumnTable, units: Sequence[str]) -> list[str]:
    """Return intervals; where too few replicates carry one, the range of their scores, named so."""
    told = intervals(by_key["ci_low"], by_key["ci_high"], units)
    counts = by_key.known("n_replicates")
    if not any(counts):
        return told
    ranges = intervals(by_key.known("score_min"), by_key.known("score_max"), units)
    return [
        text if text != ABSENT or not count
        else "one replicate" if count == 1
        else text if spread == ABSENT
        else f"range {spread}"
        for text, count, spread in zip(told, counts, ranges, strict=True)
    ]  # fmt: skip


def _kind(status: str, trivial: bool) -> Kind:
    if status == "done":
        return "baseline" if trivial else "result"
    return "failed" if status in STOPPED else "skipped"


def _places(placings: Sequence[Placing | None], trivial: Sequence[bool]) -> list[str]:
    """Return places; an answer that is no better than the trivial one has none."""
    return [
        ("base" if plain else ABSENT) if one is None
        else f"{one.place}=" if one.tied
        else str(one.place)
        for one, plain in zip(placings, trivial, strict=True)
    ]  # fmt: skip


def _ranges(placings: Sequence[Placing | None]) -> list[str]:
    return [
        ABSENT if one is None or one.low is None or one.high is None
        else str(one.low) if one.low == one.high
        else f"{one.low}–{one.high}"
        for one in placings
    ]  # fmt: skip


def _marked(told: list[str], marks: Sequence[str]) -> list[str]:
    return [text if text == ABSENT else text + mark for text, mark in zip(told, marks, strict=True)] if marks else told


def _score_marks(by_key: ColumnTable) -> list[str]:
    """Return what stands behind each score: † for test-set statistics, ‡ for what its row is stamped with."""
    given = zip(by_key["dagger"], by_key["stamps"], strict=True)
    return [(" †" if dagger else "") + (" ‡" if stamps else "") for dagger, stamps in given]
