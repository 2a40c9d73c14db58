"""What evaluating a cell comes to, and the same as entries of its row."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.interval import Interval
from tactbench.core.evaluation.reference_floor import BeyondFloor
from tactbench.core.samples import Answers
from tactbench.core.spec.scene import Role


@dataclass(frozen=True)
class Sizes:
    """How much was answered; named as in the row."""

    n_recordings: int
    """that some fold uses; n_sessions and n_specimens alike"""
    n_sessions: int
    n_specimens: int | None
    """devices, by the label `unit`; None where a recording has none"""
    n_train: int
    n_test: int
    fold_sizes: Mapping[str, tuple[int, int]]
    """training and test rows of each fold, by its name in `scores`"""


@dataclass(frozen=True)
class Times:
    """What it took; named as in the row. What needs single answers to be timed is None where they were not."""

    search_s: float
    fit_s: float
    predict_s: float
    batch_rows: int
    latency_ms_p50: float | None
    latency_ms_p95: float | None
    """None also where fewer than 200 calls were measured"""
    latency_ms_max: float | None
    latency_n: int | None
    answer_delay_ms: float | None
    """None also where a part other than the link is not known; see delay"""
    delay_parts_ms: Mapping[str, float]
    """sampling, link, window, features, prediction: those that are known"""
    threads: int
    peak_rss_mb: float | None


@dataclass(frozen=True)
class Result:
    """The score of an estimator on a task, and what is known of it."""

    metric: str
    score: float
    interval: Interval
    scores: Mapping[str, float]
    """other metrics, the score on validation data, of each fold and each class"""
    sizes: Sizes
    times: Times
    split: str
    sets: Mapping[Role, Answers]
    """answers by role: test always; validation, and for regression train, where the split has one fold"""
    replicates: Mapping[str, Any]
    """the primary metric's sums over each replicate; see replicate_sums"""
    classes: tuple[Any, ...] = ()
    confusion: npt.NDArray[np.int64] | None = None
    """(true class, predicted class)"""
    recordings_right: int | None = None
    """test recordings most answers to which are right, of a classification; None where one has several classes"""
    recordings_asked: int | None = None
    """test recordings, of which some were right"""
    beyond: BeyondFloor | None = None
    """of an error of force: what is beyond the noise of the reference; None where that is not known"""
    true: tuple[float, Interval] | None = None
    """the metric against the force that was exerted; None where that is not known"""
    events: Mapping[str, float] = field(default_factory=dict)
    """figures of events, times in the unit of the name"""
    operating_points: tuple[Mapping[str, float], ...] = ()
    """the same at thresholds chosen on validation for several bounds of false alarms"""
    chosen: Mapping[str, float] = field(default_factory=dict)
    search: tuple[Mapping[str, Any], ...] = ()
    """every candidate that was compared on validation data: its parameters, k, score and fold"""
    counts: Mapping[str, int] = field(default_factory=dict)
    """what was left out, and why"""
    dagger: bool = False
    stamps: tuple[str, ...] = ()
    tare_s: float | None = None
    """seconds of unloaded hold that each recording was tared on, the shortest of all; None: none was tared"""
    remarks: tuple[str, ...] = ()
    """what could not be done, and why"""


_NOT_AS_THEY_ARE = ("interval", "sizes", "times", "sets", "beyond", "true")
"""Fields of a result that have other keys in its row, or none."""


def row_of(result: Result) -> dict[str, Any]:
    """Return what a row says of a result, as plain data under the row's keys."""
    row = {name: value for name, value in vars(result).items() if name not in _NOT_AS_THEY_ARE}
    row |= {"ci_low": result.interval.low, "ci_high": result.interval.high, "ci_method": result.interval.method}
    row |= {**vars(result.sizes), **vars(result.times)}
    if result.beyond is not None:
        row |= {"reference_floor": result.beyond.floor, "score_beyond_floor": result.beyond.score}
        row |= {"beyond_floor_ci_low": result.beyond.low, "beyond_floor_ci_high": result.beyond.high}
    if result.true is not None:
        score, interval = result.true
        row |= {"true_score": score, "true_ci_low": interval.low, "true_ci_high": interval.high}
    return {name: _plain(value) for name, value in row.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return value.tolist() if hasattr(value, "tolist") else value
