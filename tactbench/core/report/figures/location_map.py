"""How far off a contact's place is answered, as a map of the skin."""

from __future__ import annotations

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.metrics import distances
from tactbench.core.report.figures.group import Group, Sketch, with_unit
from tactbench.core.report.figures.style import tiled
from tactbench.core.spec.row import MEDIAN_ERROR
from tactbench.core.spec.task import VectorTarget
from tactbench.core.tables.numbers import score_with_unit

ACROSS = 2
"""Panels beside each other."""
CELLS = 20
"""Hexagons of the map along the first axis."""


def draw(group: Group) -> Sketch:
    """Draw the mean error over the test set's true places, one panel a sensor.

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
    tests = [panel.answers["test"] for panel in group.panels]
    errors = [distances(np.asarray(test.y_true, dtype=np.float64), test.y_pred) for test in tests]
    most = max(float(error.max()) for error in errors)
    for here, panel, test, error in zip(axes, group.panels, tests, errors, strict=True):
        cells = here.hexbin(
            test.y_true[:, 0],
            test.y_true[:, 1],
            error,
            gridsize=CELLS,
            vmin=0.0,
            vmax=most,
            cmap="viridis_r",
            linewidths=0,
        )
        here.set_title(f"{panel.sensor}, median {score_with_unit(panel.row['scores'][MEDIAN_ERROR], unit)}")
        here.set_aspect("equal")
        here.set_xlabel(with_unit(target.names[0], unit))
        here.set_ylabel(with_unit(target.names[1], unit))
    figure.colorbar(cells, ax=axes, location="bottom", label=with_unit("mean error", unit), shrink=0.6, aspect=30)
    caption = (
        "Error of the answered contact location over the skin, in the coordinates of its reference: the mean over the "
        "test rows whose true place is within a hexagon."
    )
    return group.sketch("location-map", "Where on the skin is the answered location off?", caption, figure)
