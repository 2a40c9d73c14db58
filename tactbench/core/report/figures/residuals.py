"""What a regression answers against the target: perfect answers would lie on the black line."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from tactbench.core.report.figures.group import Group, Sketch, with_unit
from tactbench.core.report.figures.style import BLACK, corner, tiled
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


def draw(group: Group) -> Sketch:
    """Draw the test set's predictions against their targets, one panel a sensor, or a component of its answers."""
    from matplotlib.ticker import MaxNLocator

    shown = list(_shown(group))
    figure, axes = tiled(len(shown), ACROSS, 2.3, sharex=True, sharey=True)
    unit = group.task.unit
    every = np.concatenate([values for one in shown for values in (one.true, one.answered)])
    ends = [every.min(), every.max()]
    for here, one in zip(axes, shown, strict=True):
        here.plot(
            one.true, one.answered, ".", color=group.colours[one.sensor], markersize=1.6, markeredgewidth=0,
            alpha=0.5, rasterized=True,
        )  # fmt: skip
        here.plot(ends, ends, "-", color=BLACK, linewidth=1.0)
        here.set_title(one.title)
        here.set_aspect("equal")
        for axis in (here.xaxis, here.yaxis):
            axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        corner(here, one.corner)
    for here in axes[-ACROSS:]:  # nothing stands below them
        here.tick_params(labelbottom=True)
        here.set_xlabel(with_unit(f"target {group.quantity}", unit))
    for here in axes[::ACROSS]:
        here.set_ylabel(with_unit("predicted", unit))
    bias = "; ".join(f"{one.title} {np.mean(one.answered - one.true):+.3g}" for one in shown)
    caption = (
        f"Predicted against target {group.quantity}, a dot a row of the test set. Perfect predictions lie on the "
        f"black line. Mean of prediction minus target: {bias}{suffix(unit)}."
    )
    return group.sketch("residuals", f"How far off is the predicted {group.quantity}?", caption, figure)


def _shown(group: Group) -> Iterator[_Shown]:
    target, unit = group.task.target, group.task.unit
    for panel in group.panels:
        true, answered = panel.answers["test"].y_true, panel.answers["test"].y_pred
        if not isinstance(target, VectorTarget):
            text = f"{group.metric} {score_with_unit(panel.row['score'], unit)}"
            yield _Shown(panel.sensor, panel.sensor, true, answered, text)
            continue
        for place, name in enumerate(target.names):
            text = f"RMSE {score_with_unit(float(np.sqrt(np.mean((answered - true)[:, place] ** 2))), unit)}"
            yield _Shown(panel.sensor, f"{panel.sensor}, {name}", true[:, place], answered[:, place], text)
