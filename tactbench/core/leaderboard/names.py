"""What rows, metrics and answers are called in tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from tactbench.core.evaluation.protocols import shots
from tactbench.core.spec.row import LOWER_IS_BETTER as LOWER_IS_BETTER
from tactbench.core.tables.text import visible

Row = Mapping[str, Any]
_Key = TypeVar("_Key")
_Value = TypeVar("_Value")

SIMULATED = "SIM (twin)"
"""What is said of simulated rows in place of a rig."""
EMULATED = "EMULATED"
"""What is said of rows whose recordings came from emulated devices, before their rig."""
METRIC_NAMES = {
    "rmse": "RMSE",
    "mae": "MAE",
    "mean_euclidean_error": "mean Euclidean error",
    "r2": "R²",
    "macro_f1": "macro F1",
    "accuracy": "accuracy",
    "balanced_accuracy": "balanced accuracy",
    "event_f1": "event F1",
}
_SPLITS = {
    "roles": "tested on recordings apart from training",
    "in-session": "split in-session: each recording cut in time",
    "shuffled": "split shuffled: rows dealt at random",
}
"""Splits that are not named by what they keep apart."""


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
    return visible(f"{METRIC_NAMES.get(row['metric'], row['metric'])}{unit}")


def split_name(split: str) -> str:
    """Return what is kept apart between training and test."""
    return _SPLITS.get(split, f"split {'' if shots(split) else 'by '}{split}")


def sign_of(row: Row) -> float:
    """Return 1 where a lower score is better, else -1: a score times it is the lower the better."""
    return 1.0 if row["metric"] in LOWER_IS_BETTER else -1.0


def hardware_name(row: Row) -> str:
    """Return what carried out a row's scenes: the twin, emulated devices on a rig, or a rig by its name."""
    if row.get("emulated"):
        return f"{EMULATED} (rig {row['rig']})"
    return SIMULATED if row["simulated"] else f"rig {row['rig']}"


def grouped(members: Iterable[_Value], key: Callable[[_Value], _Key]) -> dict[_Key, list[_Value]]:
    """Return the members of each key, both in the order in which they come."""
    groups: dict[_Key, list[_Value]] = {}
    for one in members:
        groups.setdefault(key(one), []).append(one)
    return groups
