"""Names and trivial answers in tables, and the columns of a leaderboard with the texts of result rows in them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any, Literal, NamedTuple, TypeVar

from tactbench.core.evaluation.protocols import shots
from tactbench.core.spec.row import STOPPED, TRUE, lower_is_better
from tactbench.core.statistics.rank import Rank
from tactbench.core.statistics.replicates import FEWEST
from tactbench.core.tables.text import ABSENT, Entry, delay, duration, finite, interval, score, visible, whole

Row = Mapping[str, Any]
_Key = TypeVar("_Key")
_Value = TypeVar("_Value")

METRIC_NAMES = {
    "rmse": "RMSE", "mae": "MAE", "mean_euclidean_error": "mean Euclidean error", "r2": "R²", "macro_f1": "macro F1",
    "accuracy": "accuracy", "balanced_accuracy": "balanced accuracy", "recall_area": "recall area",
}  # fmt: skip
_SPLITS = {
    "roles": "tested on recordings apart from training",
    "in-session": "split in-session: each recording cut in time",
    "shuffled": "split shuffled: rows dealt at random",
}
"""Descriptions of splits that do not hold out groups of recordings by a label."""


def sensor_name(row: Row) -> str:
    """Return the sensor's name, marked SIM or EMULATED unless it was real."""
    mark = " EMULATED" if row.get("emulated") else " SIM" if row["simulated"] else ""
    return visible(f"{row['sensor']}{mark}")


def answer_name(row: Row) -> str:
    """Return the estimator's name, with the parameters that differ from its defaults."""
    options = ", ".join(f"{key}={value}" for key, value in sorted((row["params"] or {}).items()))
    return visible(f"{row['estimator']} ({options})" if options else str(row["estimator"]))


def metric_name(row: Row) -> str:
    """Return the name of the metric with its unit, as ``RMSE [N]``."""
    unit = f" [{row['unit']}]" if row["unit"] != "1" else ""
    name = row["metric"].removeprefix(TRUE)
    true = "true " if name != row["metric"] else ""
    return visible(f"{true}{METRIC_NAMES.get(name, name.partition(' (')[0])}{unit}")


def direction(row: Row) -> str:
    """Return the text "lower is better" or "higher is better" for a row's metric."""
    return f"{'lower' if lower_is_better(row['metric']) else 'higher'} is better"


def split_name(split: str) -> str:
    """Return a description of a train/test split by its name."""
    return _SPLITS.get(split, f"split {'' if shots(split) else 'by '}{split}")


def held_out(row: Row) -> bool:
    """Return True if the replicates of a row are units held out by its split, False for simulated campaigns."""
    return row.get("replicate_unit") not in ("replicate", None)


def sign_of(row: Row) -> float:
    """Return 1 if a lower score is better, else -1: a factor by which a score becomes an error."""
    return 1.0 if lower_is_better(row["metric"]) else -1.0


def hardware_name(row: Row) -> str:
    """Return the origin of a row as text: simulation, emulated devices on a rig, or a real rig."""
    if row.get("emulated"):
        return f"EMULATED (rig {row['rig']})"
    return "SIM" if row["simulated"] else f"rig {row['rig']}"


def grouped(members: Iterable[_Value], key: Callable[[_Value], _Key]) -> dict[_Key, list[_Value]]:
    """Return the members by their key; keys and members keep the order of `members`."""
    groups: dict[_Key, list[_Value]] = {}
    for one in members:
        groups.setdefault(key(one), []).append(one)
    return groups


comparison_key = itemgetter("sensor", "task", "rig", "protocol", "split")
"""Keys of a row that are equal for an answer and the trivial answer to compare it with."""
WORSE_END = {1.0: "ci_high", -1.0: "ci_low"}
"""Key of the worse end of a row's interval, by the value of `sign_of`."""


def error_of(row: Row) -> float:
    """Return the score with a sign such that smaller is better; infinity for a score that is not finite."""
    return sign_of(row) * row["score"] if math.isfinite(row["score"]) else math.inf


class Bars:
    """Comparison of answers with the best trivial answer for the same sensor, task, rig, protocol and split."""

    def __init__(self, rows: Iterable[Row] = ()) -> None:
        """Collect the finished trivial answers among `rows`, except for oracles, which read the reference."""
        trivial = (row for row in rows if row["is_baseline"] and row["status"] == "done")
        groups = grouped((row for row in trivial if row.get("looks_at") != "reference"), comparison_key)
        self._best = {key: min(alike, key=error_of) for key, alike in groups.items()}
        self._unshown: dict[str, bool] = {}

    def trivial(self, row: Row) -> Row | None:
        """Return the row of the trivial answer to compare `row` with; None if it is not among the rows."""
        return self._best.get(comparison_key(row))

    def score(self, row: Row) -> float | None:
        """Return the score of the trivial answer, or else the baseline stored in `row`; None if neither exists."""
        trivial = self.trivial(row)
        return row.get("baseline") if trivial is None else trivial["score"]

    def no_better(self, row: Row) -> bool:
        """Return True if an answer is no better than the trivial answer."""
        return self._reaches(row, error_of(row))

    def unshown(self, row: Row) -> bool:
        """Return True if an answer is not shown to be better: its interval includes or exceeds the trivial score.

        If both answers were tested on the same recorded units, the interval of their paired difference decides.
        """
        if row["cell"] not in self._unshown:  # a difference takes thousands of exchanges
            self._unshown[row["cell"]] = self._contains(row)
        return self._unshown[row["cell"]]

    def _contains(self, row: Row) -> bool:
        trivial = self.trivial(row)
        if trivial is not None and held_out(row) and row["replicates"] and trivial["replicates"]:
            from tactbench.core.statistics.paired import difference  # numerics

            found = difference(row, trivial)
            if found.paired and found.low is not None and found.high is not None:
                return found.high >= 0 if sign_of(row) > 0 else found.low <= 0
        end = row[WORSE_END[sign_of(row)]]
        if end is None:  # an interval that is open above, or none
            return row["ci_low"] is not None and self.score(row) is not None
        return self._reaches(row, sign_of(row) * end)

    def _reaches(self, row: Row, error: float) -> bool:
        bar = self.score(row)
        return bar is not None and error >= sign_of(row) * bar


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
