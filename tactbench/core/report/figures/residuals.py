"""What a regression answers against the target: perfect answers would lie on the black line."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from tactbench.core.report.figures.group import Group, Remark
from tactbench.core.report.figures.sketch import Sketch, coloured, heading, marks, metric_name, quantity, with_unit
from tactbench.core.report.figures.style import BLACK, corner, legend, panels
from tactbench.core.samples import FloatArray
from tactbench.core.spec.task import VectorTarget
from tactbench.core.tables.numbers import score_with_unit, suffix

ACROSS = 2
"""Panels beside each other."""


class _Shown(NamedTuple):
    """One panel of the figure: what a sensor answered, or one component of it."""

    sensor: str
    title: str
    true: FloatArray
    answered: FloatArray
    corner: str


def draw(group: Group, remark: Remark) -> Sketch:
    """Draw the test set's predictions against their targets, one panel a sensor, or a component of its answers."""
    from matplotlib.ticker import MaxNLocator

    shown = list(_shown(group))
    count = len(shown)
    rows, columns = -(-count // ACROSS), min(count, ACROSS)
    figure, axes = panels(rows, columns, 2.3, sharex=True, sharey=True)
    unit = suffix(group.task.unit)
    every = [values for one in shown for values in (one.true, one.answered)]
    low, high = min(float(values.min()) for values in every), max(float(values.max()) for values in every)
    for here in axes.flat[count:]:
        here.set_visible(False)
    for here, one in zip(axes.flat, shown, strict=False):
        here.plot(
            one.true, one.answered, ".", color=group.colours[one.sensor], markersize=1.6, markeredgewidth=0,
            alpha=0.5, rasterized=True, label=f"test rows, {one.sensor}",
        )  # fmt: skip
        here.plot([low, high], [low, high], "-", color=BLACK, linewidth=1.0, label="perfect answers")
        here.set_title(one.title)
        here.set_aspect("equal")
        for axis in (here.xaxis, here.yaxis):
            axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        corner(here, one.corner)
    for here in axes.flat[max(count - columns, 0) : count]:  # nothing stands below them
        here.tick_params(labelbottom=True)
        here.set_xlabel(with_unit(f"target {quantity(group.task)}", group.task.unit))
    for here in axes[:, 0]:
        here.set_ylabel(with_unit("predicted", group.task.unit))
    figure.suptitle(heading(group))
    legend(figure, axes.flat[:count], markerscale=3)
    bias = "; ".join(f"{one.title} {np.mean(one.answered - one.true):+.3g}" for one in shown)
    each = "component of a sensor's answers" if isinstance(group.task.target, VectorTarget) else "sensor"
    caption = (
        f"Predicted against target {quantity(group.task)} on the test set, one panel a {each} "
        f"({coloured(group, group.panels)}). Perfect predictions lie on the black line. "
        f"Mean of prediction minus target: {bias}{unit}.{marks(group)}"
    )
    return Sketch("residuals", f"Predicted against target {quantity(group.task)}", caption, group, figure)


def _shown(group: Group) -> Iterator[_Shown]:
    target, unit = group.task.target, group.task.unit
    for panel in group.panels:
        true, answered = panel.answers["test"].y_true, panel.answers["test"].y_pred
        if not isinstance(target, VectorTarget):
            text = f"{metric_name(group.task)} {score_with_unit(panel.row['score'], unit)}"
            yield _Shown(panel.sensor, panel.sensor, true, answered, text)
            continue
        for place, name in enumerate(target.names):
            text = f"RMSE {score_with_unit(float(np.sqrt(np.mean((answered - true)[:, place] ** 2))), unit)}"
            yield _Shown(panel.sensor, f"{panel.sensor}, {name}", true[:, place], answered[:, place], text)
