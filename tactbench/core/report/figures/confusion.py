"""Which class is taken for which: rows are what was true, columns what was answered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.report.figures.group import Group, Panel, Sketch, class_name, with_unit
from tactbench.core.report.figures.style import COLUMN_IN, PAGE_IN, panels
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.tables.numbers import score

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDE_FROM = 7
"""So many classes need both columns of a page."""
NUMBERS_UP_TO = 14
"""With more classes numbers no longer fit into their squares."""


def draw(group: Group) -> Sketch:
    """Draw one row a sensor: left the validation set where there is one, right the test set.

    Raises
    ------
    NotApplicable
        If no cell has a confusion matrix.
    """
    shown = [panel for panel in group.panels if panel.row["confusion"] is not None]
    if not shown:
        raise NotApplicable("no cell has a confusion matrix")
    roles = ("validation", "test") if any("validation" in panel.answers for panel in shown) else ("test",)
    wide = max(len(panel.row["classes"]) for panel in shown) >= WIDE_FROM
    height = 3.0 if wide or len(roles) == 1 else 1.4
    figure, axes = panels(len(shown), len(roles), height, width_in=PAGE_IN if wide and len(roles) > 1 else COLUMN_IN)
    for place, panel in enumerate(shown):
        tables = matrices(panel)
        for here, role in zip(axes[place], roles, strict=True):
            if role not in tables:
                here.set_visible(False)
                continue
            _matrix(here, tables[role], panel.row["classes"])
            here.set_title(f"{panel.sensor}, {role}")
            here.set_xlabel(with_unit("answered", group.unit))
        axes[place, 0].set_ylabel(with_unit(f"true {group.quantity}", group.unit))
    scores = ", ".join(f"{panel.sensor} {score(panel.row['score'], group.task.unit)}" for panel in shown)
    caption = (
        f"Rows are the true {group.quantity}, columns the answer; numbers are per cent of the row, whose "
        f"count of {group.task.answer_per}s stands on the right (n). {group.metric} of the test set: {scores}."
    )
    return group.sketch("confusion", f"Which {group.quantity} is taken for which?", caption, figure)


def matrices(panel: Panel) -> dict[str, IntArray]:
    """Return (true, answered) counts of the validation set, where there is one, and of the test set: the row's own."""
    found = {"test": np.asarray(panel.row["confusion"], dtype=np.int64)}
    validation = panel.answers.get("validation")
    if validation is not None:
        found["validation"] = np.zeros_like(found["test"])
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
    names = list(map(class_name, classes))
    here.set_xticks(range(n), names, rotation=90 if max(map(len, names)) > 4 and n > 3 else 0)
    here.set_yticks(range(n), names)
    here.tick_params(length=0)
    here.spines[:].set_visible(False)
    if n > NUMBERS_UP_TO:
        return
    for (i, j), one in np.ndenumerate(share):
        here.text(j, i, f"{100 * one:.0f}", ha="center", va="center", color="white" if one > 0.55 else "black")
    for i in range(n):
        here.text(n - 0.35, i, str(table[i].sum()), ha="left", va="center")
    here.text(n - 0.35, -0.6, "n", ha="left", va="bottom")
