"""The row of a cell: the one description of it, for whoever writes, reads or shows rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict

from tactbench.core.spec.status import Status

LOWER_IS_BETTER = frozenset({"rmse", "mae", "mean_euclidean_error"})
"""Metrics of a row's score that are errors."""

MEDIAN_ERROR, HIGH_ERROR = "median error", "95th percentile of the error"
"""Keys of `scores` that stand beside the mean error of a vector: percentiles over the test rows."""

LEAKS = "leaks: "
"""How a stamp begins that says that a score is no measure of the sensor."""

Numbers = dict[str, float]


def plural(unit: str) -> str:
    """Return the name of several units of replication."""
    return unit + ("es" if unit.endswith("s") else "s")


class RowModel(BaseModel):
    """One cell. Times are seconds unless the name says otherwise; a row may have other keys, of which nothing is asked.

    Rows are handed about as plain mappings; this model says what they hold, what stands there before anything is known,
    and checks what comes from a file. Tables for programs have its keys in this order. Each row has dictionaries and
    lists of its own: pydantic copies empty defaults.
    """

    model_config = ConfigDict(extra="allow", strict=True, allow_inf_nan=False, defer_build=True)

    # What was asked
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
    repeat: int = 1
    repeats: int = 1
    seed: int = 0
    simulation: dict[str, Any] = {}
    # How it ended
    status: Status
    reason: str = ""
    traceback: str = ""
    signal: int | None = None
    log: str = ""
    # The score
    metric: str = ""
    unit: str = ""
    equivalence: float | None = None
    score: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    ci_method: str = ""
    reference_floor: float | None = None
    score_beyond_floor: float | None = None
    beyond_floor_ci_low: float | None = None
    beyond_floor_ci_high: float | None = None
    true_score: float | None = None
    true_ci_low: float | None = None
    true_ci_high: float | None = None
    tare_s: float | None = None
    baseline: float | None = None
    published: float | None = None
    published_reference: str = ""
    published_remark: str = ""
    n_recordings: int | None = None
    n_sessions: int | None = None
    n_specimens: int | None = None
    n_train: int | None = None
    n_test: int | None = None
    # What it cost
    sim_s: float | None = None
    search_s: float | None = None
    fit_s: float | None = None
    predict_s: float | None = None
    batch_rows: int | None = None
    latency_ms_p50: float | None = None
    latency_ms_p95: float | None = None
    latency_ms_max: float | None = None
    latency_n: int | None = None
    answer_delay_ms: float | None = None
    delay_parts_ms: Numbers = {}
    threads: int | None = None
    peak_rss_mb: float | None = None
    wall_s: float | None = None
    concurrency: int | None = None
    host: str = ""
    made_by: str = ""
    # What it rests on
    simulated: bool = False
    emulated: bool = False
    dagger: bool = False
    stamps: list[str] = []
    remarks: list[str] = []
    assumptions: dict[str, Any] = {}
    plan: list[dict[str, Any]] = []
    counts: Numbers = {}
    chosen: Numbers = {}
    search: list[dict[str, Any]] = []
    digests: list[str] = []
    scores: Numbers = {}
    fold_sizes: dict[str, Any] = {}
    confusion: list[list[Any]] | None = None
    classes: list[str | bool | int | float] = []
    recordings_right: float | None = None
    recordings_asked: float | None = None
    events: Numbers = {}
    operating_points: list[Numbers] = []
    recordings: list[str] = []
    replicates: dict[str, Any] = {}


class ReplicatedRow(RowModel):
    """Several replicates of a cell as one row, as tables show them; and what a file adds to a row."""

    key: str = ""
    n_replicates: int | None = None
    replicate_unit: str | None = None
    replicate_scores: list[float] | None = None
    seeds: list[float] | None = None
    score_min: float | None = None
    score_max: float | None = None


def _members(annotation: Any) -> list[Any]:
    """Return the members of a union; of anything else, itself."""
    is_union = get_origin(annotation) not in (None, list, dict, Literal)
    return list(get_args(annotation)) if is_union else [annotation]


def _types(annotation: Any) -> frozenset[type]:
    found = {str if get_origin(one) is Literal else get_origin(one) or one for one in _members(annotation)}
    return frozenset(found | {int} if float in found else found)


FORMAT: Mapping[str, frozenset[type]] = {name: _types(kind) for name, kind in get_type_hints(ReplicatedRow).items()
                                         if name in ReplicatedRow.model_fields}  # fmt: skip
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
