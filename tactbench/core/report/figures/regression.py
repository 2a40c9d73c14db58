"""Figures of regression results as in the paper: predictions against time and against the target."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.report.figures.group import Group, Sketch, with_unit
from tactbench.core.report.figures.style import BLACK, GREY, corner, panels
from tactbench.core.samples import Answers, FloatArray
from tactbench.core.spec.task import VectorTarget
from tactbench.core.tables.numbers import score_with_unit, suffix


def prediction_against_time(group: Group) -> Sketch:
    """Draw predictions against time, one row of panels for each sensor: left the training set, right the test set.

    Raises
    ------
    NotApplicable
        If there are no answers on a training set, since the split has several folds.
    """
    shown = [panel for panel in group.panels if "train" in panel.answers]
    if not shown:
        raise NotApplicable(f"split {group.row['split']!r} has one training set for each fold, not a common one")
    figure, axes = panels(len(shown), 2, 1.35, sharey="row")
    for line, panel in zip(axes, shown, strict=True):
        for here, role in zip(line, ("train", "test"), strict=True):
            answers = panel.answers[role]
            time = end_to_end(answers)
            order = np.lexsort((time, answers.recording))
            breaks = np.flatnonzero(np.diff(answers.recording[order])) + 1  # a line breaks at each new recording
            style = {"color": GREY, "markersize": 1.2, "markeredgewidth": 0, "rasterized": True}
            here.plot(time[order], answers.y_true[order], ".", **style)
            predicted = answers.y_pred[order].astype(np.float64)
            across, upwards = (np.insert(values, breaks, np.nan) for values in (time[order], predicted))
            here.plot(across, upwards, "-", color=group.colours[panel.sensor], linewidth=0.7)
            here.set_title(f"{panel.sensor}, {'training' if role == 'train' else 'test'}")
            value = panel.row["score"]
            if role == "train":
                value = metric_called(group.task.metric).of(answers.y_true, answers.y_pred)
            corner(here, f"{group.metric} {score_with_unit(value, group.task.unit)}")
            # A recording without clock counts its rows.
            rows = np.array_equal(answers.time_s, answers.row)
            here.set_xlabel("row of the recording" if rows else "time [s]")
        line[0].set_ylabel(with_unit(group.quantity, group.task.unit))
    caption = (
        f"Predicted {group.quantity} (line) and the reference's reading of it (grey dots) against time; left the "
        f"training set, right the test set, in the corner the {group.metric} of the set. Recordings of one set stand "
        "end to end; samples that the protocol discards are missing."
    )
    title = f"Does the answer follow the {group.quantity} in time?"
    return group.sketch("prediction-against-time", title, caption, figure)


def end_to_end(answers: Answers) -> FloatArray:
    """Return (n,) times [s] in which each recording begins where the previous recording ended."""
    time = answers.time_s.astype(np.float64)
    offset = 0.0
    for one in np.unique(answers.recording):
        own = answers.recording == one
        time[own] += offset - (time[own].min() if offset else 0.0)
        offset = float(time[own].max())
    return time


def residuals(group: Group) -> Sketch:
    """Draw the test set's predictions against their targets, one panel for each sensor or component of its answers."""
    shown = list(_components(group))
    columns = min(2, len(shown))
    figure, axes = panels(-(-len(shown) // columns), columns, 2.3, sharex=True, sharey=True)
    unit = group.task.unit
    every = np.concatenate([values for _, _, *both, _ in shown for values in both])
    ends = [every.min(), every.max()]
    for here, (sensor, title, true, predicted, text) in zip(axes.flat, shown, strict=False):
        style = {"markersize": 1.6, "markeredgewidth": 0, "alpha": 0.5, "rasterized": True}
        here.plot(true, predicted, ".", color=group.colours[sensor], **style)
        here.plot(ends, ends, "-", color=BLACK, linewidth=1.0)
        here.set_title(title)
        here.set_aspect("equal")
        here.locator_params(nbins=6, steps=[1, 2, 5, 10])
        corner(here, text)
        here.tick_params(labelbottom=True)
        here.set_xlabel(with_unit(f"target {group.quantity}", unit))
    for here in axes.flat[len(shown) :]:
        here.set_visible(False)
    for here in axes[:, 0]:
        here.set_ylabel(with_unit("predicted", unit))
    bias = "; ".join(f"{title} {np.mean(predicted - true):+.3g}" for _, title, true, predicted, _ in shown)
    caption = (
        f"Predicted against target {group.quantity}, one dot for each test row. Perfect predictions lie on the "
        f"black line. Mean of prediction minus target: {bias}{suffix(unit)}."
    )
    return group.sketch("residuals", f"How far off is the predicted {group.quantity}?", caption, figure)


def _components(group: Group) -> Iterator[tuple[str, str, FloatArray, FloatArray, str]]:
    """Yield (sensor, title, targets, predictions, text of the error) for each panel."""
    target, unit = group.task.target, group.task.unit
    for panel in group.panels:
        true, predicted = panel.answers["test"].y_true, panel.answers["test"].y_pred
        if not isinstance(target, VectorTarget):
            text = f"{group.metric} {score_with_unit(panel.row['score'], unit)}"
            yield panel.sensor, panel.sensor, true, predicted, text
            continue
        for place, name in enumerate(target.names):
            own = true[:, place], predicted[:, place]
            rmse = float(np.sqrt(np.mean((own[1] - own[0]) ** 2)))
            yield panel.sensor, f"{panel.sensor}, {name}", *own, f"RMSE {score_with_unit(rmse, unit)}"
