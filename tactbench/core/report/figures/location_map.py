"""How far off a contact's place is answered, as a map of the skin."""

from __future__ import annotations

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.metrics import distances
from tactbench.core.report.figures.group import Group, Remark
from tactbench.core.report.figures.residuals import ACROSS
from tactbench.core.report.figures.sketch import Sketch, heading, marks, metric_name, sensors, with_unit
from tactbench.core.report.figures.style import GREY, panels
from tactbench.core.samples import Answers, FloatArray
from tactbench.core.spec.row import HIGH_ERROR, MEDIAN_ERROR
from tactbench.core.spec.task import VectorTarget
from tactbench.core.tables.numbers import score, score_with_unit

CELLS = 20
"""Of the map, along its longer side: the rows of a cell are one dot."""


def draw(group: Group, remark: Remark) -> Sketch:
    """Draw the test set's true places, coloured by the error there, one panel a sensor.

    Raises
    ------
    NotApplicable
        If the task asks for no position in two coordinates.
    """
    target = group.task.target
    if not (isinstance(target, VectorTarget) and target.kind == "position" and len(target.names) == 2):
        raise NotApplicable("the target is no position in two coordinates")
    rows, columns = -(-len(group.panels) // ACROSS), min(len(group.panels), ACROSS)
    figure, axes = panels(rows, columns, 2.5)
    for here in axes.flat[len(group.panels) :]:
        here.set_visible(False)
    maps = [places(panel.answers["test"]) for panel in group.panels]
    most = max(float(error.max()) for _, _, error in maps)
    for here, panel, (true, answered, error) in zip(axes.flat, group.panels, maps, strict=False):
        here.plot(*np.stack([true, answered]).transpose(2, 0, 1), "-", color=GREY, linewidth=0.6, zorder=1)
        dots = here.scatter(*true.T, c=error, s=12, vmin=0.0, vmax=most, cmap="viridis_r", linewidths=0)
        median = score_with_unit(panel.row["scores"][MEDIAN_ERROR], target.unit)
        here.set_title(f"{panel.sensor}, median {median}")
        here.set_aspect("equal")
        here.set_xlabel(with_unit(target.names[0], target.unit))
        here.set_ylabel(with_unit(target.names[1], target.unit))
    figure.colorbar(
        dots, ax=axes, location="bottom", label=with_unit("mean error", target.unit), shrink=0.6, aspect=30
    )  # fmt: skip
    figure.suptitle(heading(group))
    numbers = "; ".join(
        f"{panel.sensor} {metric_name(group.task)} {score(panel.row['score'], target.unit)}, median "
        f"{score(panel.row['scores'][MEDIAN_ERROR], target.unit)}, 95th percentile "
        f"{score(panel.row['scores'][HIGH_ERROR], target.unit)}"
        for panel in group.panels
    )
    caption = (
        f"Error of the answered contact location over the skin, one panel a sensor ({sensors(group)}), in the "
        f"coordinates of its reference. A dot is a place of the test set, the mean of the test rows within one of "
        f"{CELLS} by {CELLS} cells; its colour is their mean error, the line from it leads to the mean answer. Over "
        f"all test rows [{target.unit}]: {numbers}.{marks(group)}"
    )
    return Sketch("location-map", "Location error as a map of the skin", caption, group, figure)


def places(answers: Answers) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean (n, 2) true place, the mean (n, 2) answer and the (n,) mean error of each cell with rows."""
    true = np.asarray(answers.y_true, dtype=np.float64)
    lowest = true.min(axis=0)
    width = max(float(np.ptp(true, axis=0).max()), np.finfo(np.float64).tiny) / CELLS
    cells = np.minimum((true - lowest) // width, CELLS - 1)
    _, code, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), 5))
    np.add.at(sums, code.reshape(-1), np.column_stack([true, answers.y_pred, distances(true, answers.y_pred)]))
    means = sums / counts[:, None]
    return means[:, :2], means[:, 2:4], means[:, 4]
