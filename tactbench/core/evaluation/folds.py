"""From recordings to folds: rows of X and y, and which of them train and test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable, wrong
from tactbench.core.evaluation.dataset import Dataset, Mask, load_dataset, thinned
from tactbench.core.evaluation.protocols import ProtocolSpec, protocol_called, shots, without_options
from tactbench.core.evaluation.sets import apart, asked_for, tare_s, tared, windowed
from tactbench.core.evaluation.splits import (
    SPLITS_WITHOUT_GROUPS,
    Assignment,
    OwnSplit,
    choose_split,
    make_splits,
    with_validation,
)
from tactbench.core.evaluation.summaries import framed, is_summarised, summarised, with_windows
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.row import LEAKS
from tactbench.core.spec.task import TaskSpec

PLAIN = EstimatorDescriptor.model_construct(name="estimator", title="", kinds=(), where="")
"""The descriptor of an estimator that is only an object: it looks at all features, and has nothing to be chosen."""


@dataclass(frozen=True, repr=False)
class TaskData:
    """The rows of a task under a protocol, and which of them train and test.

    `X` is tared, and neither scaled nor filtered: these are fitted on each fold's training rows.
    """

    task: TaskSpec
    rules: ProtocolSpec
    split: str
    recorded: Dataset
    """the recordings as they were read"""
    data: Dataset
    """the same as rows to be answered: samples, windows of them, frames, or one row a recording"""
    assignments: tuple[Assignment, ...]
    """the rows that train, test and validate, fold by fold"""
    held_back: bool = False
    """thresholds are chosen on a share of the training groups: no recording has the role validation"""
    unit: str | None = "session"
    """name of the groups that are held out, which intervals are over; None: the caller's own split names none"""
    stamps: tuple[str, ...] = ()
    """leaks of the caller's own split"""
    window: int = 0
    """rows of a window; 0: rows are answered one by one"""

    def __repr__(self) -> str:
        counts = f"X {self.X.shape}, {len(self.assignments)} folds of {len(self.data.tables)} recordings"
        return f"<TaskData {self.task.name} by {self.split}: {counts}>"

    @property
    def X(self) -> FloatArray:  # noqa: N802  (as in scikit-learn)
        """Return (n, features), or (n, window, features), of the labelled rows that the protocol keeps."""
        return self.data.column(lambda table: tared(table) if self.rules.tare else table.X, self._there)

    @property
    def y(self) -> npt.NDArray[Any]:
        """Return (n,) numbers or class indices, (n, components) of a vector."""
        return self.data.column(lambda table: table.y, self._there)

    @property
    def groups(self) -> npt.NDArray[Any]:
        """Return (n,) labels that the split keeps apart; those of the session where it keeps no group apart."""
        return self.per_row("groups", self.assignments[0].groups)

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Return the names of the columns of `X`."""
        return self.data.features

    @property
    def classes(self) -> tuple[Any, ...]:
        """Return the labels that class indices in `y` stand for; nothing of a regression."""
        return self.data.classes

    @property
    def folds(self) -> list[tuple[IntArray, IntArray]]:
        """Return the rows of each fold that train and those that test: a `cv` for scikit-learn."""
        there = self._there
        return [(np.flatnonzero(one.train[there]), np.flatnonzero(one.test[there])) for one in self.assignments]

    def per_row(self, argument: str, given: Any) -> npt.NDArray[Any]:
        """Return (n,) values, one for each row of `X`: an array that was given, or the labels of a name."""
        if isinstance(given, str):
            known = set.intersection(*(set(table.groups) for table in self.data.tables))
            if given not in known:
                raise wrong(argument, given, f"a label of the recordings ({', '.join(sorted(known))}), or an array")
            return self.data.column(lambda table: table.groups[given], self._there)
        column, n = np.asarray(given), len(self.y)
        if column.shape != (n,) or (column != column).any():  # NaN is no group, and weighs nothing
            raise wrong(argument, given, f"the name of a label, or an array of {n} values, one for each row of X")
        return column

    def spread(self, column: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return values of the rows of `X` at their places among all rows, which else have an empty one."""
        there = self._there
        found = np.zeros((len(there), *column.shape[1:]), dtype=column.dtype)
        found[there] = column
        return found

    @property
    def _there(self) -> Mask:
        return self.data.column(lambda table: asked_for(table, self.rules) & table.labelled)


def load_task(
    task: TaskSpec,
    recordings: Sequence[Path] | Dataset,
    protocol: str,
    split: str | OwnSplit | None = None,
    *,
    estimator: EstimatorDescriptor = PLAIN,
    seed: int = 0,
    window: int = 0,
    step: int = 1,
) -> TaskData:
    """Return recordings as rows and folds.

    Parameters
    ----------
    recordings
        Files, or a data set read from them.
    split
        Name of the split; None: the task's first that the recordings can serve.
    estimator
        Decides the features of frames, the gap between training and test where recordings are cut in time (its longest
        window), and whether a threshold has to be chosen.
    seed
        Of split ``shuffled``.
    window, step
        Rows of a window, 0 for none, and from its end to that of the next; see :func:`windowed`.

    Raises
    ------
    NotApplicable
        If the estimator looks at the time and a recording states none: the order of its rows means nothing. If the
        protocol thins samples or states a window, and the task is not answered sample by sample.
    """
    recorded = recordings if isinstance(recordings, Dataset) else load_dataset(task, recordings)
    rules = protocol_called(protocol)
    estimator = with_windows(estimator, task, rules)
    frames = task.answer_per == "frame"
    if (rules.every > 1 or rules.k is not None) and (frames or is_summarised(task, rules)):
        raise NotApplicable(
            f"Protocol {protocol!r} is for answers to single samples; {task.name} is answered by summaries of many.",
            hint=f"Use protocol `{without_options(protocol)}`.",
        )
    recorded = thinned(recorded, rules.every)
    name = split.name if isinstance(split, OwnSplit) else choose_split(task, rules, recorded, split)
    if isinstance(split, OwnSplit) and (rules.roles_only or rules.first_row_only):
        raise NotApplicable(f"Protocol {protocol!r} has a split of its own, not {name}.", hint="Use `deployable`.")
    if rules.tare:
        tare_s(recorded)  # refuses recordings of which some only can be tared
    data = framed(recorded, task, rules, estimator) if frames else summarised(recorded, task, rules)
    if window:
        data = windowed(data, task, rules, window, step)
    unit = "session" if name in SPLITS_WITHOUT_GROUPS or shots(name) else name
    made = TaskData(task, rules, name, recorded, data, (), unit=unit, window=window)
    if isinstance(split, OwnSplit):
        made = _with_own_folds(made, split)
    else:
        folds = make_splits(data, name, seed, max(estimator.window_grid), one_by_one=name in task.campaigns)
        made = replace(made, assignments=tuple(folds))
    if window:
        made = replace(made, assignments=tuple(apart(one, data, window, step) for one in made.assignments))
    if not any(one.train.any() for one in made.assignments):
        which = f", window={window}" if window else ""
        raise DataError(f"No fold could be made of these recordings{which}.", hint="Choose another split or window.")
    if task.kind == "events" and estimator.threshold is None and made.assignments[0].validation is None:
        parted = tuple(with_validation(one, made.data) for one in made.assignments)
        made = replace(made, assignments=parted, held_back=True)
    if estimator.looks_at == "time" and any(meta.clock == "none" for meta in recorded.metas):
        raise NotApplicable(
            f"{estimator.name} looks at the time alone, which not all of these recordings state.",
            hint="State the clock in the mapping.",
        )
    return made


def _with_own_folds(made: TaskData, own: OwnSplit) -> TaskData:
    """Return rows with the caller's groups and folds, and a stamp where a group, or a recording, is on both sides."""
    name, groups = "recording", None
    apart_by = made.per_row("groups", name)
    if own.groups is not None:
        name = own.groups if isinstance(own.groups, str) else "group"
        apart_by = groups = made.per_row("groups", own.groups)
        each = zip(made.data.tables, made.data.parted(made.spread(groups.astype(np.str_))), strict=True)
        tables = tuple(replace(table, groups={**table.groups, name: mine}) for table, mine in each)
        made = replace(made, data=replace(made.data, tables=tables))
    folds: list[Assignment] = []
    stamps: list[str] = []
    for number, pair in enumerate(own.folds(made.X, made.y, groups), 1):
        train, test = (made.spread(np.isin(np.arange(len(apart_by)), places)) for places in pair)
        folds.append(Assignment(str(number), train, test, groups="session" if groups is None else name))
        both = np.intersect1d(apart_by[pair[0]], apart_by[pair[1]])
        stamps += [f"{LEAKS}split {own.name} puts {name} {one} on both sides of fold {number}." for one in both[:1]]
    unit = None if groups is None else name
    return replace(made, assignments=tuple(folds), unit=unit, stamps=tuple(stamps[:1]))
