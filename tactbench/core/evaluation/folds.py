"""Turn recordings into rows of features X and labels y, and divide the rows into folds for training and test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable, wrong
from tactbench.core.evaluation.dataset import Dataset, Mask, load_dataset, thinned
from tactbench.core.evaluation.protocols import DEPLOYABLE, ProtocolSpec, protocol_called, shots
from tactbench.core.evaluation.sets import apart, asked_for, tare_s, tared, windowed
from tactbench.core.evaluation.splits import (
    SPLITS_WITHOUT_GROUPS,
    Assignment,
    OwnSplit,
    choose_split,
    make_splits,
    require_first_rows,
    with_validation,
)
from tactbench.core.evaluation.summaries import framed, is_summarised, summarised, with_windows
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.row import LEAKS
from tactbench.core.spec.task import TaskSpec

PLAIN = EstimatorDescriptor.model_construct(name="estimator", title="", kinds=(), where="")
"""Descriptor for an estimator given as a Python object: it uses all features, and has no parameters to choose."""


@dataclass(frozen=True, repr=False)
class TaskData:
    """The rows of a task under a protocol, and the folds that divide them into training and test rows.

    `X` is tared if the protocol does so, but not scaled or filtered, since a fold's scale is that of its training rows.
    """

    task: TaskSpec
    rules: ProtocolSpec
    split: str
    recorded: Dataset
    """Recordings as they were read, one row for each sample."""
    data: Dataset
    """The same recordings with one row for each answer: a sample, window, frame or whole recording."""
    assignments: tuple[Assignment, ...]
    """Training, test and validation rows of each fold."""
    held_back: bool = False
    """True if thresholds are chosen on a part of the training groups, as no recording has the role validation."""
    unit: str | None = "session"
    """Name of the group labels over which intervals are computed; None for the caller's own split without groups."""
    stamps: tuple[str, ...] = ()
    """Warnings of leaks from training to test in the caller's own split."""
    window: int = 0
    """Number of rows in a window; 0 without windows."""

    def __repr__(self) -> str:
        counts = f"X {self.X.shape}, {len(self.assignments)} folds of {len(self.data.tables)} recordings"
        return f"<TaskData {self.task.name} by {self.split}: {counts}>"

    @property
    def X(self) -> FloatArray:  # noqa: N802  (as in scikit-learn)
        """Return the (n, features), or (n, window, features), readings of the labelled rows that the protocol keeps."""
        return self.data.column(lambda table: tared(table) if self.rules.tare else table.X, self._there)

    @property
    def y(self) -> npt.NDArray[Any]:
        """Return the (n,) target numbers or class indices of the rows of `X`, or (n, components) of a vector target."""
        return self.data.column(lambda table: table.y, self._there)

    @property
    def groups(self) -> npt.NDArray[Any]:
        """Return the (n,) group labels by which the split keeps rows together; session names if it has none."""
        return self.per_row("groups", self.assignments[0].groups)

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Return the names of the columns of `X`."""
        return self.data.features

    @property
    def classes(self) -> tuple[Any, ...]:
        """Return the class labels in order of the class indices in `y`; an empty tuple for regression."""
        return self.data.classes

    @property
    def folds(self) -> list[tuple[IntArray, IntArray]]:
        """Return (training, test) indices of rows of `X` for each fold, as scikit-learn expects for `cv`."""
        there = self._there
        return [(np.flatnonzero(one.train[there]), np.flatnonzero(one.test[there])) for one in self.assignments]

    def per_row(self, argument: str, given: Any) -> npt.NDArray[Any]:
        """Return (n,) values, one for each row of `X`: `given` if it is such an array, or the labels that it names."""
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
        """Return an array over all rows of `data`: the given values at the rows of `X`, zero or "" elsewhere."""
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
    """Turn recordings into rows of features and labels, and divide these rows into folds.

    Parameters
    ----------
    recordings
        Recording files, or a data set read from such files.
    split
        Name of the split, or the caller's own folds; None for the first of the task's splits that is possible.
    estimator
        Determines the features of frames, the gap between training and test where recordings are cut in time (the
        longest mean filter of the estimator), and whether a threshold is to be chosen.
    seed
        Seed of the random split ``shuffled``.
    window, step
        Number of rows in a window, 0 without windows; rows between the ends of two windows; see :func:`windowed`.

    Raises
    ------
    NotApplicable
        If the estimator uses the time and a recording has no clock. If the protocol thins or drops single samples, or
        states a mean filter, and the task has answers to frames or summaries in place of samples.
    """
    recorded = recordings if isinstance(recordings, Dataset) else load_dataset(task, recordings)
    rules = protocol_called(protocol)
    estimator = with_windows(estimator, task, rules)
    frames = task.answer_per == "frame"
    single = rules.every > 1 or rules.k is not None or rules.three_sigma or rules.first_row_only
    if single and (frames or is_summarised(task, rules)):
        raise NotApplicable(
            f"Protocol {protocol!r} is for answers to single samples; {task.name} has answers to summaries of samples.",
            hint=f"Use protocol `{DEPLOYABLE.name}`.",
        )
    recorded = thinned(recorded, rules.every)
    name = split.name if isinstance(split, OwnSplit) else choose_split(task, rules, recorded, split)
    if rules.first_row_only and not isinstance(split, OwnSplit):
        require_first_rows(task, recorded, name)
    if isinstance(split, OwnSplit) and (rules.roles_only or rules.first_row_only):
        raise NotApplicable(f"Protocol {protocol!r} has its own split, not {name}.", hint="Use protocol `deployable`.")
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
            f"The estimator {estimator.name} uses the time alone, but not all of these recordings have a clock.",
            hint="State the clock in the mapping, or leave the estimator out.",
        )
    return made


def _with_own_folds(made: TaskData, own: OwnSplit) -> TaskData:
    """Return `made` with the caller's groups and folds, and a warning if a group or recording is in train and test."""
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
