"""From recordings to folds: rows of X and y, and which of them train and test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.dataset import Dataset, load_dataset, thinned
from tactbench.core.evaluation.frames import framed
from tactbench.core.evaluation.protocols import ProtocolSpec, protocol_called, without_options
from tactbench.core.evaluation.sets import asked_for, tare_s, tared
from tactbench.core.evaluation.splits import Assignment, choose_split, make_splits, with_validation
from tactbench.core.evaluation.summaries import is_summarised, summarised, with_windows
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.task import TaskSpec

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
        If the estimator looks at the time and a recording states none: the order of its rows may be anybody's. If the
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
    split = choose_split(task, rules, recorded, split)
    if rules.tare:
        tare_s(recorded)  # refuses recordings of which some only can be tared
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
