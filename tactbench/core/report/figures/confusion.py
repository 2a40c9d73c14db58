"""Which class is taken for which: rows are what was true, columns what was answered."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.core.report.figures.group import Group, Panel, Sketch, class_name, with_unit
from tactbench.core.report.figures.style import COLUMN_IN, PAGE_IN, panels
from tactbench.core.samples import IntArray
from tactbench.core.tables.numbers import score

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDE_FROM = 7
"""So many classes need both columns of a page."""
NUMBERS_UP_TO = 14
"""With more classes numbers no longer fit into their squares."""


def draw(group: Group) -> Sketch:
    """Draw one row a sensor: left the validation set where there is one, right the test set."""
    shown = group.panels
    roles = ("validation", "test") if any("validation" in panel.answers for panel in shown) else ("test",)
    wide = max(len(panel.row["classes"]) for panel in shown) >= WIDE_FROM
    width = PAGE_IN if wide else COLUMN_IN
    figure, axes = panels(len(shown), len(roles), 0.85 * width / len(roles), width_in=width)
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
    rows = [np.sum(panel.row["confusion"], axis=1) for panel in shown]
    counts = ", ".join(f"{panel.sensor} {own.min()} to {own.max()}" for panel, own in zip(shown, rows, strict=True))
    scores = ", ".join(f"{panel.sensor} {score(panel.row['score'], group.task.unit)}" for panel in shown)
    caption = (
        f"Rows are the true {group.quantity}, columns the answer; numbers are per cent of the row. Tested "
        f"{group.task.answer_per}s of a class: {counts}. {group.metric} of the test set: {scores}."
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


def _matrix(here: Axes, table: IntArray, classes: list[Any]) -> None:
    total = table.sum(axis=1, keepdims=True)
    per_cent = np.divide(100 * table, total, out=np.zeros(table.shape), where=total > 0)
    names = list(map(class_name, classes))
    importlib.import_module("sklearn.metrics").ConfusionMatrixDisplay(per_cent, display_labels=names).plot(
        ax=here, cmap="Blues", colorbar=False, values_format=".0f", include_values=len(names) <= NUMBERS_UP_TO,
        im_kw={"vmin": 0.0, "vmax": 100.0}, xticks_rotation=90 if max(map(len, names)) > 4 and len(names) > 3 else 0.0,
    )  # fmt: skip
    here.set_ylabel("")
    here.tick_params(length=0)
    here.spines[:].set_visible(False)
