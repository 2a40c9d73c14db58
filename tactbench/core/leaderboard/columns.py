"""The columns of a leaderboard, and the conversion of result rows into their texts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from tactbench.core.leaderboard.names import Row, answer_name, held_out
from tactbench.core.spec.row import STOPPED
from tactbench.core.statistics.rank import Rank
from tactbench.core.statistics.replicates import FEWEST
from tactbench.core.tables.text import ABSENT, Entry, delay, duration, finite, interval, score, visible, whole

Kind = Literal["result", "baseline", "failed", "skipped"]
"""Kind of a leaderboard line: an answer, a trivial answer, a failed cell or a skipped cell."""


class Column(NamedTuple):
    """A leaderboard column whose text depends on a single result row."""

    shown: str
    """Name of the column for programs: a key of ``shown`` in JSON, ``shown_…`` in CSV and Parquet."""
    text: Callable[[Row], str]
    value: Callable[[Row], float | None] | None = None
    """Number by which the column is sorted: times in s, intervals by their lower end; None for a column of words."""


def _score(shown: str, key: str) -> Column:
    return Column(shown, lambda row: score(row.get(key), row["unit"]), lambda row: row.get(key))


def _interval(shown: str, low: str, high: str) -> Column:
    return Column(shown, lambda row: interval(row.get(low), row.get(high), row["unit"]), lambda row: row.get(low))


def _time(shown: str, key: str) -> Column:
    return Column(shown, lambda row: duration(_seconds(row, key)), lambda row: _seconds(row, key))


def _seconds(row: Row, key: str) -> float | None:
    return None if row.get(key) is None else row[key] / (1e3 if "_ms" in key else 1.0)


def _range(row: Row) -> str:
    """Return the scores of campaigns or held-out units as text, if there are too few of them for an interval."""
    scores, unit = row.get("replicate_scores") or [], row["unit"]
    if len(scores) < 2 or row["ci_low"] is not None:
        return ABSENT
    each = ", ".join(score(one, unit) for one in scores)
    several = f"{score(row['score_min'], unit)} … {score(row['score_max'], unit)}"
    shown = each if len(scores) < FEWEST else several
    return visible(f"{shown} by {row['replicate_unit']}" if held_out(row) else shown)


_RANKED: dict[str, str] = {"place": "rank", "notes": "marks"}
"""Columns whose text depends on the other rows of the block, with their names for programs."""
OF_ROWS: dict[str, Column] = {
    "sensor": Column("sensor", lambda row: visible(str(row["sensor"]))),
    "estimator": Column("estimator", answer_name),
    "score": _score("score", "score"),
    "interval": _interval("interval", "ci_low", "ci_high"),
    "range": Column("range", _range, lambda row: row.get("score_min")),
    "beyond floor": _score("beyond_floor", "score_beyond_floor"),
    "interval beyond floor": _interval("beyond_floor_interval", "beyond_floor_ci_low", "beyond_floor_ci_high"),
    "against reference": _score("against_reference", "reference_score"),
    "published": _score("published", "published"),
    "test samples": Column("n_test", lambda row: whole(row["n_test"]), lambda row: row["n_test"]),
    "delay after touch": Column(
        "answer_delay",
        lambda row: delay(row.get("answer_delay_ms"), row.get("delay_parts_ms")),
        lambda row: _seconds(row, "answer_delay_ms"),
    ),
    "training": _time("fit", "fit_s"),
    "simulation": _time("sim", "sim_s"),
    "latency p50": _time("latency_p50", "latency_ms_p50"),
    "latency p95": _time("latency_p95", "latency_ms_p95"),
}
COLUMNS = ("place", "sensor", "estimator", "score", "notes", *list(OF_ROWS)[3:])
SHOWN = {name: OF_ROWS[name].shown if name in OF_ROWS else _RANKED[name] for name in COLUMNS}
WIDE = ("interval beyond floor", "test samples", "simulation", "latency p50", "latency p95")
"""Columns that are printed only if all columns are requested."""
DEFAULT = tuple(name for name in COLUMNS if name not in WIDE)
NUMERIC = frozenset(("place", *(name for name, column in OF_ROWS.items() if column.value)))


@dataclass(frozen=True)
class Line:
    """One line of a leaderboard: a result row and its texts."""

    row: Row = field(repr=False, compare=False)
    """Result row with unrounded numbers."""
    texts: Mapping[str, str]
    """Texts by column; numbers are of the type `Entry`."""
    kind: Kind
    placing: Rank | None = None
    """Rank in the block; None for an answer that is no better than the trivial answer of its sensor."""


def line_of(row: Row, placing: Rank | None = None, marks: Sequence[str] = (), place: str = "") -> Line:
    """Return the leaderboard line of a result row; the text `place` is shown for a finished row without rank."""
    texts = dict.fromkeys(COLUMNS, "")
    if row["status"] != "done":
        texts |= {"sensor": visible(str(row["sensor"])), "estimator": answer_name(row), "score": row["status"].upper()}
        return Line(row, texts, "failed" if row["status"] in STOPPED else "skipped")
    for name, column in OF_ROWS.items():
        text = column.text(row)
        if text != ABSENT:  # an absent value is empty: the dash means that an answer has no place
            value = column.value
            texts[name] = text if value is None else Entry(text, finite(value(row)), cell=row["cell"])
    if placing:
        place = Entry(f"{placing.place}=" if placing.unsure else str(placing.place), placing.place, cell=row["cell"])
    texts |= {"place": place, "notes": " ".join(marks)}
    return Line(row, texts, "baseline" if row["is_baseline"] else "result", placing)
