"""Figures of regression results as in the paper: predictions against time and against the target."""

from __future__ import annotations

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.leaderboard.names import METRIC_NAMES
from tactbench.core.report.figures.group import Group, Sketch, with_unit
from tactbench.core.report.figures.style import panels
from tactbench.core.samples import Answers, FloatArray
from tactbench.core.spec.task import VectorTarget
from tactbench.core.tables.numbers import score_with_unit


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
    figure, axes = panels(len(shown), 2, sharey="row")
    for line, panel in zip(axes, shown, strict=True):
        for here, role in zip(line, ("train", "test"), strict=True):
            answers = panel.answers[role]
            time = end_to_end(answers)
            order = np.lexsort((time, answers.recording))
            breaks = np.flatnonzero(np.diff(answers.recording[order])) + 1  # a line breaks at each new recording
            here.plot(time[order], answers.y_true[order], ".", color="grey", rasterized=True)
            predicted = answers.y_pred[order].astype(np.float64)
            across, upwards = (np.insert(values, breaks, np.nan) for values in (time[order], predicted))
            here.plot(across, upwards, "-", color="C0")
            here.set_title(f"{panel.sensor}, {role}\n{_error(group, answers.y_true, answers.y_pred)}")
            # A recording without clock counts its rows.
            rows = np.array_equal(answers.time_s, answers.row)
            here.set_xlabel("row of the recording" if rows else "time [s]")
        line[0].set_ylabel(with_unit(group.quantity, group.task.unit))
    caption = (
        f"Predicted {group.quantity} (line) and the reference's reading of it (grey dots) against time. Recordings of "
        "one set stand end to end; samples that the protocol discards are missing."
    )
    title = f"Does the answer follow the {group.quantity} in time?"
    return group.sketch("prediction-against-time", title, caption, figure)


def _error(group: Group, true: FloatArray, predicted: FloatArray) -> str:
    """Return the task's error of the answers in a panel as text; of a component of a vector, its RMSE."""
    name = "rmse" if isinstance(group.task.target, VectorTarget) else group.task.metric
    value = metric_called(name).of(true, predicted)
    return f"{METRIC_NAMES.get(name, name)} {score_with_unit(value, group.task.unit)}"


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
    names = group.task.target.names if isinstance(group.task.target, VectorTarget) else ("",)
    shown: list[tuple[str, FloatArray, FloatArray]] = [
        (", ".join(filter(None, (panel.sensor, name))), _column(test.y_true, place), _column(test.y_pred, place))
        for panel in group.panels
        for test in [panel.answers["test"]]
        for place, name in enumerate(names)
    ]
    columns = min(2, len(shown))
    figure, axes = panels(-(-len(shown) // columns), columns, sharex=True, sharey=True)
    every = np.concatenate([values for _, *both in shown for values in both])
    ends = [every.min(), every.max()]
    for here, (title, true, predicted) in zip(axes.flat, shown, strict=False):
        here.plot(true, predicted, ".", color="C0", rasterized=True)
        here.plot(ends, ends, "-", color="black")
        here.set_title(f"{title}\n{_error(group, true, predicted)}")
        here.set_aspect("equal")
        here.tick_params(labelbottom=True)
        here.set_xlabel(with_unit(f"target {group.quantity}", group.task.unit))
    for here in axes.flat[len(shown) :]:
        here.set_visible(False)
    for here in axes[:, 0]:
        here.set_ylabel(with_unit("predicted", group.task.unit))
    caption = (
        f"Predicted against target {group.quantity} of the test set, one dot for each row. Perfect predictions lie on "
        "the black line."
    )
    return group.sketch("residuals", f"How far off is the predicted {group.quantity}?", caption, figure)


def _column(values: FloatArray, place: int) -> FloatArray:
    """Return a column of (n, components) values, or all of (n,) values."""
    return values.reshape(len(values), -1)[:, place]
