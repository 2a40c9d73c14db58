"""What a regression answers against time: reference in grey dots, prediction as a line of the sensor's colour."""

from __future__ import annotations

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.report.figures.group import Group, Panel, Remark
from tactbench.core.report.figures.sketch import Sketch, coloured, heading, marks, metric_name, quantity, with_unit
from tactbench.core.report.figures.style import GREY, corner, legend, panels
from tactbench.core.samples import Answers, FloatArray
from tactbench.core.spec.scene import Role
from tactbench.core.spec.task import TaskSpec
from tactbench.core.tables.numbers import score_with_unit

SHOWN: tuple[Role, ...] = ("train", "test")
WORDS = {"train": "training", "test": "test"}


def draw(group: Group, remark: Remark) -> Sketch:
    """Draw one row a sensor: left the training set, right the test set.

    Raises
    ------
    NotApplicable
        If no sensor has answers on its training set: the split has several folds.
    """
    shown = [panel for panel in group.panels if "train" in panel.answers]
    if not shown:
        raise NotApplicable(f"split {group.row['split']!r} has a training set a fold; none stands for all")
    figure, axes = panels(len(shown), 2, 1.35, sharey="row")
    metric, unit = metric_name(group.task), group.task.unit
    clocked = all(_clocked(panel.answers[role]) for panel in shown for role in SHOWN)
    for place, panel in enumerate(shown):
        for column, role in enumerate(SHOWN):
            here, answers = axes[place, column], panel.answers[role]
            time = end_to_end(answers)
            order, breaks = _in_time(time, answers)
            line = np.insert(answers.y_pred[order].astype(np.float64), breaks, np.nan)
            here.plot(
                time[order], answers.y_true[order], ".", color=GREY, markersize=1.2, markeredgewidth=0,
                rasterized=True, label="reference",
            )  # fmt: skip
            here.plot(
                np.insert(time[order], breaks, np.nan), line, "-", color=group.colours[panel.sensor], linewidth=0.7,
                label=f"prediction, {panel.sensor}",
            )  # fmt: skip
            here.set_title(f"{panel.sensor}, {WORDS[role]}")
            corner(here, f"{metric} {score_with_unit(_score(panel, role, group.task), unit)}")
            if place == len(shown) - 1:
                here.set_xlabel("time [s]" if clocked else "row of the recording")
        axes[place, 0].set_ylabel(with_unit(quantity(group.task), group.task.unit))
    figure.suptitle(heading(group))
    legend(figure, axes[:, 0], markerscale=4)
    caption = (
        f"Predicted {quantity(group.task)} (line) and the reference's reading of it (grey dots) against time, "
        f"one row a sensor ({coloured(group, shown)}); left the training set, right the test set. In the corner "
        f"the {metric} of the set. Recordings of one set stand end to end; samples that the protocol "
        f"discards are missing.{marks(group)}"
    )
    title = f"{quantity(group.task).capitalize()} against time"
    return Sketch("prediction-against-time", title, caption, group, figure)


def end_to_end(answers: Answers) -> FloatArray:
    """Return (n,) times, each recording of the set beginning where the one before it ended."""
    time = answers.time_s.astype(np.float64).copy()
    offset = 0.0
    for one in np.unique(answers.recording):
        mine = answers.recording == one
        own = answers.time_s[mine]
        time[mine] = own - (own.min() if offset else 0.0) + offset
        offset = float(time[mine].max())
    return time


def _in_time(time: FloatArray, answers: Answers) -> tuple[np.ndarray, np.ndarray]:
    """Return the order of the rows in time, and before which of them a line must break: at each new recording."""
    order = np.lexsort((time, answers.recording))
    return order, np.flatnonzero(np.diff(answers.recording[order])) + 1


def _clocked(answers: Answers) -> bool:
    """Tell whether times are seconds: a recording without clock counts its rows instead."""
    return not np.array_equal(answers.time_s, answers.row)


def _score(panel: Panel, role: Role, task: TaskSpec) -> float:
    answers = panel.answers[role]
    if role == "test":
        return float(panel.row["score"])
    return metric_called(task.metric).of(answers.y_true, answers.y_pred)
