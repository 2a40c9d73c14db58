"""How far off a contact's place is answered, as a map of the skin."""

from __future__ import annotations

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.metrics import distances
from tactbench.core.report.figures.group import Group, Sketch, with_unit
from tactbench.core.report.figures.style import GREY, tiled
from tactbench.core.samples import Answers, FloatArray
from tactbench.core.spec.row import MEDIAN_ERROR
from tactbench.core.spec.task import VectorTarget
from tactbench.core.tables.numbers import score_with_unit

ACROSS = 2
"""Panels beside each other."""
CELLS = 20
"""Of the map, along its longer side: the rows of a cell are one dot."""


def draw(group: Group) -> Sketch:
    """Draw the test set's true places, coloured by the error there, one panel a sensor.

    Raises
    ------
    NotApplicable
        If the task asks for no position in two coordinates.
    """
    target = group.task.target
    if not (isinstance(target, VectorTarget) and target.kind == "position" and len(target.names) == 2):
        raise NotApplicable("the target is no position in two coordinates")
    unit = target.unit
    figure, axes = tiled(len(group.panels), ACROSS, 2.5)
    maps = [places(panel.answers["test"]) for panel in group.panels]
    most = max(float(error.max()) for _, _, error in maps)
    for here, panel, (true, answered, error) in zip(axes, group.panels, maps, strict=True):
        here.plot(*np.stack([true, answered]).transpose(2, 0, 1), "-", color=GREY, linewidth=0.6, zorder=1)
        dots = here.scatter(true[:, 0], true[:, 1], c=error, s=12, vmin=0.0, vmax=most, cmap="viridis_r", linewidths=0)
        here.set_title(f"{panel.sensor}, median {score_with_unit(panel.row['scores'][MEDIAN_ERROR], unit)}")
        here.set_aspect("equal")
        here.set_xlabel(with_unit(target.names[0], unit))
        here.set_ylabel(with_unit(target.names[1], unit))
    figure.colorbar(dots, ax=axes, location="bottom", label=with_unit("mean error", unit), shrink=0.6, aspect=30)
    caption = (
        "Error of the answered contact location over the skin, in the coordinates of its reference. A dot is a place "
        f"of the test set, the mean of the test rows within one of {CELLS} by {CELLS} cells; its colour is their mean "
        "error, the line from it leads to the mean answer."
    )
    return group.sketch("location-map", "Where on the skin is the answered location off?", caption, figure)


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
