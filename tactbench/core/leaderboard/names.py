"""What rows, metrics and answers are called in tables, and what trivial answers they are held against."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from operator import itemgetter
from typing import Any, TypeVar

from tactbench.core.evaluation.protocols import shots
from tactbench.core.spec.row import TRUE
from tactbench.core.spec.row import lower_is_better as lower_is_better
from tactbench.core.tables.text import visible

Row = Mapping[str, Any]
_Key = TypeVar("_Key")
_Value = TypeVar("_Value")

SIMULATED = "SIM"
"""What stands in place of the rig of simulated rows."""
EMULATED = "EMULATED"
"""What stands before the rig of rows whose recordings came from emulated devices."""
METRIC_NAMES = {
    "rmse": "RMSE",
    "mae": "MAE",
    "mean_euclidean_error": "mean Euclidean error",
    "r2": "R²",
    "macro_f1": "macro F1",
    "accuracy": "accuracy",
    "balanced_accuracy": "balanced accuracy",
    "recall_area": "recall area",
}
_SPLITS = {
    "roles": "tested on recordings apart from training",
    "in-session": "split in-session: each recording cut in time",
    "shuffled": "split shuffled: rows dealt at random",
}
"""Descriptions of splits whose name is not that of a group of recordings."""


def sensor_name(row: Row) -> str:
    """Return a sensor's name, marked where it was simulated."""
    mark = EMULATED if row.get("emulated") else "SIM" if row["simulated"] else ""
    return visible(" ".join(filter(None, (str(row["sensor"]), mark))))


def answer_name(row: Row) -> str:
    """Return the estimator's name, with the parameters that are not its defaults."""
    options = ", ".join(f"{key}={value}" for key, value in sorted((row["params"] or {}).items()))
    return visible(f"{row['estimator']} ({options})" if options else str(row["estimator"]))


def metric_name(row: Row) -> str:
    """Return the metric with its unit: ``RMSE [N]``."""
    unit = f" [{row['unit']}]" if row["unit"] != "1" else ""
    name = row["metric"].removeprefix(TRUE)
    true = "true " if name != row["metric"] else ""
    return visible(f"{true}{METRIC_NAMES.get(name, name.partition(' (')[0])}{unit}")


def split_name(split: str) -> str:
    """Return what is kept apart between training and test."""
    return _SPLITS.get(split, f"split {'' if shots(split) else 'by '}{split}")


def held_out(row: Row) -> bool:
    """Return whether the replicates of a row are what its split holds out, and not campaigns."""
    return row.get("replicate_unit") not in ("replicate", None)


def sign_of(row: Row) -> float:
    """Return 1 where a lower score is better, else -1: a score times it is the lower the better."""
    return 1.0 if lower_is_better(row["metric"]) else -1.0


def hardware_name(row: Row) -> str:
    """Return what carried out a row's scenes: a simulation, emulated devices on a rig, or a rig by its name."""
    if row.get("emulated"):
        return f"{EMULATED} (rig {row['rig']})"
    return SIMULATED if row["simulated"] else f"rig {row['rig']}"


def grouped(members: Iterable[_Value], key: Callable[[_Value], _Key]) -> dict[_Key, list[_Value]]:
    """Return the members of each key, both in the order in which they come."""
    groups: dict[_Key, list[_Value]] = {}
    for one in members:
        groups.setdefault(key(one), []).append(one)
    return groups


comparison_key = itemgetter("sensor", "task", "rig", "protocol", "split")
"""Keys that an answer and the trivial answer it is compared with share."""
WORSE_END = {1.0: "ci_high", -1.0: "ci_low"}
"""The worse end of an interval by `sign_of`: of an error, and of what is the higher the better."""


def error_of(row: Row) -> float:
    """Return a score as a number that is the lower the better; one that is no finite number is the worst."""
    return sign_of(row) * row["score"] if math.isfinite(row["score"]) else math.inf


class Bars:
    """The score that each answer is held against: the best trivial one of its own sensor, whatever it looks at."""

    def __init__(self, rows: Iterable[Row]) -> None:
        """Collect the finished trivial answers of `rows`; an oracle is no trivial answer."""
        trivial = (row for row in rows if row["is_baseline"] and row["status"] == "done")
        groups = grouped((row for row in trivial if row.get("looks_at") != "reference"), comparison_key)
        self._best = {key: min(alike, key=error_of) for key, alike in groups.items()}
        self._unshown: dict[str, bool] = {}

    def trivial(self, row: Row) -> Row | None:
        """Return the trivial answer; None where it is not among the rows, and only its score may be known."""
        return self._best.get(comparison_key(row))

    def score(self, row: Row) -> float | None:
        """Return the score of the trivial answer; None if there is none."""
        trivial = self.trivial(row)
        return row.get("baseline") if trivial is None else trivial["score"]

    def name(self, row: Row) -> str:
        """Return the name of the trivial answer."""
        trivial = self.trivial(row)
        return "the trivial answer" if trivial is None else answer_name(trivial)

    def no_better(self, row: Row) -> bool:
        """Return whether the score of an answer is no better than that of the trivial one."""
        return _reaches(error_of(row), row, self.score(row))

    def unshown(self, row: Row) -> bool:
        """Return whether the interval of an answer holds the score of the trivial one, or lies beyond it.

        On recordings the interval of their paired difference decides, where both were tested on the same units.
        """
        if row["cell"] not in self._unshown:  # a difference takes thousands of exchanges, and several notes ask
            self._unshown[row["cell"]] = self._holds(row)
        return self._unshown[row["cell"]]

    def _holds(self, row: Row) -> bool:
        trivial = self.trivial(row)
        if trivial is not None and held_out(row) and row["replicates"] and trivial["replicates"]:
            from tactbench.core.statistics.paired import difference  # numerics

            found = difference(row, trivial)
            if found.paired and found.low is not None and found.high is not None:
                return found.high >= 0 if sign_of(row) > 0 else found.low <= 0
        end = row[WORSE_END[sign_of(row)]]
        if end is None:  # an interval that is open above, or none
            return row["ci_low"] is not None and self.score(row) is not None
        return _reaches(sign_of(row) * end, row, self.score(row))


def no_better(row: Row) -> bool:
    """Return whether an answer is no better than the trivial one that used no more than it."""
    return _reaches(error_of(row), row, row.get("baseline"))


def _reaches(error: float, row: Row, bar: float | None) -> bool:
    return bar is not None and error >= sign_of(row) * bar
