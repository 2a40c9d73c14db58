"""One cell: protocol, folds, estimator, score, cost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError
from tactbench.core.evaluation.dataset import Dataset, load_dataset
from tactbench.core.evaluation.delay import NO_LINK, NO_RATE, answer_delay_ms, reading_delay_ms
from tactbench.core.evaluation.fitting import answers as answers_of
from tactbench.core.evaluation.fitting import fit
from tactbench.core.evaluation.interval import LEVEL, score_interval
from tactbench.core.evaluation.metrics import METRICS, Metric, class_f1, confusion, metric_called
from tactbench.core.evaluation.preparation import assigned, builder, prepared
from tactbench.core.evaluation.protocols import ProtocolSpec, protocol_called
from tactbench.core.evaluation.reference_floor import BeyondFloor, beyond_floor, reference_floor, true_force
from tactbench.core.evaluation.replicate_sums import summed
from tactbench.core.evaluation.replication import Units, replicates
from tactbench.core.evaluation.selection import Build, Choice, features_of, select
from tactbench.core.evaluation.splits import (
    SHUFFLED_STAMP,
    Assignment,
    assert_disjoint,
    choose_split,
)
from tactbench.core.evaluation.thread_limit import thread_limit
from tactbench.core.evaluation.timing import (
    AT_LEAST,
    peak_rss_mb,
    single_row_latency_s,
    single_row_preparation_s,
    tail_ms,
)
from tactbench.core.evaluation.unloaded import tare_s
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import Answers, FloatArray, Fold, Part
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.scene import Role
from tactbench.core.spec.task import TaskSpec


@dataclass(frozen=True)
class CellResult:
    """Everything a row and a shard hold about one cell. Times are seconds unless the name says otherwise."""

    metric: str
    score: float
    ci_low: float
    ci_high: float
    ci_level: float
    ci_method: str
    scores: Mapping[str, float]
    """other metrics, the score on validation data, of each fold and each class"""
    fold_sizes: Mapping[str, tuple[int, int]]
    """training and test rows of each fold, by its name in `scores`"""
    confusion: npt.NDArray[np.int64] | None
    """(true class, predicted class)"""
    classes: tuple[Any, ...]
    split: str
    folds: int
    n_recordings: int
    n_sessions: int
    n_train: int
    n_test: int
    counts: Mapping[str, int]
    chosen: Mapping[str, float]
    dagger: bool
    stamps: tuple[str, ...]
    search_s: float
    fit_s: float
    predict_s: float
    batch_rows: int
    latency_ms_p50: float | None
    """None where latency was not measured; `latency_ms_max`, `latency_n` and `answer_delay_ms` alike"""
    latency_ms_p95: float | None
    """None also where fewer than 200 calls were measured"""
    latency_ms_max: float | None
    latency_n: int | None
    answer_delay_ms: float | None
    """None where a part other than the link is not known; see delay"""
    delay_parts_ms: Mapping[str, float]
    """sampling, link, window, features, prediction: those that are known"""
    threads: int
    peak_rss_mb: float | None
    search: tuple[Mapping[str, Any], ...]
    """every candidate that was compared on validation data: its parameters, k, score and fold"""
    sets: Mapping[Role, Answers]
    """answers by role: test always; validation, and for regression train, where the split has one fold"""
    replicates: Mapping[str, Any]
    """the primary metric's sums over each replicate; see replicate_sums"""
    beyond: BeyondFloor | None = None
    """of an error of force: what is beyond the noise of the reference; None where that is not known"""
    true: tuple[float, float, float] | None = None
    """the metric against the force that was exerted, and its interval; None where that is not known"""
    tare_s: float | None = None
    """seconds of unloaded hold that each recording was tared on, the shortest of all; None: none was tared"""
    remarks: tuple[str, ...] = ()
    """what could not be done, and why"""


@dataclass
class _Sum:
    """What the folds add up to."""

    sets: dict[Role, list[Answers]] = field(default_factory=dict)
    scores: dict[str, float] = field(default_factory=dict)
    fold_sizes: dict[str, tuple[int, int]] = field(default_factory=dict)
    chosen: list[Choice] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    folds: int = 0
    search_s: float = 0.0
    fit_s: float = 0.0
    predict_s: float = 0.0
    n_train: int = 0
    model: Estimator | None = None
    test: Any = None
    k: int = 0


def evaluate(
    task: TaskSpec,
    estimator: EstimatorDescriptor,
    params: Mapping[str, Any],
    protocol: str,
    split: str | None,
    recordings: Sequence[Path],
    *,
    seed: int,
    clock: Callable[[], float],
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
    dataset: Dataset | None = None,
    latency: bool = True,
) -> CellResult:
    """Answer `task` from `recordings` with `estimator`, and measure how well and at what cost.

    Parameters
    ----------
    params
        Parameters other than the estimator's defaults; they are not searched.
    protocol, split
        How recordings become X and y, and what is kept apart; None chooses the task's first fitting split.
    seed
        Decides everything random: the same seed gives the same score in any process.
    clock
        Seconds, monotonic.
    threads
        Threads the estimator and BLAS may use.
    progress
        Told what is being done.
    dataset
        The recordings, if they have been read already.
    latency
        Whether to measure how long the answer to one row takes.

    Raises
    ------
    NotApplicable
        If the question cannot be asked of these recordings.
    UsageError
        If a parameter is unknown or the split cannot be served.
    DataError
        If a set is empty, has one class only, or its labels never change.
    """
    say = progress or (lambda _: None)
    data = dataset if dataset is not None else load_dataset(task, recordings)
    rules = protocol_called(protocol)
    metric = metric_called(task.metric)
    chosen_split = choose_split(task, rules, data, split)
    if rules.tare:
        tare_s(data)  # refuses recordings of which only some can be tared
    assignments = assigned(task, estimator, data, chosen_split, seed)
    assert_disjoint(assignments)
    build = builder(estimator, params, task, seed, threads)
    counts: Counter[str] = Counter(data.counts)
    total = _Sum()
    with thread_limit(threads):
        for number, assignment in enumerate(assignments):
            say(f"{estimator.name}: {assignment.name}")
            alone = len(assignments) == 1
            _fold(total, number, assignment, estimator, params, build, data, rules, metric, counts, clock, alone)
        if total.model is None:
            raise DataError("No fold could be made of these recordings.", hint="Choose another --split.")
        waits = _latency_ms(total.model, features_of(total.test, estimator), clock) if latency else {}
        late = _delay(total, estimator, data, rules, waits, clock)
    return _result(task, rules, metric, chosen_split, data, total, counts, waits, late, seed, threads)


def _latency_ms(model: Estimator, X: FloatArray, clock: Callable[[], float]) -> dict[str, Any]:
    waits = single_row_latency_s(model, X, clock)
    p95, largest = tail_ms(waits)
    return {
        "latency_ms_p50": float(1e3 * np.median(waits)), "latency_ms_p95": p95, "latency_ms_max": largest,
        "latency_n": len(waits),
    }  # fmt: skip


class _Delay(NamedTuple):
    parts_ms: dict[str, float]
    total_ms: float | None
    remarks: tuple[str, ...]


def _delay(
    total: _Sum,
    estimator: EstimatorDescriptor,
    data: Dataset,
    rules: ProtocolSpec,
    latency: Mapping[str, Any],
    clock: Callable[[], float],
) -> _Delay:
    """Return how late answers of the last fold's model are: the one whose latency was measured, if it was."""
    parts: dict[str, float] = {}
    remarks: tuple[str, ...] = ()
    if estimator.looks_at == "features":
        parts, remarks = reading_delay_ms(data, rules, total.k)
        if latency:
            # A median needs no more calls, and a row keeps nothing else of them.
            ready_s = single_row_preparation_s(total.test.X, total.k, clock, tared=rules.tare, at_most=AT_LEAST)
            parts["features"] = float(1e3 * np.median(ready_s))
    if latency:
        parts["prediction"] = latency["latency_ms_p50"]
    else:
        remarks = tuple(one for one in remarks if one not in (NO_LINK, NO_RATE))  # there is no delay to speak of
    return _Delay(parts, answer_delay_ms(parts, estimator.looks_at), remarks)


def _fold(
    total: _Sum,
    number: int,
    assignment: Assignment,
    estimator: EstimatorDescriptor,
    params: Mapping[str, Any],
    build: Build,
    data: Dataset,
    rules: ProtocolSpec,
    metric: Metric,
    counts: Counter[str],
    clock: Callable[[], float],
    alone: bool,
) -> None:
    began = clock()
    choice = select(estimator, params, build, data, rules, assignment, metric, counts)
    total.search_s += clock() - began
    k = choice.k if choice else estimator.window_grid[0]
    fold = prepared(assignment, data, rules, k, counts)
    _worth_answering(fold, data)
    X_train, X_test = features_of(fold.train, estimator), features_of(fold.test, estimator)
    model = build(choice.params if choice else {})
    began = clock()
    fit(model, X_train, fold.train.y, estimator.name, counts)
    total.fit_s += clock() - began
    n_classes = len(data.classes)
    began = clock()
    predicted = answers_of(model, X_test, estimator.name, n_classes)
    total.predict_s += clock() - began
    total.scores[f"fold {fold.name}"] = metric.of(fold.test.y, predicted, n_classes)
    total.fold_sizes[f"fold {fold.name}"] = (len(fold.train), len(fold.test))
    _add(total, "test", fold.test, predicted, number, data)
    if alone and not n_classes:
        fitted = answers_of(model, X_train, estimator.name, n_classes)
        _add(total, "train", fold.train, fitted, number, data)
    if fold.validation is not None and len(fold.validation):
        on_validation = answers_of(model, features_of(fold.validation, estimator), estimator.name, n_classes)
        if not choice:
            total.scores["validation"] = metric.of(fold.validation.y, on_validation, n_classes)
        if alone:
            _add(total, "validation", fold.validation, on_validation, number, data)
    if choice:
        total.chosen.append(choice)
        total.names.append(fold.name)
        total.scores["validation"] = choice.score
    total.n_train += len(fold.train)
    total.folds += 1
    total.model, total.test, total.k = model, fold.test, k


def _add(total: _Sum, role: Role, asked: Part, given: npt.NDArray[Any], number: int, data: Dataset) -> None:
    """Keep what was answered, with time and reference force beside it."""
    force = np.full(len(asked), np.nan)
    for place in np.unique(asked.recording):
        table = data.tables[place]
        if table.force is not None:
            mine = asked.recording == place
            force[mine] = table.force[np.searchsorted(table.row, asked.row[mine])]
    fold = np.full(len(asked), number, dtype=np.int64)
    answered = Answers(asked.y, given, asked.recording, asked.row, fold, asked.time_s, force)
    total.sets.setdefault(role, []).append(answered)


def _joined(folds: Sequence[Answers]) -> Answers:
    names = [column.name for column in fields(Answers)]
    return Answers(**{name: np.concatenate([getattr(one, name) for one in folds]) for name in names})


def _worth_answering(fold: Fold, data: Dataset) -> None:
    for what, one in (("training", fold.train), ("test", fold.test)):
        if len(one) == 0:
            raise DataError(
                f"The {what} set of fold {fold.name!r} has no labelled row.", hint="Choose another --split."
            )
    values = np.unique(fold.train.y)
    if len(values) < 2:
        only = data.classes[int(values[0])] if data.classes else values[0]
        raise DataError(
            f"All training labels of fold {fold.name!r} are {only}: there is nothing to learn.",
            hint="Choose another --split, or check the label column with `tactbench inspect`.",
        )


def _result(
    task: TaskSpec,
    rules: ProtocolSpec,
    metric: Metric,
    split: str,
    data: Dataset,
    total: _Sum,
    counts: Counter[str],
    latency: Mapping[str, Any],
    late: _Delay,
    seed: int,
    threads: int,
) -> CellResult:
    sets = {role: _joined(folds) for role, folds in total.sets.items()}
    tested = sets["test"]
    y, predicted, recording, row = tested.y_true, tested.y_pred, tested.recording, tested.row
    n_classes = len(data.classes)
    held = tare_s(data) if rules.tare else 0.0
    floor, no_floor = reference_floor(task, metric, data, tested)
    truth = true_force(task, data, tested) if metric.kind == "regression" else None
    unit = replicates(data, task, split, y, recording, row)
    score = metric.of(y, predicted, n_classes)
    if not np.isfinite(score):
        raise DataError(
            f"The {metric.name} of {len(y)} test rows is undefined: their labels never change.",
            hint="Choose another --split.",
        )
    interval = score_interval(metric, y, predicted, recording, unit.codes, unit.name, n_classes, seed)
    scores = dict(total.scores)
    for other in METRICS.values():
        if other.kind == task.kind and other is not metric:
            scores[other.name] = other.of(y, predicted, n_classes)
    table = None
    if n_classes:
        sums = metric.rows(y, predicted, n_classes).sum(axis=0)
        table = confusion(sums, n_classes).astype(np.int64)
        for label, value in zip(data.classes, class_f1(sums, n_classes), strict=True):
            scores[f"F1 of {label}"] = float(value)
    # R² of labels that never change is undefined; a key that is not there says so, NaN would not even be JSON.
    scores = {name: value for name, value in scores.items() if np.isfinite(value)}
    return CellResult(
        metric=metric.name,
        score=score,
        ci_low=interval.low,
        ci_high=interval.high,
        ci_level=LEVEL,
        ci_method=interval.method,
        scores=scores,
        fold_sizes=total.fold_sizes,
        confusion=table,
        classes=data.classes,
        split=split,
        folds=total.folds,
        n_recordings=len(data.tables),
        n_sessions=len({meta.session for meta in data.metas}),
        n_train=total.n_train,
        n_test=len(y),
        counts=dict(counts),
        chosen=_chosen(total.chosen, total.names),
        dagger=rules.uses_test_statistics,
        stamps=(SHUFFLED_STAMP,) if split == "shuffled" else (),
        search_s=total.search_s,
        fit_s=total.fit_s,
        predict_s=total.predict_s,
        batch_rows=len(y),
        latency_ms_p50=latency.get("latency_ms_p50"),
        latency_ms_p95=latency.get("latency_ms_p95"),
        latency_ms_max=latency.get("latency_ms_max"),
        latency_n=latency.get("latency_n"),
        answer_delay_ms=late.total_ms,
        delay_parts_ms=late.parts_ms,
        threads=threads,
        peak_rss_mb=peak_rss_mb(),
        search=_search(total.chosen, total.names),
        sets=sets,
        replicates=summed(metric, tested, unit, data, floor),
        beyond=None if floor is None else beyond_floor(floor, tested, unit, seed),
        true=None if truth is None else _against(truth, metric, tested, unit, seed),
        tare_s=held or None,
        remarks=tuple(one for one in (no_floor, NOT_TARED if rules.tare and not held else "", *late.remarks) if one),
    )


NOT_TARED = "not tared: no recording states an unloaded hold"


def _against(truth: FloatArray, metric: Metric, tested: Answers, unit: Units, seed: int) -> tuple[float, float, float]:
    """Return the metric against (n,) another truth than the recorded one, and its interval."""
    found = score_interval(metric, truth, tested.y_pred, tested.recording, unit.codes, unit.name, 0, seed)
    return metric.of(truth, tested.y_pred), found.low, found.high


def _chosen(choices: Sequence[Choice], folds: Sequence[str]) -> dict[str, float]:
    """Return what was chosen; fold by fold where folds chose differently, since a median is what nobody chose."""
    chosen: dict[str, float] = {}
    each = [{**choice.params, "k": choice.k} for choice in choices]
    for name in each[0] if each else ():
        values = [params[name] for params in each]
        if not all(isinstance(value, int | float) for value in values):
            continue
        if len(set(values)) == 1:
            chosen[name] = float(values[0])
        else:
            chosen |= {f"{name} of fold {fold}": float(value) for fold, value in zip(folds, values, strict=True)}
    return chosen


def _search(choices: Sequence[Choice], folds: Sequence[str]) -> tuple[Mapping[str, Any], ...]:
    """Return every candidate of every fold as one flat mapping."""
    return tuple(
        {**candidate.params, "k": candidate.k, "score": candidate.score, "fold": fold}
        for choice, fold in zip(choices, folds, strict=True)
        for candidate in choice.compared
    )
