"""The row of a cell: names, types and meaning of all its keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict

Status = Literal["done", "failed", "crashed", "timeout", "out-of-memory", "skipped"]
STATUSES: tuple[Status, ...] = get_args(Status)
"""Statuses of a cell: every planned cell ends as one row with one of them."""
STOPPED: frozenset[Status] = frozenset({"failed", "crashed", "timeout", "out-of-memory"})
"""Statuses of cells that failed; one of them makes the exit code 1."""

TRUE = "true_"
"""Prefix of the names of metrics against the force that a simulated rig exerted."""
DIRECTIONS = (" (lower is better)", " (higher is better)")
"""Suffixes of the name of a caller's own metric."""


def lower_is_better(metric: str) -> bool:
    """Return whether a metric of a row's score is an error."""
    errors = ("rmse", "mae", "mean_euclidean_error", "excess_square")
    return metric.removeprefix(TRUE) in errors or metric.endswith(DIRECTIONS[0])


MEDIAN_ERROR, HIGH_ERROR = "median error", "95th percentile of the error"
"""Keys of `scores` beside the mean error of a vector: percentiles over the test rows."""

LEAKS = "leaks: "
"""Prefix of stamps on a score that training data have leaked into."""


def plural(unit: str) -> str:
    """Return the name of several units of replication."""
    return unit + ("es" if unit.endswith("s") else "s")


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)


class Asked(_Section):
    """The question: sensor, task, rig, protocol, split and estimator."""

    cell: str
    sensor: str = ""
    task: str = ""
    rig: str = ""
    protocol: str = ""
    split: str | None = None
    estimator: str = ""
    params: dict[str, Any] = {}
    is_baseline: bool = False
    looks_at: str = ""
    answer_per: str = "sample"
    answer_from: str = ""
    declared_task: str = ""
    include_incomplete: bool = False
    seed: int = 0
    simulation: dict[str, Any] = {}


class Ended(_Section):
    """The way in which the cell ended."""

    status: Status
    reason: str = ""
    traceback: str = ""
    signal: int | None = None
    log: str = ""


class Scored(_Section):
    """The score, and the amount of data behind it."""

    metric: str = ""
    unit: str = ""
    equivalence: float | None = None
    score: float | None = None
    ci_low: float | None = None
    """lower end of the interval; None: there are too few units for one"""
    ci_high: float | None = None
    """upper end; None, beside a `ci_low`: the data bound an error from below only"""
    ci_method: str = ""
    reference_floor: float | None = None
    """noise of the reference, for an error of force; None where that is not known"""
    reference_floor_se: float | None = None
    """standard error of that floor"""
    score_beyond_floor: float | None = None
    beyond_floor_ci_low: float | None = None
    beyond_floor_ci_high: float | None = None
    true_score: float | None = None
    """the metric against the force that was exerted; None where that is not known"""
    true_ci_low: float | None = None
    true_ci_high: float | None = None
    tare_s: float | None = None
    """seconds of unloaded hold that each recording was tared on, the shortest of all; None: none was tared"""
    baseline: float | None = None
    published: float | None = None
    published_reference: str = ""
    published_remark: str = ""
    n_recordings: int | None = None
    """recordings that some fold uses; n_sessions and n_specimens alike"""
    n_sessions: int | None = None
    n_specimens: int | None = None
    """devices, by the label `unit`; None where a recording has none"""
    n_train: int | None = None
    n_test: int | None = None


class Cost(_Section):
    """Times and memory of the cell. Numbers that need single answers are None where these were not timed."""

    sim_s: float | None = None
    search_s: float | None = None
    fit_s: float | None = None
    predict_s: float | None = None
    batch_rows: int | None = None
    latency_ms_p50: float | None = None
    latency_ms_p95: float | None = None
    """95th percentile; None also where fewer than 200 calls were measured"""
    latency_ms_max: float | None = None
    latency_n: int | None = None
    answer_delay_ms: float | None = None
    """sum of the parts; None also where one other than the link is not known"""
    delay_parts_ms: dict[str, float] = {}
    """known parts of the answer delay: sampling, link, window, features, prediction"""
    threads: int | None = None
    peak_rss_mb: float | None = None
    wall_s: float | None = None
    concurrency: int | None = None
    host: str = ""
    made_by: str = ""


class RestsOn(_Section):
    """The data, assumptions and choices behind the score."""

    simulated: bool = False
    emulated: bool = False
    dagger: bool = False
    stamps: list[str] = []
    findings: list[str] = []
    """findings in recordings that bear on the score, data that were left out, classes without training data"""
    remarks: list[str] = []
    """remarks of recordings, and reasons for what could not be done"""
    assumptions: dict[str, Any] = {}
    plan: list[dict[str, Any]] = []
    counts: dict[str, int] = {}
    """counts of what was left out, by reason"""
    chosen: dict[str, float] = {}
    search: list[dict[str, Any]] = []
    """candidates that were compared on validation data: parameters, k, score and fold"""
    digests: list[str] = []
    scores: dict[str, float] = {}
    """other metrics: the score on validation data, of each fold and of each class"""
    fold_sizes: dict[str, list[int]] = {}
    """training and test rows of each fold, by its name in `scores`"""
    confusion: list[list[int]] | None = None
    """counts of answers, (true class, predicted class)"""
    classes: list[str | bool | int | float] = []
    events: dict[str, float] = {}
    """figures of events, times in the unit of the name"""
    operating_points: list[dict[str, float]] = []
    """the same figures at thresholds that validation recordings give for several bounds of false alarms"""
    recordings: list[str] = []
    replicates: dict[str, Any] = {}
    """the primary metric's sums over each replicate; see replicate_sums"""


class Evaluated(RestsOn, Cost, Scored):
    """Keys that the evaluation of a cell gives."""


class RowModel(Evaluated, Ended, Asked):
    """The keys of the row of one cell, with their types and defaults, in the order of tables for programs.

    Rows are plain mappings, and may have other keys. Times are seconds unless the name has another unit.
    """


class ReplicatedRow(RowModel):
    """The row of several replicates of a cell, as tables show it, with the keys that a file adds."""

    key: str = ""
    repeats: int | None = None
    """replicates that ended, in whatever way"""
    n_replicates: int | None = None
    replicate_unit: str | None = None
    replicate_scores: list[float] | None = None
    seeds: list[float] | None = None
    score_min: float | None = None
    score_max: float | None = None
    reference_score: float | None = None
    """score against the reference as it was recorded, where `score` is against the true force"""
    reference_ci_low: float | None = None
    reference_ci_high: float | None = None
    reference_scores: list[float] | None = None
    """the same for each replicate"""


def _types(annotation: Any) -> frozenset[type]:
    """Return the types of the members of a union, or of another annotation; a float may be an int."""
    is_union = get_origin(annotation) not in (None, list, dict, Literal)
    members = get_args(annotation) if is_union else (annotation,)
    found = {str if get_origin(one) is Literal else get_origin(one) or one for one in members}
    return frozenset(found | {int} if float in found else found)


FORMAT: Mapping[str, frozenset[type]] = {
    name: _types(field.annotation) for name, field in ReplicatedRow.model_fields.items()
}
"""Types of the values of each key. A row may have other keys, whose values are not checked."""

_ELSEWHERE = ("simulation", "traceback", "log", "plan", "digests")
"""Keys that are large, or of no use to a program; `why`, the page and the cell's own file have them."""
_OF_CELL = [key for key in RowModel.model_fields if key not in _ELSEWHERE]
JSON_KEYS = (*_OF_CELL[:-1], "key", _OF_CELL[-1])
"""Keys of a JSON row, in order."""
OF_REPLICATES = tuple(key for key in ReplicatedRow.model_fields if key not in ("key", *RowModel.model_fields))
"""Keys that follow in a row for all replicates of a cell."""
NESTED = frozenset(key for key in (*JSON_KEYS, *OF_REPLICATES) if not FORMAT[key].isdisjoint({list, dict}))
"""Keys whose values are lists or tables, which are JSON inside a cell of CSV and Parquet."""
