"""The row of a cell: names, types and meanings of all its keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict

Status = Literal["done", "failed", "crashed", "timeout", "out-of-memory", "skipped"]
STATUSES: tuple[Status, ...] = get_args(Status)
"""Statuses of a cell: every planned cell ends as one row that has one of these statuses."""
STOPPED: frozenset[Status] = frozenset({"failed", "crashed", "timeout", "out-of-memory"})
"""Statuses of failed cells; a cell with such a status makes the exit code 1."""

TRUE = "true_"
"""Prefix of the names of metrics that compare with the true force that a simulated rig exerted."""
DIRECTIONS = (" (lower is better)", " (higher is better)")
"""Suffixes of the name of a user's own metric, by whether a lower or a higher value is better."""


def lower_is_better(metric: str) -> bool:
    """Return True if a metric of a row's score is an error, for which lower is better."""
    errors = ("rmse", "mae", "mean_euclidean_error", "excess_square")
    return metric.removeprefix(TRUE) in errors or metric.endswith(DIRECTIONS[0])


MEDIAN_ERROR, HIGH_ERROR = "median error", "95th percentile of the error"
"""Keys of `scores` for vectors beside their mean error: percentiles of the error over the test rows."""

LEAKS = "leaks: "
"""Prefix of remarks on a score whose training data leak into its test data."""


def plural(unit: str) -> str:
    """Return the plural of the name of a unit of replication."""
    return unit + ("es" if unit.endswith("s") else "s")


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)


class Asked(_Section):
    """Keys that identify a cell: sensor, task, rig, protocol, split and estimator."""

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
    """Status of a cell, and the reason for it."""

    status: Status
    reason: str = ""
    traceback: str = ""
    signal: int | None = None
    log: str = ""


class Scored(_Section):
    """The score, and the amount of data from which it was computed."""

    metric: str = ""
    unit: str = ""
    equivalence: float | None = None
    score: float | None = None
    ci_low: float | None = None
    """lower end of the score's interval; None: there are too few units for an interval"""
    ci_high: float | None = None
    """upper end of the score's interval; None beside a `ci_low`: the data bound an error from below only"""
    ci_method: str = ""
    reference_floor: float | None = None
    """noise of the reference, for a score that is an error of force; None: not known"""
    reference_floor_se: float | None = None
    """standard error of `noise_floor`"""
    score_beyond_floor: float | None = None
    beyond_floor_ci_low: float | None = None
    beyond_floor_ci_high: float | None = None
    true_score: float | None = None
    """the metric against the true force of a simulated rig; None: not known"""
    true_ci_low: float | None = None
    true_ci_high: float | None = None
    tare_s: float | None = None
    """shortest unloaded time at the start of a recording over which it was tared [s]; None: no recording was tared"""
    baseline: float | None = None
    published: float | None = None
    published_reference: str = ""
    published_remark: str = ""
    n_recordings: int | None = None
    """number of recordings that are in any fold; `n_sessions` and `n_specimens` count the same way"""
    n_sessions: int | None = None
    n_specimens: int | None = None
    """number of devices, by the label `unit`; None: a recording lacks the label"""
    n_train: int | None = None
    n_test: int | None = None


class Cost(_Section):
    """Times and memory of the cell. Keys that need single predictions are None if these were not timed."""

    sim_s: float | None = None
    search_s: float | None = None
    fit_s: float | None = None
    predict_s: float | None = None
    batch_rows: int | None = None
    latency_ms_p50: float | None = None
    latency_ms_p95: float | None = None
    """95th percentile; None also for fewer than 200 measured calls"""
    latency_n: int | None = None
    answer_delay_ms: float | None = None
    """sum of the parts; None also if a part other than the link is not known"""
    delay_parts_ms: dict[str, float] = {}
    """known parts of the delay of an answer [ms]: sampling, link, window, features, prediction"""
    threads: int | None = None
    peak_rss_mb: float | None = None
    wall_s: float | None = None
    concurrency: int | None = None
    host: str = ""
    made_by: str = ""


class RestsOn(_Section):
    """Data, assumptions and choices on which the score depends."""

    simulated: bool = False
    emulated: bool = False
    dagger: bool = False
    stamps: list[str] = []
    findings: list[str] = []
    """findings in the recordings that affect the score, data left out, classes without training data"""
    remarks: list[str] = []
    """remarks of the recordings, and reasons for evaluations that were not possible"""
    assumptions: dict[str, Any] = {}
    plan: list[dict[str, Any]] = []
    counts: dict[str, int] = {}
    """numbers of items left out, by reason"""
    chosen: dict[str, float] = {}
    digests: list[str] = []
    scores: dict[str, float] = {}
    """other metrics: the score on validation data, for each fold and for each class"""
    fold_sizes: dict[str, list[int]] = {}
    """numbers of training and test rows of each fold, by its name in `scores`"""
    confusion: list[list[int]] | None = None
    """numbers of answers for each pair (true class, predicted class)"""
    classes: list[str | bool | int | float] = []
    events: dict[str, float] = {}
    """figures of events by name; times are in the unit in the name"""
    recordings: list[str] = []
    replicates: dict[str, Any] = {}
    """sums of the primary metric over each replicate; see tactbench.core.evaluation.interval"""


class Evaluated(RestsOn, Cost, Scored):
    """Keys of the row that the evaluation of a cell adds."""


class RowModel(Evaluated, Ended, Asked):
    """The keys of the row of one cell, with their types and defaults, in the order of tables for programs.

    Rows are plain mappings, and may have other keys. Times are seconds unless the name has another unit.
    """


class ReplicatedRow(RowModel):
    """The row of several replicates of a cell, as tables show it, with the additional keys of a JSON file."""

    key: str = ""
    repeats: int | None = None
    """number of replicates that ended, with any status"""
    n_replicates: int | None = None
    replicate_unit: str | None = None
    replicate_scores: list[float] | None = None
    seeds: list[float] | None = None
    score_min: float | None = None
    score_max: float | None = None
    reference_score: float | None = None
    """score against the recorded reference, if `score` is against the true force"""
    reference_ci_low: float | None = None
    reference_ci_high: float | None = None
    reference_scores: list[float] | None = None
    """`recorded_score` of each replicate"""


def _types(annotation: Any) -> frozenset[type]:
    """Return the types of a union's members, or the single type of another annotation; int is added to float."""
    is_union = get_origin(annotation) not in (None, list, dict, Literal)
    members = get_args(annotation) if is_union else (annotation,)
    found = {str if get_origin(one) is Literal else get_origin(one) or one for one in members}
    return frozenset(found | {int} if float in found else found)


FORMAT: Mapping[str, frozenset[type]] = {
    name: _types(field.annotation) for name, field in ReplicatedRow.model_fields.items()
}
"""Types of the values by key. A row may have other keys, whose values are not checked."""

_ELSEWHERE = ("simulation", "traceback", "log", "plan", "digests")
"""Keys that are too large for, or of no use to, a program; the page, `why` and the cell's own file contain them."""
_OF_CELL = [key for key in RowModel.model_fields if key not in _ELSEWHERE]
JSON_KEYS = (*_OF_CELL[:-1], "key", _OF_CELL[-1])
"""Keys of a JSON row in their order."""
OF_REPLICATES = tuple(key for key in ReplicatedRow.model_fields if key not in ("key", *RowModel.model_fields))
"""Additional keys of a row that stands for all replicates of a cell."""
