"""Windows of consecutive rows of a recording: what models of sequences look at."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.dataset import Dataset, Table
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.sets import asked_for, tared
from tactbench.core.evaluation.splits import Assignment, Mask
from tactbench.core.spec.task import TaskSpec


def windowed(data: Dataset, task: TaskSpec, rules: ProtocolSpec, window: int, step: int) -> Dataset:
    """Return windows of each recording as rows to be answered, `X` (n, window, channels) in order of time.

    A window has `window` consecutive rows that the protocol keeps, tared as it has it, and is labelled as its last row
    is; the next one ends `step` rows later. Raises NotApplicable where rows are no consecutive samples.
    """
    own = task.answer_per == "frame" or task.summaries or task.features_by
    if own or rules.three_sigma or rules.first_row_only or rules.k is not None:
        raise NotApplicable(
            f"window={window} needs runs of samples as they are, which "
            f"{f'task {task.name!r}' if own else f'protocol {rules.name!r}'} does not answer.",
            hint="Use protocol `deployable` and a task of samples, or leave `window` out.",
        )

    def of(table: Table) -> Table:
        rows = asked_for(table, rules)
        last = np.flatnonzero(rows)[window - 1 :: step]
        X = np.zeros((0, window, table.X.shape[1]))
        if len(last):
            kept = (tared(table) if rules.tare else table.X)[rows]
            X = np.lib.stride_tricks.sliding_window_view(kept, window, axis=0)[::step].transpose(0, 2, 1)
        columns = {name: getattr(table, name) for name in ("y", "labelled", "force", "time_s", "row")}
        taken: dict[str, Any] = {name: None if one is None else one[last] for name, one in columns.items()}
        groups = {name: column[last] for name, column in table.groups.items()}
        return replace(table, X=X, **taken, groups=groups, readings=())

    return replace(data, tables=tuple(map(of, data.tables)))


def apart(fold: Assignment, window: int, step: int) -> Assignment:
    """Return a fold without the training windows that have a row in common with a test window."""
    reach = (window - 1) // step

    def clear(train: Mask, test: Mask) -> Mask:
        near = np.convolve(test, np.ones(2 * reach + 1))[reach : reach + len(test)] if len(test) else test
        return np.asarray(train & (near < 0.5))

    return replace(fold, train=tuple(map(clear, fold.train, fold.test)))
