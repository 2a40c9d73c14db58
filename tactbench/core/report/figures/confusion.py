"""Which class is taken for which: rows are what was true, columns what was answered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.report.figures.group import Group, Panel, Remark
from tactbench.core.report.figures.sketch import Sketch, heading, marks, metric_name, quantity, sensors, with_unit
from tactbench.core.report.figures.style import COLUMN_IN, PAGE_IN, panels
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.task import LabelTarget
from tactbench.core.tables.numbers import score

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDE_FROM = 7
"""So many classes need both columns of a page."""
NUMBERS_UP_TO = 14
"""With more classes numbers no longer fit into their squares."""


def draw(group: Group, remark: Remark) -> Sketch:
    """Draw one row a sensor: left the validation set where there is one, right the test set.

    Raises
    ------
    NotApplicable
        If no cell has a confusion matrix.
    """
    shown = [panel for panel in group.panels if panel.row["confusion"] is not None]
    if not shown:
        raise NotApplicable("no cell has a confusion matrix")
    n_classes = max(len(panel.row["classes"]) for panel in shown)
    validated = any("validation" in panel.answers for panel in shown)
    columns = 2 if validated else 1
    wide = n_classes >= WIDE_FROM
    height = (3.1 if wide else 1.4) if validated else 3.0
    figure, axes = panels(len(shown), columns, height, width_in=PAGE_IN if wide and validated else COLUMN_IN)
    unit = group.task.target.unit if isinstance(group.task.target, LabelTarget) else "1"
    for place, panel in enumerate(shown):
        tables = matrices(panel)
        for column, role in enumerate(("validation", "test") if validated else ("test",)):
            here = axes[place, column]
            if role not in tables:
                here.set_visible(False)
                continue
            _matrix(here, tables[role], panel.row["classes"])
            here.set_title(f"{panel.sensor}, {role}")
            if column == 0 or "validation" not in tables:
                here.set_ylabel(with_unit(f"true {quantity(group.task)}", unit))
            if place == len(shown) - 1:
                here.set_xlabel(with_unit("answered", unit))
    figure.suptitle(heading(group))
    metric = metric_name(group.task)
    scores = ", ".join(f"{panel.sensor} {score(panel.row['score'], group.task.unit)}" for panel in shown)
    left = "left the validation set, right the test set" if validated else "the test set"
    caption = (
        f"Confusion matrices, one row a sensor ({sensors(group)}): {left}. Rows are the true "
        f"{with_unit(quantity(group.task), unit)}, columns the answer; numbers are per cent of the row, whose "
        f"count of {group.task.answer_per}s stands on the right (n). A perfect answer would be a clear diagonal. "
        f"{metric} of the test set: {scores}.{marks(group)}"
    )
    return Sketch("confusion", f"Confusion of {quantity(group.task)}", caption, group, figure)


def matrices(panel: Panel) -> dict[str, IntArray]:
    """Return (true, answered) counts of the validation set, where there is one, and of the test set: the row's own."""
    found = {"test": np.asarray(panel.row["confusion"], dtype=np.int64)}
    validation = panel.answers.get("validation")
    if validation is not None:
        n = len(panel.row["classes"])
        found["validation"] = np.zeros((n, n), dtype=np.int64)
        np.add.at(found["validation"], (validation.y_true.astype(int), validation.y_pred.astype(int)), 1)
    return found


def shares(table: IntArray) -> FloatArray:
    """Return the table normalised by row; a class that never occurs has a row of zeros."""
    total = table.sum(axis=1, keepdims=True)
    return np.asarray(np.divide(table, total, out=np.zeros(table.shape), where=total > 0))


def _matrix(here: Axes, table: IntArray, classes: list[Any]) -> None:
    share = shares(table)
    n = len(classes)
    here.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0, aspect="equal")
    names = [f"{one:g}" if isinstance(one, int | float) else str(one) for one in classes]
    turned = 90 if max(len(name) for name in names) > 4 and n > 3 else 0
    here.set_xticks(range(n), names, rotation=turned)
    here.set_yticks(range(n), names)
    here.tick_params(length=0)
    for side in here.spines.values():
        side.set_visible(False)
    if n > NUMBERS_UP_TO:
        return
    for i in range(n):
        for j in range(n):
            here.text(
                j, i, f"{100 * share[i, j]:.0f}", ha="center", va="center",
                color="white" if share[i, j] > 0.55 else "black",
            )  # fmt: skip
        here.text(n - 0.35, i, str(table[i].sum()), ha="left", va="center")
    here.text(n - 0.35, -0.6, "n", ha="left", va="bottom")
