"""The row of a cell: the one description of it, for whoever writes, reads or shows rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict

from tactbench.core.spec.status import Status

TRUE = "true_"
"""How the name of a metric begins whose score is against the force that a simulated rig exerted."""
DIRECTIONS = (" (lower is better)", " (higher is better)")
"""How the name of a metric ends that is the caller's own: a row tells all that a table needs."""


def lower_is_better(metric: str) -> bool:
    """Return whether a metric of a row's score is an error."""
    errors = ("rmse", "mae", "mean_euclidean_error", "excess_square")
    return metric.removeprefix(TRUE) in errors or metric.endswith(DIRECTIONS[0])


MEDIAN_ERROR, HIGH_ERROR = "median error", "95th percentile of the error"
"""Keys of `scores` that stand beside the mean error of a vector: percentiles over the test rows."""

LEAKS = "leaks: "
"""How a stamp begins that says that a score is no measure of the sensor."""


def plural(unit: str) -> str:
    """Return the name of several units of replication."""
    return unit + ("es" if unit.endswith("s") else "s")


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)


class Asked(_Section):
    """What was asked."""

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
    """How it ended."""

    status: Status
    reason: str = ""
    traceback: str = ""
    signal: int | None = None
    log: str = ""


class Scored(_Section):
    """The score, and how much was answered."""

    metric: str = ""
    unit: str = ""
    equivalence: float | None = None
    score: float | None = None
    ci_low: float | None = None
    """None: there are too few units for an interval"""
    ci_high: float | None = None
    """None, with a `ci_low`: the data put no upper bound to an error"""
    ci_method: str = ""
    reference_floor: float | None = None
    """of an error of force: the noise of the reference; None where that is not known"""
    reference_floor_se: float | None = None
    """its standard error"""
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
    """that some fold uses; n_sessions and n_specimens alike"""
    n_sessions: int | None = None
    n_specimens: int | None = None
    """devices, by the label `unit`; None where a recording has none"""
    n_train: int | None = None
    n_test: int | None = None


class Cost(_Section):
    """What it took. What needs single answers to be timed is None where they were not."""

    sim_s: float | None = None
    search_s: float | None = None
    fit_s: float | None = None
    predict_s: float | None = None
    batch_rows: int | None = None
    latency_ms_p50: float | None = None
    latency_ms_p95: float | None = None
    """None also where fewer than 200 calls were measured"""
    latency_ms_max: float | None = None
    latency_n: int | None = None
    answer_delay_ms: float | None = None
    """None also where a part other than the link is not known; see delay"""
    delay_parts_ms: dict[str, float] = {}
    """sampling, link, window, features, prediction: those that are known"""
    threads: int | None = None
    peak_rss_mb: float | None = None
    wall_s: float | None = None
    concurrency: int | None = None
    host: str = ""
    made_by: str = ""


class RestsOn(_Section):
    """What the score rests on, and what else is known of it."""

    simulated: bool = False
    emulated: bool = False
    dagger: bool = False
    stamps: list[str] = []
    findings: list[str] = []
    """what was found in recordings that bears on the score, what of them was left out, classes never trained on"""
    remarks: list[str] = []
    """what recordings say of themselves; what could not be done, and why"""
    assumptions: dict[str, Any] = {}
    plan: list[dict[str, Any]] = []
    counts: dict[str, int] = {}
    """what was left out, and why"""
    chosen: dict[str, float] = {}
    search: list[dict[str, Any]] = []
    """every candidate that was compared on validation data: its parameters, k, score and fold"""
    digests: list[str] = []
    scores: dict[str, float] = {}
    """other metrics, the score on validation data, of each fold and each class"""
    fold_sizes: dict[str, list[int]] = {}
    """training and test rows of each fold, by its name in `scores`"""
    confusion: list[list[int]] | None = None
    """(true class, predicted class)"""
    classes: list[str | bool | int | float] = []
    recordings_right: int | float | None = None
    """test recordings most answers to which are right, of a classification, the mean over replicates; None where one
    has several classes"""
    recordings_asked: int | float | None = None
    """test recordings, of which some were right"""
    events: dict[str, float] = {}
    """figures of events, times in the unit of the name"""
    operating_points: list[dict[str, float]] = []
    """the same at thresholds chosen on validation for several bounds of false alarms"""
    recordings: list[str] = []
    replicates: dict[str, Any] = {}
    """the primary metric's sums over each replicate; see replicate_sums"""


class Evaluated(RestsOn, Cost, Scored):
    """What evaluating a cell tells."""


class RowModel(Evaluated, Ended, Asked):
    """One cell. Times are seconds unless the name says otherwise; a row may have other keys, of which nothing is asked.

    Rows are handed about as plain mappings; this model says what they hold and what stands there before anything is
    known. Tables for programs have its keys in this order: the last base first. Each row has dictionaries and lists of
    its own: pydantic copies empty defaults.
    """


class ReplicatedRow(RowModel):
    """Several replicates of a cell as one row, as tables show them; and what a file adds to a row."""

    key: str = ""
    repeats: int | None = None
    """replicates that ended, however"""
    n_replicates: int | None = None
    replicate_unit: str | None = None
    replicate_scores: list[float] | None = None
    seeds: list[float] | None = None
    score_min: float | None = None
    score_max: float | None = None
    reference_score: float | None = None
    """where `score` is against the true force: that against the reference as it was recorded"""
    reference_ci_low: float | None = None
    reference_ci_high: float | None = None
    reference_scores: list[float] | None = None
    """of the replicates"""


def _members(annotation: Any) -> list[Any]:
    """Return the members of a union; of anything else, itself."""
    is_union = get_origin(annotation) not in (None, list, dict, Literal)
    return list(get_args(annotation)) if is_union else [annotation]


def _types(annotation: Any) -> frozenset[type]:
    found = {str if get_origin(one) is Literal else get_origin(one) or one for one in _members(annotation)}
    return frozenset(found | {int} if float in found else found)


FORMAT: Mapping[str, frozenset[type]] = {
    name: _types(field.annotation) for name, field in ReplicatedRow.model_fields.items()
}
"""Types of what may stand under a key. A row may have other keys, of which nothing is asked."""

_ELSEWHERE = ("simulation", "traceback", "log", "plan", "digests")
"""What is large or of no use to a program: `why`, the page and the cell's own file have it."""
_OF_CELL = [key for key in RowModel.model_fields if key not in _ELSEWHERE]
JSON_KEYS = (*_OF_CELL[:-1], "key", _OF_CELL[-1])
"""Keys of a JSON row, in order."""
OF_REPLICATES = tuple(key for key in ReplicatedRow.model_fields if key not in ("key", *RowModel.model_fields))
"""Keys of a row that stands for all replicates of its cell; they follow."""
NESTED = frozenset(key for key in (*JSON_KEYS, *OF_REPLICATES) if not FORMAT[key].isdisjoint({list, dict}))
"""Keys whose values are lists or tables: JSON inside a cell of CSV and Parquet."""
