"""One cell: protocol, folds, estimator, score, cost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError
from tactbench.core.evaluation.dataset import Dataset, load_dataset
from tactbench.core.evaluation.delay import NO_LINK, NO_RATE, answer_delay_ms, reading_delay_ms
from tactbench.core.evaluation.event_answers import EventAnswers, Items, state_figures
from tactbench.core.evaluation.fitting import answers as answers_of
from tactbench.core.evaluation.fitting import fit
from tactbench.core.evaluation.frames import band_limit, clocked, frame_delay_ms, frame_features_s, framed
from tactbench.core.evaluation.interval import LEVEL, score_interval
from tactbench.core.evaluation.leaks import leak_stamps
from tactbench.core.evaluation.metrics import METRICS, Metric, class_f1, confusion, metric_called
from tactbench.core.evaluation.preparation import assigned, builder, prepared
from tactbench.core.evaluation.protocols import ProtocolSpec, protocol_called
from tactbench.core.evaluation.reference_floor import BeyondFloor, beyond_floor, reference_floor, true_force
from tactbench.core.evaluation.replicate_sums import summed
from tactbench.core.evaluation.replication import ReplicateUnits, replicates
from tactbench.core.evaluation.selection import Build, Choice, features_of, select
from tactbench.core.evaluation.sets import not_asked_for
from tactbench.core.evaluation.splits import (
    SHUFFLED_STAMP,
    SHUFFLED_WHOLE_STAMP,
    Assignment,
    assert_disjoint,
    choose_split,
    over_rows,
    used_rows,
    with_validation,
    without_part,
)
from tactbench.core.evaluation.summaries import (
    is_summarised,
    recording_features,
    summarised,
    waiting_for_the_whole,
    without_windows,
)
from tactbench.core.evaluation.timing import (
    AT_LEAST,
    calls_s,
    peak_rss_mb,
    single_row_latency_s,
    single_row_preparation_s,
    tail_ms,
)
from tactbench.core.evaluation.unloaded import tare_s
from tactbench.core.evaluation.vectors import vector_details
from tactbench.core.evaluation.vote import require_answers, voted
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import Answers, FloatArray, Fold, Part
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.scene import Role
from tactbench.core.spec.task import TaskSpec, VectorTarget
from tactbench.core.thread_limit import thread_limit


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
    """that some fold uses; n_sessions alike"""
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
    events: Mapping[str, float] = field(default_factory=dict)
    """figures of events, times in the unit of the name"""
    operating_points: tuple[Mapping[str, float], ...] = ()
    """the same at thresholds chosen on validation for several bounds of false alarms"""


@dataclass(frozen=True)
class CellContext:
    """What one cell asks, but for the recordings."""

    task: TaskSpec
    estimator: EstimatorDescriptor
    params: Mapping[str, Any]
    """other than the estimator's defaults; they are not searched"""
    protocol: str
    """how recordings become X and y"""
    split: str | None
    """what is kept apart; None: the task's first that fits"""
    seed: int
    """decides everything random: the same seed gives the same score in any process"""
    clock: Callable[[], float]
    """seconds, monotonic"""
    threads: int = 1
    """that estimator and BLAS may use"""
    latency: bool = True
    """whether to measure how long the answer to one row takes"""
    progress: Callable[[str], None] | None = None
    """told what is being done"""


class _Folds:
    """The folds of one cell, and what they add up to."""

    def __init__(self, context: CellContext, recorded: Dataset) -> None:
        self.context, self.recorded = context, recorded
        self.rules: ProtocolSpec = protocol_called(context.protocol)
        self.metric: Metric = metric_called(context.task.metric)
        self.split: str = choose_split(context.task, self.rules, recorded, context.split)
        self.held_s = tare_s(recorded) if self.rules.tare else 0.0
        if context.task.answer_per == "frame":
            data = framed(recorded, context.task, self.rules, context.estimator)
        else:
            data = summarised(recorded, context.task, self.rules)
        self.data = data
        own_threshold = context.estimator.threshold
        self.events = EventAnswers.of(context.task, own_threshold) if context.task.kind == "events" else None
        self.held_back: list[str] = []
        self.counts: Counter[str] = Counter(data.counts)
        self.sets: dict[Role, list[Answers]] = {}
        self.scores: dict[str, float] = {}
        self.fold_sizes: dict[str, tuple[int, int]] = {}
        self.chosen: list[Choice] = []
        self.names: list[str] = []
        self.took_part: list[RecordingMeta] = []
        self.folds = self.n_train = self.k = 0
        self.stamps: tuple[str, ...] = data.stamps
        self.untrained: dict[str, list[str]] = {}
        self.search_s = self.fit_s = self.predict_s = 0.0
        self.batch_rows = 0
        self.test: Any = None

    def look_over(self, assignments: Sequence[Assignment]) -> None:
        """Count which recorded rows the folds together use, and which they do not."""
        used = used_rows(assignments)
        self.counts.update(without_part(self.recorded, self.split, used))
        self.counts.update(not_asked_for(self.recorded, self.rules, used))
        self.took_part = [
            table.meta for table, mask in zip(self.recorded.tables, used, strict=True) if (mask & table.labelled).any()
        ]

    def add(self, number: int, assignment: Assignment, build: Build, *, alone: bool) -> Estimator:
        """Choose, fit and test on one fold, and return the fitted model; `alone`: it is the only one."""
        context, data, rules, metric, counts = self.context, self.data, self.rules, self.metric, self.counts
        estimator, clock = context.estimator, context.clock
        if self.events and self.events.own_threshold is None and assignment.validation is None:
            assignment = with_validation(assignment, data)
            self.held_back.append(assignment.name)
        began = clock()
        choice = select(estimator, context.params, build, data, rules, assignment, metric, counts)
        self.search_s += clock() - began
        k = choice.k if choice else estimator.window_grid[0]
        fold = prepared(assignment, data, rules, k, counts)
        _worth_answering(fold, data)
        if data.classes:
            for one in np.setdiff1d(fold.test.y, fold.train.y):
                self.untrained.setdefault(str(data.classes[int(one)]), []).append(fold.name)
        X_train, X_test = features_of(fold.train, estimator), features_of(fold.test, estimator)
        model = build(choice.params if choice else {})
        began = clock()
        fit(model, X_train, fold.train.y, estimator.name, counts)
        self.fit_s += clock() - began
        n_classes = len(data.classes)
        began = clock()
        shape = fold.test.y.shape[1:]
        predicted = answers_of(model, X_test, estimator.name, 0 if self.events else n_classes, shape)
        self.predict_s += clock() - began
        self.batch_rows += len(fold.test)
        self.n_train += len(fold.train)
        self.folds += 1
        self.test, self.k = fold.test, k
        if self.events:
            self._detect(self.events, fold, predicted, model, number, alone=alone)
            return model
        if data.vote:
            require_answers(data, assignment.test, fold.test)
        tested, combined = self._combined(fold.test, predicted)
        self.scores[f"fold {fold.name}"] = metric.of(tested.y, combined, n_classes)
        self.fold_sizes[f"fold {fold.name}"] = (len(fold.train), len(tested))
        self._keep("test", tested, combined, number)
        if alone and not n_classes:
            on_training = answers_of(model, X_train, estimator.name, n_classes, fold.train.y.shape[1:])
            self._keep("train", *self._combined(fold.train, on_training), number)
        if fold.validation is not None and len(fold.validation):
            X_validation, shape = features_of(fold.validation, estimator), fold.validation.y.shape[1:]
            on_validation = answers_of(model, X_validation, estimator.name, n_classes, shape)
            held_back, on_validation = self._combined(fold.validation, on_validation)
            if not choice:
                self.scores["validation"] = metric.of(held_back.y, on_validation, n_classes)
            if alone:
                self._keep("validation", held_back, on_validation, number)
        if choice:
            self.chosen.append(choice)
            self.names.append(fold.name)
            self.scores["validation"] = choice.score
        return model

    def _detect(
        self, events: EventAnswers, fold: Fold, score: FloatArray, model: Estimator, number: int, *, alone: bool
    ) -> None:
        """Choose a threshold on validation recordings and keep what it comes to on those and on test recordings."""
        estimator, data = self.context.estimator, self.data
        validated = []
        if fold.validation is not None and len(fold.validation):
            given = answers_of(model, features_of(fold.validation, estimator), estimator.name, 0)
            validated = events.scored(fold.validation, given, data)
        threshold, bounds = events.choose(fold.name, validated)
        tested = events.add(events.scored(fold.test, score, data), threshold, bounds, data)
        self.scores[f"fold {fold.name}"] = self._keep_items("test", tested, number)
        self.fold_sizes[f"fold {fold.name}"] = (len(fold.train), len(tested.y_true))
        if validated and alone:
            items = events.items([(one, events.alarms(one, threshold)) for one in validated], data)
            self.scores["validation"] = self._keep_items("validation", items, number)

    def _keep_items(self, role: Role, items: Items, number: int) -> float:
        """Keep events and alarms as answers, and return their score."""
        n = len(items.y_true)
        fold, none = np.full(n, number, dtype=np.int64), np.full(n, np.nan)
        self.sets.setdefault(role, []).append(Answers(*items[:4], fold, items.time_s, none))
        return self.metric.of(items.y_true, items.y_pred, len(self.data.classes))

    def _combined(self, part: Part, predicted: npt.NDArray[Any]) -> tuple[Part, npt.NDArray[Any]]:
        """Return what is scored: rows and their answers, or recordings and what their rows' answers come to."""
        return voted(part, predicted, len(self.data.classes)) if self.data.vote else (part, predicted)

    def _keep(self, role: Role, part: Part, predicted: npt.NDArray[Any], number: int) -> None:
        """Keep what was answered, with time and reference force beside it."""
        force = np.full(len(part), np.nan)
        for place in np.unique(part.recording):
            table = self.data.tables[place]
            if table.force is not None:
                mine = part.recording == place
                force[mine] = table.force[np.searchsorted(table.row, part.row[mine])]
        fold = np.full(len(part), number, dtype=np.int64)
        answered = Answers(part.y, predicted, part.recording, part.row, fold, part.time_s, force)
        self.sets.setdefault(role, []).append(answered)


def evaluate(context: CellContext, recordings: Sequence[Path] | Dataset) -> CellResult:
    """Answer a task from recordings with an estimator, and measure how well and at what cost.

    Parameters
    ----------
    context
        Task, estimator, protocol, split.
    recordings
        Files, or what was read of them already.

    Raises
    ------
    NotApplicable
        If the question cannot be asked of these recordings.
    UsageError
        If a parameter is unknown or the split cannot be served.
    DataError
        If a set is empty, has one class only, or its labels never change.
    """
    say = context.progress or (lambda _: None)
    recorded = recordings if isinstance(recordings, Dataset) else load_dataset(context.task, recordings)
    estimator = without_windows(context.estimator, context.task)
    context = replace(context, estimator=estimator)
    folds = _Folds(context, recorded)
    data = folds.data
    assignments = assigned(context.task, estimator, data, folds.split, context.seed)
    assert_disjoint(assignments)
    if not assignments:
        raise DataError("No fold could be made of these recordings.", hint="Choose another --split.")
    over_recorded = [over_rows(one, recorded) for one in assignments]
    folds.look_over(over_recorded)
    if folds.split == "shuffled":
        folds.stamps += (SHUFFLED_WHOLE_STAMP if data.whole else SHUFFLED_STAMP,)
    else:
        folds.stamps += leak_stamps(recorded, over_recorded)
    build = builder(estimator, context.params, context.task, context.seed, context.threads)
    with thread_limit(context.threads):
        for number, assignment in enumerate(assignments):
            say(f"{estimator.name}: {assignment.name}")
            model = folds.add(number, assignment, build, alone=len(assignments) == 1)
        latency = _latency_ms(model, features_of(folds.test, estimator), context.clock) if context.latency else {}
        delay = _delay(folds, latency)
    return _result(folds, latency, delay)


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


def _delay(folds: _Folds, latency: Mapping[str, Any]) -> _Delay:
    """Return how late answers of the last fold's model are: the one whose latency was measured, if it was."""
    looks_at, tared = folds.context.estimator.looks_at, folds.rules.tare
    parts: dict[str, float] = {}
    remarks: tuple[str, ...] = ()
    if folds.context.task.answer_per == "frame":
        task, estimator = folds.context.task, folds.context.estimator
        parts, remarks = frame_delay_ms(folds.recorded, folds.data.features, task, folds.rules, estimator)
        if latency and "window" in parts:
            spent_s = frame_features_s(folds.recorded, task, folds.rules, estimator, folds.context.clock)
            parts["features"] = 1e3 * spent_s
    elif looks_at == "features":
        parts, remarks = reading_delay_ms(folds.recorded, folds.rules, folds.k)
        parts = waiting_for_the_whole(parts, folds.recorded, folds.context.task, folds.rules)
        if latency:
            # A median needs no more calls, and a row keeps nothing else of them.
            if is_summarised(folds.context.task, folds.rules):
                tables, compute = folds.recorded.tables, recording_features(folds.context.task, folds.rules)
                ready_s = calls_s(len(tables), tables.__getitem__, compute, folds.context.clock, AT_LEAST)
            else:
                ready_s = single_row_preparation_s(
                    folds.test.X, folds.k, folds.context.clock, tared=tared, at_most=AT_LEAST
                )
            parts["features"] = float(1e3 * np.median(ready_s))
    if latency:
        parts["prediction"] = latency["latency_ms_p50"]
    else:
        remarks = tuple(one for one in remarks if one not in (NO_LINK, NO_RATE))  # there is no delay to speak of
    return _Delay(parts, answer_delay_ms(parts, looks_at), remarks)


def _joined(folds: Sequence[Answers]) -> Answers:
    names = [column.name for column in fields(Answers)]
    return Answers(**{name: np.concatenate([getattr(one, name) for one in folds]) for name in names})


def _worth_answering(fold: Fold, data: Dataset) -> None:
    for what, one in (("training", fold.train), ("test", fold.test)):
        if len(one) == 0:
            raise DataError(
                f"The {what} set of fold {fold.name!r} has no labelled row.", hint="Choose another --split."
            )
    values = np.unique(fold.train.y, axis=0)
    if len(values) < 2:
        only = data.classes[int(values[0])] if data.classes else values[0]
        raise DataError(
            f"All training labels of fold {fold.name!r} are {only}: there is nothing to learn.",
            hint="Choose another --split, or check the label column with `tactbench inspect`.",
        )


def _result(folds: _Folds, latency: Mapping[str, Any], delay: _Delay) -> CellResult:
    task, seed, split = folds.context.task, folds.context.seed, folds.split
    data, rules, metric = folds.data, folds.rules, folds.metric
    sets = {role: _joined(parts) for role, parts in folds.sets.items()}
    tested = sets["test"]
    y, predicted, recording, row = tested.y_true, tested.y_pred, tested.recording, tested.row
    n_classes = len(data.classes)
    held = folds.held_s
    floor, no_floor = reference_floor(task, metric, data, tested)
    truth = true_force(task, data, tested) if metric.kind == "regression" else None
    unit = replicates(data, task, split, y, recording, row)
    score = metric.of(y, predicted, n_classes)
    compute_s = sum(delay.parts_ms.get(name, 0.0) for name in ("features", "prediction")) / 1e3 if latency else None
    if not np.isfinite(score):
        raise DataError(
            f"The {metric.name} of {len(y)} test rows is undefined: their labels never change.",
            hint="Choose another --split.",
        )
    interval = score_interval(metric, y, predicted, recording, unit.codes, unit.name, n_classes, seed)
    scores = dict(folds.scores)
    for other in METRICS.values():
        if other.kind == task.kind and other.vector == metric.vector and other is not metric:
            scores[other.name] = other.of(y, predicted, n_classes)
    table = None
    if n_classes:
        sums = metric.rows(y, predicted, n_classes).sum(axis=0)
        table = confusion(sums, n_classes).astype(np.int64)
        for label, value in zip(data.classes, class_f1(sums, n_classes), strict=True):
            scores[f"F1 of {label}"] = float(value)
    if task.answer_per == "frame" and not folds.events:
        scores |= state_figures(tested, data)
    if isinstance(task.target, VectorTarget):
        scores |= vector_details(task.target, y, predicted)
    # R² of labels that never change is undefined; a key that is not there says so, NaN would not even be JSON.
    scores = {name: value for name, value in scores.items() if np.isfinite(value)}
    return CellResult(
        metric=metric.name,
        score=score,
        ci_low=interval.low,
        ci_high=interval.high,
        ci_level=LEVEL,
        ci_method=interval.method + unit.caveat,
        scores=scores,
        fold_sizes=folds.fold_sizes,
        confusion=table,
        classes=data.classes,
        split=split,
        folds=folds.folds,
        n_recordings=len(folds.took_part),
        n_sessions=len({meta.session for meta in folds.took_part}),
        n_train=folds.n_train,
        n_test=len(y),
        counts=dict(folds.counts),
        chosen=_chosen(folds.chosen, folds.names) | _thresholds(folds.events),
        events=folds.events.figures(compute_s) if folds.events else {},
        operating_points=folds.events.operating_points(compute_s) if folds.events else (),
        dagger=rules.uses_test_statistics,
        stamps=folds.stamps,
        search_s=folds.search_s,
        fit_s=folds.fit_s,
        predict_s=folds.predict_s,
        batch_rows=folds.batch_rows,
        latency_ms_p50=latency.get("latency_ms_p50"),
        latency_ms_p95=latency.get("latency_ms_p95"),
        latency_ms_max=latency.get("latency_ms_max"),
        latency_n=latency.get("latency_n"),
        answer_delay_ms=delay.total_ms,
        delay_parts_ms=delay.parts_ms,
        threads=folds.context.threads,
        peak_rss_mb=peak_rss_mb(),
        search=_search(folds.chosen, folds.names),
        sets=sets,
        replicates=summed(metric, tested, unit, data, floor),
        beyond=None if floor is None else beyond_floor(floor, tested, unit, seed),
        true=None if truth is None else _against(truth, metric, tested, unit, seed),
        tare_s=held or None,
        remarks=tuple(
            one
            for one in (
                _one_a_recording(folds),
                *_of_frames(folds),
                _of_vectors(task),
                no_floor,
                NOT_TARED if rules.tare and not held else "",
                _untrained(folds),
                *delay.remarks,
            )
            if one
        ),
    )


NOT_TARED = "not tared: no recording states an unloaded hold"


def _one_a_recording(folds: _Folds) -> str:
    task = folds.context.task
    if task.answer_per != "recording":
        return ""
    made_of = "its first row" if folds.rules.first_row_only else task.answer_from
    return f"one answer a recording, from {made_of}"


def _of_frames(folds: _Folds) -> list[str]:
    """Return what a reader of scores of frames or events must know."""
    if folds.context.task.answer_per != "frame":
        return []
    remarks = [band_limit(clocked(folds.recorded.tables[0], folds.rules))]
    if folds.held_back:
        remarks.append("no recording has the role validation: thresholds are chosen on a share of the training groups")
    if folds.events and any(np.isinf(one) for one in folds.events.thresholds.values()):
        remarks.append(
            f"{folds.context.estimator.name}: no threshold kept the bound of false alarms on validation and hit "
            "anything: it never raises an alarm"
        )
    return remarks


def _thresholds(events: EventAnswers | None) -> dict[str, float]:
    """Return the thresholds chosen, by fold where there are several; one that is never reached is not there."""
    if events is None or events.own_threshold is not None:
        return {}
    several = len(events.thresholds) > 1
    return {
        f"threshold of fold {name}" if several else "threshold": value
        for name, value in events.thresholds.items()
        if np.isfinite(value)
    }


def _of_vectors(task: TaskSpec) -> str:
    if not isinstance(task.target, VectorTarget):
        return ""
    return f"answers are vectors ({', '.join(task.target.names)}): one model per component"


def _untrained(folds: _Folds) -> str:
    """Return which classes were asked for that no training row had: no estimator can answer them."""
    named = [f"{one!r} in {', '.join(names)}" for one, names in sorted(folds.untrained.items())]
    return f"tested but never trained on: {'; '.join(named)}" if named else ""


def _against(
    truth: FloatArray, metric: Metric, tested: Answers, unit: ReplicateUnits, seed: int
) -> tuple[float, float, float]:
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
