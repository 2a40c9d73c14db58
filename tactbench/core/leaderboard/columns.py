"""The columns of a leaderboard: what each shows of a row, and what it is sorted by."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from tactbench.core.leaderboard.levels import KEY as LEVEL
from tactbench.core.tables.numbers import ABSENT, delay, duration, interval, score, tail, whole
from tactbench.core.tables.text import visible

Row = Mapping[str, Any]
Value = Callable[[Row], float | None]
Text = Callable[[Row], str]


class Column(NamedTuple):
    """A column of numbers that a row has by itself."""

    text: Text
    value: Value
    """What it is sorted by: times in seconds, intervals by their middle."""
    timed: bool = False
    """Whether no seed decides it: it belongs to the host that was timed."""
    if_known: str = ""
    """A table has the column only where a row has this key; empty: always."""


def _score(key: str, if_known: str = "") -> Column:
    return Column(lambda row: score(row.get(key), row["unit"]), lambda row: row.get(key), False, if_known)


def _count(key: str) -> Column:
    return Column(lambda row: whole(row[key]), lambda row: row[key])


def _middle(low: str, high: str) -> Value:
    def middle(row: Row) -> float | None:
        ends = row.get(low), row.get(high)
        return None if ends[0] is None or ends[1] is None else (ends[0] + ends[1]) / 2

    return middle


def _duration(value: Value) -> Column:
    return Column(lambda row: duration(value(row)), value, timed=True)


def _seconds(key: str) -> Value:
    return lambda row: None if row.get(key) is None else row[key] / 1e3


def _tail(row: Row) -> float | None:
    """Return the 95th percentile of latencies; of fewer calls than it needs, the largest."""
    p95 = _seconds("latency_ms_p95")(row)
    return _seconds("latency_ms_max")(row) if p95 is None else p95


def _per_row(row: Row) -> float | None:
    spent, count = row["predict_s"], row["batch_rows"]
    return spent / count if spent is not None and count else None


def row_interval(row: Row) -> str:
    """Return a row's interval; where too few replicates carry one, the range of their scores, named so."""
    text = interval(row["ci_low"], row["ci_high"], row["unit"])
    count = row.get("n_replicates")
    if text != ABSENT or not count:
        return text
    spread = interval(row.get("score_min"), row.get("score_max"), row["unit"])
    return "one replicate" if count == 1 else spread if spread == ABSENT else f"range {spread}"


def _right(row: Row) -> str:
    """Return how many recordings were classified rightly, the mean over replicates: ``3.1 of 5``."""
    right, total = row.get("recordings_right"), row.get("recordings_asked")
    return ABSENT if right is None or total is None else f"{right:.3g} of {total:.3g}"


def _beyond(row: Row) -> str:
    return interval(row.get("beyond_floor_ci_low"), row.get("beyond_floor_ci_high"), row["unit"])


def _delay(row: Row) -> str:
    return delay(row.get("answer_delay_ms"), row.get("delay_parts_ms"))


def _p95(row: Row) -> str:
    return tail(row.get("latency_ms_p95"), row.get("latency_ms_max"), row.get("latency_n"))


OF_ROWS = {
    "level": Column(lambda row: visible(str(row.get(LEVEL) or ABSENT)), lambda row: None, if_known=LEVEL),
    "score": _score("score"),
    "95 % interval": Column(row_interval, _middle("ci_low", "ci_high")),
    "beyond floor": _score("score_beyond_floor", "score_beyond_floor"),
    "95 % beyond": Column(
        _beyond, _middle("beyond_floor_ci_low", "beyond_floor_ci_high"), if_known="score_beyond_floor"
    ),
    "true error": _score("true_score", "true_score"),
    "recordings right": Column(_right, lambda row: row.get("recordings_right"), if_known="recordings_right"),
    "published": _score("published"),
    "baseline": _score("baseline"),
    "n test": _count("n_test"),
    "sessions": _count("n_sessions"),
    "sim": _duration(lambda row: row["sim_s"]),
    "delay": Column(_delay, _seconds("answer_delay_ms"), timed=True),
    "fit": _duration(lambda row: row["fit_s"]),
    "latency p50": _duration(_seconds("latency_ms_p50")),
    "p95": Column(_p95, _tail, timed=True),
    "batch/row": _duration(_per_row),
}
"""Columns by name; the others are told by the block that a row stands in, or are names."""

SHOWN = {
    "#": "rank", "sensor": "sensor", "level": "level", "estimator": "estimator", "score": "score",
    "95 % interval": "interval", "beyond floor": "beyond_floor", "95 % beyond": "beyond_floor_interval",
    "true error": "true_error", "rank 95 %": "rank_interval", "recordings right": "recordings_right",
    "published": "published", "baseline": "baseline", "n test": "n_test", "sessions": "sessions", "sim": "sim",
    "delay": "answer_delay", "fit": "fit", "latency p50": "latency_p50", "p95": "latency_p95",
    "batch/row": "batch_row",
}  # fmt: skip
"""All columns in order, and what each is called where programs read its text: ``shown`` in JSON, ``shown_…`` in CSV and
Parquet."""
COLUMNS = tuple(SHOWN)
NUMERIC = frozenset(COLUMNS) - {"sensor", "level", "estimator"}
INTERVALS = ("95 % interval", "95 % beyond")
IF_KNOWN = {name: column.if_known for name, column in OF_ROWS.items() if column.if_known}
"""Columns of levels of checked sensors, of errors of force, whose reference errs too, and of classifications with
recordings of one class each."""


def columns(rows: Sequence[Row], *, times: bool) -> tuple[str, ...]:
    """Return the columns of a table of `rows` with times, or of one without."""
    lacking = {name for name, key in IF_KNOWN.items() if all(row.get(key) is None for row in rows)}
    timed = {"level"} | {name for name, column in OF_ROWS.items() if column.timed}
    return tuple(name for name in COLUMNS if name not in lacking and (times or name not in timed))
