"""What a regression answers against the target: perfect answers would lie on the black line."""

from __future__ import annotations

import numpy as np

from tactbench.core.report.figures.group import Group, Remark
from tactbench.core.report.figures.sketch import Sketch, coloured, heading, marks, metric_name, quantity, with_unit
from tactbench.core.report.figures.style import BLACK, corner, legend, panels
from tactbench.core.tables.numbers import score, suffix

ACROSS = 2
"""Panels beside each other."""


def draw(group: Group, remark: Remark) -> Sketch:
    """Draw the test set's predictions against their targets, one panel a sensor."""
    from matplotlib.ticker import MaxNLocator

    count = len(group.panels)
    rows, columns = -(-count // ACROSS), min(count, ACROSS)
    figure, axes = panels(rows, columns, 2.3, sharex=True, sharey=True)
    unit = suffix(group.task.unit)
    every = [
        values for panel in group.panels for values in (panel.answers["test"].y_true, panel.answers["test"].y_pred)
    ]
    low, high = min(float(values.min()) for values in every), max(float(values.max()) for values in every)
    for here in axes.flat[count:]:
        here.set_visible(False)
    for here, panel in zip(axes.flat, group.panels, strict=False):
        test = panel.answers["test"]
        here.plot(
            test.y_true, test.y_pred, ".", color=group.colours[panel.sensor], markersize=1.6, markeredgewidth=0,
            alpha=0.5, rasterized=True, label=f"test rows, {panel.sensor}",
        )  # fmt: skip
        here.plot([low, high], [low, high], "-", color=BLACK, linewidth=1.0, label="perfect answers")
        here.set_title(panel.sensor)
        here.set_aspect("equal")
        for axis in (here.xaxis, here.yaxis):
            axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        corner(here, f"{metric_name(group.task)} {score(panel.row['score'], group.task.unit)}{unit}")
    for here in axes.flat[max(count - columns, 0) : count]:  # nothing stands below them
        here.tick_params(labelbottom=True)
        here.set_xlabel(with_unit(f"target {quantity(group.task)}", group.task.unit))
    for here in axes[:, 0]:
        here.set_ylabel(with_unit("predicted", group.task.unit))
    figure.suptitle(heading(group))
    legend(figure, axes.flat[:count], markerscale=3)
    bias = "; ".join(
        f"{panel.sensor} {np.mean(panel.answers['test'].y_pred - panel.answers['test'].y_true):+.3g}"
        for panel in group.panels
    )
    caption = (
        f"Predicted against target {quantity(group.task)} on the test set, one panel a sensor "
        f"({coloured(group, group.panels)}). Perfect predictions lie on the black line. "
        f"Mean of prediction minus target: {bias}{unit}.{marks(group)}"
    )
    return Sketch("residuals", f"Predicted against target {quantity(group.task)}", caption, group, figure)
