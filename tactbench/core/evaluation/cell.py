"""Evaluate one cell (an estimator on one task and sensor): compute score, interval and cost from recordings.

:func:`load_task` makes the folds; :func:`evaluate_cell` fits and scores, also any object with ``fit`` and ``predict``.
"""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from tactbench.core.errors import DataError, PluginContractError
from tactbench.core.evaluation.dataset import LARGEST, Dataset, alike
from tactbench.core.evaluation.delay import (
    CALLS_OF_P95,
    Clock,
    answer_delay_ms,
    calls_s,
    features_s,
    peak_rss_mb,
    stated_delay_ms,
)
from tactbench.core.evaluation.event_answers import EventRules
from tactbench.core.evaluation.fitting import (
    AnsweredFold,
    Configured,
    FittedFold,
    answered_fold,
    builder,
    features_of,
    fitted_fold,
    one_model_a_component,
    routed,
)
from tactbench.core.evaluation.folds import TaskData, load_task
from tactbench.core.evaluation.interval import Interval, replicates, score_interval, summed
from tactbench.core.evaluation.leaks import copied_channels, leak_stamps
from tactbench.core.evaluation.metrics import METRICS, Metric, class_f1, confusion, metric_called, vector_details
from tactbench.core.evaluation.reference_floor import beyond_floor, reference_floor, true_force
from tactbench.core.evaluation.sets import tare_s
from tactbench.core.evaluation.splits import (
    SHUFFLED_STAMP,
    SHUFFLED_WHOLE_STAMP,
    OwnSplit,
    over_rows,
)
from tactbench.core.evaluation.summaries import band_limit, clocked, with_windows
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import Answers
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.row import Cost, Evaluated
from tactbench.core.spec.scene import Role
from tactbench.core.spec.task import TaskSpec, VectorTarget
from tactbench.core.thread_limit import thread_limit


@dataclass(frozen=True)
class CellContext:
    """Task, estimator, protocol, split and options by which one cell is evaluated, without its recordings."""

    task: TaskSpec
    estimator: EstimatorDescriptor
    params: Mapping[str, Any]
    """Parameters set in place of the estimator's defaults; they are not searched."""
    protocol: str
    """Name of the protocol, by which recordings become features X and labels y."""
    split: str | OwnSplit | None
    """Name of the split; None for the first of the task's splits for which the recordings suffice."""
    seed: int
    """Seed of all random numbers; the same seed gives the same score in any process."""
    clock: Clock
    threads: int = 1
    """Number of threads of the estimator and of BLAS."""
    latency: bool = True
    """True to measure the time of ``predict`` on one row."""
    given: Estimator | None = None
    """Object with ``fit`` and ``predict`` to evaluate in place of `estimator`."""
    metric: Metric | None = None
    """Metric of the score; None for the task's own metric."""
    fit_params: Mapping[str, Any] = field(default_factory=dict)
    """Further arguments of the ``fit`` of `given`; see :func:`routed`."""
    window: int = 0
    step: int = 1
    """Rows of a window and rows between the ends of two windows, as in :func:`load_task`."""


class Result(Evaluated):
    """Result row of an evaluated cell (score, interval, cost …), with the answers behind the score."""

    split: str
    score: float
    sets: dict[Role, Any] = Field(exclude=True)
    """:class:`Answers` by role: always test; of a split of one fold also validation and, for regression, train."""


def evaluate_cell(context: CellContext, recordings: Sequence[Path] | Dataset) -> Result:
    """Load the recordings of a cell (files, or a data set read from them) and evaluate its estimator on them.

    Raises
    ------
    NotApplicable
        If the task, protocol or split does not suit these recordings.
    UsageError
        If a parameter is unknown or the recordings cannot be split as requested.
    DataError
        If a set is empty, has one class only, or its labels never change.
    """
    task, descriptor, given = context.task, context.estimator, context.given
    data = load_task(
        task, recordings, context.protocol, context.split, estimator=descriptor, seed=context.seed,
        window=context.window, step=context.step,
    )  # fmt: skip
    if given is None:
        build = builder(descriptor, context.params, task, context.seed, context.threads)
    else:
        descriptor = descriptor.model_copy(update={"name": type(given).__name__})
        build = one_model_a_component(task, lambda _: copy.deepcopy(given))
    descriptor = with_windows(descriptor, task, data.rules)
    fit_params = {} if given is None else routed(given, data, context.fit_params)
    metric = context.metric or metric_called(task.metric)
    rules = EventRules.of(task, descriptor.threshold) if task.kind == "events" else None
    counts = Counter(data.data.counts)
    estimator = Configured(descriptor, build, context.params, fit_params, metric, rules, context.clock, counts)
    answered: list[AnsweredFold] = []
    with thread_limit(context.threads):
        for number, assignment in enumerate(data.assignments):
            fitted = fitted_fold(estimator, data, assignment)
            answered.append(answered_fold(estimator, data, fitted, number))
        cost, delay_remark = _cost(fitted, answered, data, descriptor, context)
    return _result(answered, data, estimator, cost, delay_remark)


def _cost(
    fitted: FittedFold,
    answered: Sequence[AnsweredFold],
    data: TaskData,
    descriptor: EstimatorDescriptor,
    context: CellContext,
) -> tuple[Cost, str]:
    """Return the cost of all folds, with the answer delay of the last fold's model, and a remark on the delay."""
    parts, remark = stated_delay_ms(data, descriptor, max(fitted.k, data.window - 1))
    times: dict[str, Any] = dict.fromkeys(("latency_ms_p50", "latency_ms_p95", "latency_n"))
    times |= {key: sum(one.spent[key] for one in answered) for key in answered[0].spent}
    if context.latency:
        rows = features_of(fitted.fold.test, descriptor)[:, None]  # each a set of one row
        waits_ms = 1e3 * calls_s(rows, fitted.model.predict, context.clock)
        p95 = float(np.quantile(waits_ms, 0.95)) if len(waits_ms) >= CALLS_OF_P95 else None
        times |= {"latency_ms_p50": float(np.median(waits_ms)), "latency_ms_p95": p95, "latency_n": len(waits_ms)}
        ready_s = features_s(data, descriptor, fitted.fold.test.X, fitted.k, context.clock)
        parts |= {} if ready_s is None else {"features": 1e3 * ready_s}
        parts["prediction"] = times["latency_ms_p50"]
    cost = Cost(
        **times,
        answer_delay_ms=answer_delay_ms(parts, descriptor.looks_at),
        delay_parts_ms=parts,
        threads=context.threads,
        peak_rss_mb=peak_rss_mb(),
    )
    return cost, remark


def _result(
    answered: Sequence[AnsweredFold], data: TaskData, estimator: Configured, cost: Cost, delay_remark: str
) -> Result:
    task, made, metric, rules = data.task, data.data, estimator.metric, estimator.events
    classes = [] if rules else list(made.classes)
    n_classes = len(classes)
    sets = {role: _joined([one.sets[role] for one in answered]) for role in answered[0].sets}
    tested = sets["test"]
    score = metric.of(tested.y_true, tested.y_pred, n_classes)
    if not np.isfinite(score):
        _refuse(estimator.descriptor.name, metric, score, tested)
    unit = replicates(made, data.unit, tested)
    scores = {f"fold {one.name}": one.score for one in answered}
    if answered[-1].validation is not None:
        scores["validation"] = answered[-1].validation
    for other in METRICS.values():
        if other.kind == task.kind and other.vector == metric.vector and other is not metric:
            scores[other.name] = other.of(tested.y_true, tested.y_pred, n_classes)
    remarks = [band_limit(clocked(data.recorded.tables[0], data.rules))] if task.answer_per == "frame" else []
    if data.held_back:
        remarks.append("no recording has the role validation: thresholds are chosen on a share of the training groups")
    beside: dict[str, Any] = {}
    held = truth = None
    if metric.kind == "regression":
        if isinstance(task.target, VectorTarget):
            scores |= vector_details(task.target, tested.y_true, tested.y_pred)
        floor, no_floor = reference_floor(task, metric, data.recorded if data.window else made, tested)
        remarks.append(no_floor)
        truth = None if metric.function else true_force(task, made, tested)
        if floor is not None:
            held = floor.by_replicate(tested, unit.codes)
            beside |= {"reference_floor": floor.value, "reference_floor_se": floor.standard_error}
            beside["score_beyond_floor"], interval = beyond_floor(floor, tested, unit)
            beside |= _ends("beyond_floor_", interval)
        if truth is not None:
            interval = score_interval(metric, truth, tested.y_pred, unit, 0)
            beside |= {"true_score": metric.of(truth, tested.y_pred), **_ends("true_", interval)}
    elif rules is None:
        sums = METRICS["accuracy"].rows(tested.y_true, tested.y_pred, n_classes).sum(axis=0)
        beside["confusion"] = confusion(sums, n_classes).astype(np.int64).tolist()
        scores |= {f"F1 of {label}": float(one) for label, one in zip(classes, class_f1(sums, n_classes), strict=True)}
    if rules is not None:
        detected = [one for fold in answered for one in fold.detected]
        parts_ms = cost.delay_parts_ms
        compute_s = (parts_ms.get("features", 0.0) + parts_ms["prediction"]) / 1e3 if "prediction" in parts_ms else None
        beside["events"] = rules.figures(detected, compute_s)
        if not beside["events"]["alarms"]:
            remarks.append("never alarms at its operating point")
    held_s = tare_s(data.recorded) if data.rules.tare else 0.0
    if data.rules.tare and not held_s:
        remarks.append("not tared: no recording states an unloaded hold")
    remarks.append(delay_remark)
    took_part, stamps = _part_taken(data)
    specimens = {meta.labels.get("unit") for meta in took_part}
    interval = score_interval(metric, tested.y_true, tested.y_pred, unit, n_classes)
    return Result(
        metric=metric.name,
        score=score,
        ci_method=interval.method,
        # R² of labels that never change is undefined and left out: NaN is no JSON.
        scores={name: value for name, value in scores.items() if np.isfinite(value)},
        n_recordings=len(took_part),
        n_sessions=len({meta.session for meta in took_part}),
        n_specimens=None if None in specimens else len(specimens),
        n_train=sum(one.sizes[0] for one in answered),
        n_test=len(tested),
        fold_sizes={f"fold {one.name}": list(one.sizes) for one in answered},
        split=data.split,
        sets=sets,
        replicates=summed(metric, tested, unit, n_classes, held, truth) if data.unit else {},
        classes=classes,
        chosen=_chosen(answered, rules),
        counts=dict(estimator.counts),
        dagger=data.rules.three_sigma,
        stamps=stamps,
        findings=[*data.recorded.findings, *_groups_alike(data), *_untrained(answered)],
        tare_s=held_s or None,
        remarks=[one for one in remarks if one],
        **cost.model_dump(exclude_unset=True),
        **_ends("", interval),
        **beside,
    )


def _ends(prefix: str, interval: Interval) -> dict[str, Any]:
    return {f"{prefix}ci_low": interval.low, f"{prefix}ci_high": interval.high}


def _joined(folds: Sequence[Answers]) -> Answers:
    names = [column.name for column in fields(Answers)]
    return Answers(**{name: np.concatenate([getattr(one, name) for one in folds]) for name in names})


def _refuse(estimator: str, metric: Metric, score: float, tested: Answers) -> None:
    """Raise an error for a score that is not finite: PluginContractError if predictions are too large, or DataError."""
    if metric.function is None and np.isinf(score):
        raise PluginContractError(
            f"The estimator {estimator!r} answered with numbers up to {np.abs(tested.y_pred).max():.3g}: the "
            f"{metric.name} overflows.",
            hint=f"Its predict(X) must return numbers below {LARGEST:g}, in the unit of the labels.",
        )
    why = "not a finite number" if metric.function else "undefined: all test labels are equal"
    raise DataError(f"The {metric.name} of {len(tested)} test rows is {why}.", hint="Choose another split or metric.")


def _part_taken(data: TaskData) -> tuple[list[RecordingMeta], list[str]]:
    """Return the recordings that a fold uses, and warnings of leaks."""
    recorded = data.recorded
    folds = [over_rows(one, data.data, recorded) for one in data.assignments]
    sets = [mask for one in folds for mask in (one.train, one.test, one.validation) if mask is not None]
    used = np.logical_or.reduce(sets)
    took_part = [recorded.metas[place] for place in np.unique(recorded.recording[used & recorded.labelled]).tolist()]
    if data.split != "shuffled":
        stamps = (*data.stamps, *leak_stamps(recorded, folds))
    else:
        stamps = (SHUFFLED_WHOLE_STAMP if recorded.whole else SHUFFLED_STAMP,)
    stamped = [*copied_channels(recorded), *stamps]
    return took_part, stamped


def _groups_alike(data: TaskData) -> Iterator[str]:
    """Yield a text on labels of the split's groups that differ only by case or spaces: probably the same group."""
    name = data.assignments[0].groups
    labels = np.unique(data.data.column(lambda table: table.groups.get(name, "")))
    return alike(f"values of {name}", labels.tolist())


def _untrained(answered: Sequence[AnsweredFold]) -> Iterator[str]:
    """Yield a text that names the test classes without a training row, which no estimator can predict, by fold."""
    folds: dict[str, list[str]] = {}
    for one in answered:
        for label in one.untrained:
            folds.setdefault(str(label), []).append(one.name)
    named = [f"{label!r} in {', '.join(names)}" for label, names in sorted(folds.items())]
    if named:
        yield f"tested but never trained on: {'; '.join(named)}"


def _chosen(answered: Sequence[AnsweredFold], rules: EventRules | None) -> dict[str, float]:
    """Return the parameters chosen on validation data by name, with the fold's name too where folds differ.

    An infinite threshold, which no score reaches, is left out.
    """
    each: dict[str, dict[str, float]] = {}
    for one in answered:
        values = {**one.choice.params, "k": one.choice.k} if one.choice else {}
        if rules is not None and rules.own_threshold is None:
            values["threshold"] = one.detected[0].threshold
        for name, value in values.items():
            if isinstance(value, int | float) and np.isfinite(value):
                each.setdefault(name, {})[f"{name} of fold {one.name}"] = float(value)
    chosen: dict[str, float] = {}
    for name, of in each.items():
        alike = len(of) == len(answered) and len(set(of.values())) == 1
        chosen |= {name: next(iter(of.values()))} if alike else of
    return chosen
