"""One cell: from recordings to folds of X and y, fitted models, their answers, and a score.

:func:`load_task` makes the folds, :func:`evaluate` does the rest for any object with ``fit`` and ``predict``;
:func:`evaluate_cell` calls both for a cell of the matrix. Regression, classification and events differ in two places
alone: in what is scored of a fold (:func:`_answer`), and in what stands beside the score (:func:`_result`).
"""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable, PluginContractError
from tactbench.core.evaluation.dataset import LARGEST, Dataset, load_dataset
from tactbench.core.evaluation.delay import (
    NO_LINK,
    NO_RATE,
    Clock,
    answer_delay_ms,
    features_s,
    peak_rss_mb,
    single_row_latency_s,
    stated_delay_ms,
    tail_ms,
)
from tactbench.core.evaluation.event_answers import Detected, EventRules, state_figures
from tactbench.core.evaluation.fitting import (
    Build,
    Choice,
    answers,
    asked,
    builder,
    features_of,
    fit,
    one_model_a_component,
    select,
    voted,
)
from tactbench.core.evaluation.frames import band_limit, clocked, framed
from tactbench.core.evaluation.interval import score_interval
from tactbench.core.evaluation.leaks import copied_channels, leak_stamps
from tactbench.core.evaluation.metrics import METRICS, Metric, class_f1, confusion, metric_called, vector_details
from tactbench.core.evaluation.protocols import ProtocolSpec, protocol_called
from tactbench.core.evaluation.reference_floor import beyond_floor, reference_floor, true_force
from tactbench.core.evaluation.replicate_sums import recordings_right, replicates, summed
from tactbench.core.evaluation.result import Result, Sizes, Times
from tactbench.core.evaluation.sets import asked_for, prepared, tare_s, tared
from tactbench.core.evaluation.splits import (
    SHUFFLED_STAMP,
    SHUFFLED_WHOLE_STAMP,
    Assignment,
    choose_split,
    make_splits,
    over_rows,
    used_rows,
    with_validation,
    without_part,
)
from tactbench.core.evaluation.summaries import summarised, without_windows
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.recording.completeness import INCOMPLETE
from tactbench.core.samples import Answers, FloatArray, Fold, IntArray, Part
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.scene import Role
from tactbench.core.spec.task import TaskSpec, VectorTarget
from tactbench.core.thread_limit import thread_limit


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
    clock: Clock
    threads: int = 1
    """that estimator and BLAS may use"""
    latency: bool = True
    """whether to measure how long the answer to one row takes"""


def evaluate_cell(context: CellContext, recordings: Sequence[Path] | Dataset) -> Result:
    """Load the recordings of a cell (files, or what was read of them) and evaluate its estimator on them.

    Raises
    ------
    NotApplicable
        If the question cannot be asked of these recordings.
    UsageError
        If a parameter is unknown or the split cannot be served.
    DataError
        If a set is empty, has one class only, or its labels never change.
    """
    task, estimator, seed = context.task, context.estimator, context.seed
    data = load_task(task, recordings, context.protocol, context.split, estimator=estimator, seed=seed)
    build = builder(estimator, context.params, task, seed, context.threads)
    return evaluate(
        Configured(without_windows(estimator, task), build, context.params), data, clock=context.clock,
        threads=context.threads, latency=context.latency,
    )  # fmt: skip


# --- Recordings to folds ----------------------------------------------------------------------------------------------

PLAIN = EstimatorDescriptor.model_construct(name="estimator", title="", kinds=(), where="")
"""What is taken of an estimator that is only an object: it looks at all features, and has nothing to be chosen."""


@dataclass(frozen=True, repr=False)
class TaskData:
    """What a task asks of recordings under a protocol: rows, and which of them train and test.

    `X` is tared, and neither scaled nor filtered: these are fitted on each fold's training rows.
    """

    task: TaskSpec
    rules: ProtocolSpec
    split: str
    recorded: Dataset
    """the recordings as they were read"""
    data: Dataset
    """the same as rows to be answered: samples, frames, or one row a recording"""
    assignments: tuple[Assignment, ...]
    """which rows of each recording are for what, fold by fold"""
    held_back: bool = False
    """a share of the training groups is what thresholds are chosen on: no recording has the role validation"""

    def __repr__(self) -> str:
        counts = f"X {self.X.shape}, {len(self.assignments)} folds of {len(self.data.tables)} recordings"
        return f"<TaskData {self.task.name} by {self.split}: {counts}>"

    @property
    def X(self) -> FloatArray:  # noqa: N802  (as in scikit-learn)
        """Return (n, features) readings of the rows that the protocol looks at and that have a label."""
        return self._joined([tared(table) if self.rules.tare else table.X for table in self.data.tables])

    @property
    def y(self) -> npt.NDArray[Any]:
        """Return (n,) numbers or class indices, (n, components) of a vector."""
        return self._joined([table.y for table in self.data.tables])

    @property
    def groups(self) -> npt.NDArray[Any]:
        """Return (n,) labels that the split keeps apart; those of the session where it keeps no group apart."""
        tables, name = self.data.tables, self.assignments[0].groups
        return self._joined([table.groups[name] for table in tables])

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Return what the columns of `X` are called."""
        return self.data.features

    @property
    def classes(self) -> tuple[Any, ...]:
        """Return the labels that class indices in `y` stand for; nothing of a regression."""
        return self.data.classes

    @property
    def folds(self) -> list[tuple[IntArray, IntArray]]:
        """Return the rows of each fold that train and those that test: a `cv` for scikit-learn."""
        return [
            (np.flatnonzero(self._joined(one.train)), np.flatnonzero(self._joined(one.test)))
            for one in self.assignments
        ]

    def _joined(self, columns: Sequence[npt.NDArray[Any]]) -> npt.NDArray[Any]:
        there = [asked_for(table, self.rules) & table.labelled for table in self.data.tables]
        return np.concatenate([column[mask] for column, mask in zip(columns, there, strict=True)])


def load_task(
    task: TaskSpec,
    recordings: Sequence[Path] | Dataset,
    protocol: str,
    split: str | None = None,
    *,
    estimator: EstimatorDescriptor = PLAIN,
    seed: int = 0,
) -> TaskData:
    """Return recordings as rows and folds.

    Parameters
    ----------
    recordings
        Files, or what was read of them already.
    split
        What is kept apart; None: the task's first that the recordings can serve.
    estimator
        Decides the features of frames, the gap between training and test where recordings are cut in time (its longest
        window), and whether a threshold has to be chosen.
    seed
        Of split ``shuffled``.

    Raises
    ------
    NotApplicable
        If the estimator looks at the time and a recording states none: the order of its rows may be anybody's.
    """
    recorded = recordings if isinstance(recordings, Dataset) else load_dataset(task, recordings)
    rules, estimator = protocol_called(protocol), without_windows(estimator, task)
    split = choose_split(task, rules, recorded, split)
    if rules.tare:
        tare_s(recorded)  # refuses recordings of which some only can be tared
    frames = task.answer_per == "frame"
    data = framed(recorded, task, rules, estimator) if frames else summarised(recorded, task, rules)
    assignments = make_splits(data, split, seed, max(estimator.window_grid), one_by_one=split in task.campaigns)
    if not assignments:
        raise DataError("No fold could be made of these recordings.", hint="Choose another split.")
    held_back = task.kind == "events" and estimator.threshold is None and assignments[0].validation is None
    if held_back:
        assignments = [with_validation(one, data) for one in assignments]
    if estimator.looks_at == "time" and any(meta.clock == "none" for meta in recorded.metas):
        raise NotApplicable(
            f"{estimator.name} looks at the time alone, which not all of these recordings state.",
            hint="State the clock in the mapping.",
        )
    return TaskData(task, rules, split, recorded, data, tuple(assignments), held_back)


# --- Folds to fitted models -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Configured:
    """An estimator, what is known of it, and how it is made."""

    descriptor: EstimatorDescriptor
    build: Build
    params: Mapping[str, Any] = field(default_factory=dict)
    """fixed by the user: they are not searched"""


@dataclass(frozen=True)
class FittedFold:
    """A model, and the fold that it was fitted to."""

    fold: Fold
    model: Estimator
    choice: Choice | None
    """what was chosen on validation data; None: there was nothing to choose"""
    k: int
    """rows that the mean filter looks back"""
    search_s: float
    fit_s: float


@dataclass(frozen=True)
class AnsweredFold:
    """What was answered in one fold, and what it took."""

    name: str
    choice: Choice | None
    score: float
    validation: float | None
    """the score on validation data"""
    sizes: tuple[int, int]
    """training and test rows, or recordings, or events and alarms"""
    untrained: tuple[Any, ...]
    """classes that are tested and that no training row had"""
    search_s: float
    fit_s: float
    predict_s: float
    batch_rows: int
    sets: Mapping[Role, Answers]
    detected: tuple[Detected, ...] = ()
    """test recordings of a task of events, all with the fold's threshold"""


def evaluate(
    estimator: Estimator | Configured,
    data: TaskData,
    *,
    clock: Clock,
    threads: int = 1,
    latency: bool = True,
) -> Result:
    """Answer a task with an estimator, and measure how well and at what cost.

    Parameters
    ----------
    estimator
        Any object with ``fit`` and ``predict``, which stays as it is; or one that is to be made anew.
    clock, threads, latency
        As in :class:`CellContext`.
    """
    if not isinstance(estimator, Configured):
        given = estimator
        named = PLAIN.model_copy(update={"name": type(given).__name__})
        estimator = Configured(named, one_model_a_component(data.task, lambda _: copy.deepcopy(given)))
    descriptor, metric = estimator.descriptor, metric_called(data.task.metric)
    rules = EventRules.of(data.task, descriptor.threshold) if data.task.kind == "events" else None
    counts = Counter(data.data.counts)
    answered: list[AnsweredFold] = []
    with thread_limit(threads):
        for number, assignment in enumerate(data.assignments):
            fitted = _fit(estimator, data, assignment, metric, counts, clock)
            answered.append(_answer(fitted, data, descriptor, metric, rules, number, clock))
        times, delay_remarks = _times(fitted, answered, data, descriptor, clock, threads, latency=latency)
    return _result(answered, data, descriptor, metric, rules, times, delay_remarks, counts)


def _fit(
    estimator: Configured, data: TaskData, assignment: Assignment, metric: Metric, counts: Counter[str], clock: Clock
) -> FittedFold:
    """Choose on validation data, and fit."""
    descriptor, made = estimator.descriptor, data.data
    began = clock()
    choice = select(descriptor, estimator.params, estimator.build, made, data.rules, assignment, metric, counts)
    search_s = clock() - began
    k = choice.k if choice else descriptor.window_grid[0]
    fold = prepared(assignment, made, data.rules, k, counts)
    for what, part in (("training", fold.train), ("test", fold.test)):
        if len(part) == 0:
            raise DataError(f"The {what} set of fold {fold.name!r} has no labelled row.", hint="Choose another split.")
    values = np.unique(fold.train.y, axis=0)
    if len(values) < 2:
        only = made.classes[int(values[0])] if made.classes else values[0]
        raise DataError(
            f"All training labels of fold {fold.name!r} are {only}: there is nothing to learn.",
            hint="Choose another split, or check the label column with `tactbench inspect`.",
        )
    if made.vote:
        answerable = set(fold.test.recording.tolist())
        for place, (table, mask) in enumerate(zip(made.tables, assignment.test, strict=True)):
            if place not in answerable and (mask & table.labelled).any():
                raise DataError(
                    f"The protocol leaves no row of recording {table.meta.name!r}, which is to be answered as a whole.",
                    hint="Use protocol `deployable-untared`, or leave the recording out.",
                )
    X = features_of(fold.train, descriptor)
    model = estimator.build(choice.params if choice else {})
    began = clock()
    fit(model, X, fold.train.y, descriptor.name, counts)
    return FittedFold(fold, model, choice, k, search_s, clock() - began)


# --- Models to answers ------------------------------------------------------------------------------------------------


def _answer(
    fitted: FittedFold,
    data: TaskData,
    descriptor: EstimatorDescriptor,
    metric: Metric,
    rules: EventRules | None,
    number: int,
    clock: Clock,
) -> AnsweredFold:
    """Have a model answer its fold; validation and training answers are kept where the fold is the only one."""
    fold, made = fitted.fold, data.data
    n_classes = 0 if rules else len(made.classes)
    X, shape = features_of(fold.test, descriptor), fold.test.y.shape[1:]
    began = clock()
    predicted = answers(fitted.model, X, descriptor.name, n_classes, shape)
    predict_s = clock() - began
    given: dict[Role, tuple[Part, npt.NDArray[Any]]] = {"test": (fold.test, predicted)}
    if fold.validation is not None and len(fold.validation):
        given["validation"] = fold.validation, asked(fitted.model, fold.validation, descriptor, n_classes)
    alone = len(data.assignments) == 1
    if alone and not made.classes:
        given["train"] = fold.train, asked(fitted.model, fold.train, descriptor, 0)
    detected: tuple[Detected, ...] = ()
    if rules is None:
        sets = {role: _rows(*one, made, number) for role, one in given.items()}
    else:
        scored = {role: rules.scored(*one, made) for role, one in given.items()}
        threshold, bounds = rules.choose(scored.get("validation", []))
        detected = tuple(Detected(one, threshold, bounds) for one in scored["test"])
        sets = {
            role: rules.items([(one, rules.alarms(one, threshold)) for one in several], made, number)
            for role, several in scored.items()
            if role == "test" or alone
        }
    kept: dict[Role, Answers] = sets if alone else {"test": sets["test"]}
    scores = {role: metric.of(one.y_true, one.y_pred, len(made.classes)) for role, one in sets.items()}
    untrained = np.setdiff1d(fold.test.y, fold.train.y).tolist() if made.classes else []
    return AnsweredFold(
        name=fold.name,
        choice=fitted.choice,
        score=scores["test"],
        validation=fitted.choice.score if fitted.choice else scores.get("validation"),
        sizes=(len(fold.train), len(sets["test"])),
        untrained=tuple(made.classes[int(one)] for one in untrained),
        search_s=fitted.search_s,
        fit_s=fitted.fit_s,
        predict_s=predict_s,
        batch_rows=len(fold.test),
        sets=kept,
        detected=detected,
    )


def _rows(part: Part, predicted: npt.NDArray[Any], made: Dataset, number: int) -> Answers:
    """Return the answers to rows, or to recordings what their rows' answers come to, with the reference force."""
    if made.vote:
        part, predicted = voted(part, predicted, len(made.classes))
    force = np.full(len(part), np.nan)
    for place in np.unique(part.recording):
        table, mine = made.tables[place], part.recording == place
        if table.force is not None:
            force[mine] = table.force[np.searchsorted(table.row, part.row[mine])]
    fold = np.full(len(part), number, dtype=np.int64)
    return Answers(part.y, predicted, part.recording, part.row, fold, part.time_s, force)


# --- Answers to a score -----------------------------------------------------------------------------------------------


def _times(
    fitted: FittedFold,
    answered: Sequence[AnsweredFold],
    data: TaskData,
    descriptor: EstimatorDescriptor,
    clock: Clock,
    threads: int,
    *,
    latency: bool,
) -> tuple[Times, tuple[str, ...]]:
    """Return what all folds took, and how late answers of the last fold's model are, with remarks on that."""
    recorded, task, rules = data.recorded, data.task, data.rules
    parts, remarks = stated_delay_ms(recorded, data.data, task, rules, descriptor, fitted.k)
    p50 = p95 = largest = calls = None
    if latency:
        waits_s = single_row_latency_s(fitted.model, features_of(fitted.fold.test, descriptor), clock)
        p50, calls = float(1e3 * np.median(waits_s)), len(waits_s)
        p95, largest = tail_ms(waits_s)
        ready_s = features_s(recorded, task, rules, descriptor, fitted.fold.test.X, fitted.k, clock)
        parts |= ({} if ready_s is None else {"features": 1e3 * ready_s}) | {"prediction": p50}
    else:
        remarks = tuple(one for one in remarks if one not in (NO_LINK, NO_RATE))  # there is no delay to speak of
    times = Times(
        search_s=sum(one.search_s for one in answered),
        fit_s=sum(one.fit_s for one in answered),
        predict_s=sum(one.predict_s for one in answered),
        batch_rows=sum(one.batch_rows for one in answered),
        latency_ms_p50=p50,
        latency_ms_p95=p95,
        latency_ms_max=largest,
        latency_n=calls,
        answer_delay_ms=answer_delay_ms(parts, descriptor.looks_at),
        delay_parts_ms=parts,
        threads=threads,
        peak_rss_mb=peak_rss_mb(),
    )
    return times, remarks


def _result(
    answered: Sequence[AnsweredFold],
    data: TaskData,
    descriptor: EstimatorDescriptor,
    metric: Metric,
    rules: EventRules | None,
    times: Times,
    delay_remarks: Sequence[str],
    counts: Counter[str],
) -> Result:
    task, made = data.task, data.data
    n_classes = len(made.classes)
    sets = {role: _joined([one.sets[role] for one in answered]) for role in answered[0].sets}
    tested = sets["test"]
    score = metric.of(tested.y_true, tested.y_pred, n_classes)
    if not np.isfinite(score):
        _refuse(descriptor.name, metric, tested)
    unit = replicates(made, data.split, tested)
    scores = {f"fold {one.name}": one.score for one in answered}
    if answered[-1].validation is not None:
        scores["validation"] = answered[-1].validation
    for other in METRICS.values():
        if other.kind == task.kind and other.vector == metric.vector and other is not metric:
            scores[other.name] = other.of(tested.y_true, tested.y_pred, n_classes)
    remarks = _of_answers(data, descriptor, answered)
    beside: dict[str, Any] = {}
    floor = None
    if metric.kind == "regression":
        if isinstance(task.target, VectorTarget):
            scores |= vector_details(task.target, tested.y_true, tested.y_pred)
            remarks.append(f"answers are vectors ({', '.join(task.target.names)}): one model per component")
        floor, no_floor = reference_floor(task, metric, made, tested)
        remarks.append(no_floor)
        truth = true_force(task, made, tested)
        if floor is not None:
            beside["beyond"] = beyond_floor(floor, tested, unit)
        if truth is not None:
            interval = score_interval(metric, truth, tested.y_pred, unit, 0)
            beside["true"] = metric.of(truth, tested.y_pred), interval
    else:
        sums = metric.rows(tested.y_true, tested.y_pred, n_classes).sum(axis=0)
        beside["confusion"] = confusion(sums, n_classes).astype(np.int64)
        if rules is None and task.answer_per != "frame":
            beside["recordings_right"], beside["recordings_asked"] = recordings_right(tested) or (None, None)
        scores |= {
            f"F1 of {label}": float(one) for label, one in zip(made.classes, class_f1(sums, n_classes), strict=True)
        }
    if rules is not None:
        detected = [one for fold in answered for one in fold.detected]
        latency = times.latency_ms_p50 is not None
        compute_s = sum(times.delay_parts_ms.get(name, 0.0) for name in ("features", "prediction")) / 1e3
        beside["events"] = rules.figures(detected, compute_s if latency else None)
        beside["operating_points"] = rules.operating_points(detected, compute_s if latency else None)
    elif task.answer_per == "frame":
        scores |= state_figures(tested, made)
    held_s = tare_s(data.recorded) if data.rules.tare else 0.0
    if data.rules.tare and not held_s:
        remarks.append("not tared: no recording states an unloaded hold")
    remarks += [_untrained(answered), *delay_remarks]
    took_part, left_out, stamps = _part_taken(data)
    specimens = {meta.labels.get("unit") for meta in took_part}
    return Result(
        metric=metric.name,
        score=score,
        interval=score_interval(metric, tested.y_true, tested.y_pred, unit, n_classes),
        # R² of labels that never change is undefined; a key that is not there says so, NaN would not even be JSON.
        scores={name: value for name, value in scores.items() if np.isfinite(value)},
        sizes=Sizes(
            n_recordings=len(took_part),
            n_sessions=len({meta.session for meta in took_part}),
            n_specimens=None if None in specimens else len(specimens),
            n_train=sum(one.sizes[0] for one in answered),
            n_test=len(tested),
            fold_sizes={f"fold {one.name}": one.sizes for one in answered},
        ),
        times=times,
        split=data.split,
        sets=sets,
        replicates=summed(metric, tested, unit, n_classes, floor),
        classes=made.classes,
        chosen=_chosen(answered) | _thresholds(answered, rules),
        search=tuple(
            {**candidate.params, "k": candidate.k, "score": candidate.score, "fold": one.name}
            for one in answered
            if one.choice
            for candidate in one.choice.compared
        ),
        counts=dict(counts + Counter(left_out)),
        dagger=data.rules.uses_test_statistics,
        stamps=stamps,
        tare_s=held_s or None,
        remarks=tuple(one for one in remarks if one),
        **beside,
    )


def _joined(folds: Sequence[Answers]) -> Answers:
    names = [column.name for column in fields(Answers)]
    return Answers(**{name: np.concatenate([getattr(one, name) for one in folds]) for name in names})


def _refuse(estimator: str, metric: Metric, tested: Answers) -> None:
    """Raise for a score that is no number: because of the answers, or of the labels."""
    largest = float(np.abs(tested.y_pred).max())
    if largest > LARGEST:
        raise PluginContractError(
            f"The estimator {estimator!r} answered with numbers up to {largest:.3g}: their {metric.name} overflows.",
            hint=f"Its predict(X) must return numbers below {LARGEST:g}, in the unit of the labels.",
        )
    raise DataError(
        f"The {metric.name} of {len(tested)} test rows is undefined: their labels never change.",
        hint="Choose another split.",
    )


def _part_taken(data: TaskData) -> tuple[list[RecordingMeta], dict[str, int], tuple[str, ...]]:
    """Return the recordings that some fold uses, what no fold uses, and stamps: of leaks, of incomplete ones."""
    recorded = data.recorded
    folds = [over_rows(one, recorded) for one in data.assignments]
    used = used_rows(folds)
    took_part = [one.meta for one, mask in zip(recorded.tables, used, strict=True) if (mask & one.labelled).any()]
    if data.split != "shuffled":
        stamps = leak_stamps(recorded, folds)
    else:
        stamps = (SHUFFLED_WHOLE_STAMP if recorded.whole else SHUFFLED_STAMP,)
    stamps = (*copied_channels(recorded), *stamps, *_incomplete(recorded))
    return took_part, without_part(recorded, data.split, used), stamps


def _of_answers(data: TaskData, descriptor: EstimatorDescriptor, answered: Sequence[AnsweredFold]) -> list[str]:
    """Return what a reader of scores of recordings, frames or events must know."""
    if data.task.answer_per == "recording":
        return [
            f"one answer a recording, from {'its first row' if data.rules.first_row_only else data.task.answer_from}"
        ]
    if data.task.answer_per != "frame":
        return []
    remarks = [band_limit(clocked(data.recorded.tables[0], data.rules))]
    if data.held_back:
        remarks.append("no recording has the role validation: thresholds are chosen on a share of the training groups")
    if data.task.kind == "events" and any(np.isinf(one.detected[0].threshold) for one in answered):
        remarks.append(
            f"{descriptor.name}: no threshold kept the bound of false alarms on validation and hit anything: it never "
            "raises an alarm"
        )
    return remarks


def _incomplete(recorded: Dataset) -> list[str]:
    """Return how many incomplete recordings were left out or taken, and why they are incomplete."""
    out = {name: n for name, n in recorded.counts.items() if name.startswith(f"recordings left out ({INCOMPLETE}")}
    taken = [meta.excluded for meta in recorded.metas if meta.excluded]
    every = sum(out.values()) + len(recorded.metas)
    texts = (
        [f"{sum(out.values())} of {every} recordings left out: {'; '.join(sorted(name[21:-1] for name in out))}"]
        if out
        else []
    )
    texts += [f"{len(taken)} of {every} recordings take part although {'; '.join(sorted(set(taken)))}"] if taken else []
    return texts


def _untrained(answered: Sequence[AnsweredFold]) -> str:
    """Return which classes were asked for that no training row had: no estimator can answer them."""
    folds: dict[str, list[str]] = {}
    for one in answered:
        for label in one.untrained:
            folds.setdefault(str(label), []).append(one.name)
    named = [f"{label!r} in {', '.join(names)}" for label, names in sorted(folds.items())]
    return f"tested but never trained on: {'; '.join(named)}" if named else ""


def _chosen(answered: Sequence[AnsweredFold]) -> dict[str, float]:
    """Return what was chosen; fold by fold where folds chose differently, since a median is what nobody chose."""
    chosen: dict[str, float] = {}
    each = {one.name: {**one.choice.params, "k": one.choice.k} for one in answered if one.choice}
    for name in next(iter(each.values()), {}):
        values = {fold: params[name] for fold, params in each.items()}
        if not all(isinstance(value, int | float) for value in values.values()):
            continue
        if len(set(values.values())) == 1:
            chosen[name] = float(next(iter(values.values())))
        else:
            chosen |= {f"{name} of fold {fold}": float(value) for fold, value in values.items()}
    return chosen


def _thresholds(answered: Sequence[AnsweredFold], rules: EventRules | None) -> dict[str, float]:
    """Return the thresholds chosen, by fold where there are several; one that is never reached is not there."""
    if rules is None or rules.own_threshold is not None:
        return {}
    found = {one.name: one.detected[0].threshold for one in answered if np.isfinite(one.detected[0].threshold)}
    return {"threshold" if len(answered) == 1 else f"threshold of fold {name}": one for name, one in found.items()}
