"""Whether the first row of a recording can be asked for the recording's answer."""

from __future__ import annotations

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.spec.task import TaskSpec

_NAME = "first-frame"


def require_first_rows(task: TaskSpec, data: Dataset, split: str) -> None:
    """Refuse recordings whose first row stands for nothing that comes later.

    Raises
    ------
    NotApplicable
        If the answer changes within a recording or is not there in any first row, every recording is a single reading,
        or `split` cuts recordings in time, so that no first row is ever tested.
    """
    for table in data.tables:
        if len(np.unique(table.y[table.labelled], axis=0)) > 1:
            raise NotApplicable(
                f"Protocol {_NAME!r} asks whether the first row of a recording gives its answer away; the answer of "
                f"task {task.name!r} changes within recording {table.meta.name!r}, and nothing in it comes before.",
                hint="Compare with --split shuffled instead.",
            )
    if not any(table.labelled[:1].any() for table in data.tables):
        raise NotApplicable(
            f"Protocol {_NAME!r} asks whether the first row of a recording gives its answer away; the first row of no "
            f"recording has an answer to task {task.name!r}.",
            hint="Compare with --split shuffled instead.",
        )
    if all(len(table.row) == 1 for table in data.tables):
        raise NotApplicable(
            f"Protocol {_NAME!r} asks what is known before anything happened; each of these recordings is one reading.",
            hint="Compare with --split shuffled instead.",
        )
    if split == "in-session":
        raise NotApplicable(
            f"Split 'in-session' tests the end of every recording; protocol {_NAME!r} keeps its first row only.",
            hint="Use a split that keeps recordings whole.",
        )
