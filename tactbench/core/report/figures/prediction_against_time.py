"""What a regression answers against time: reference in grey dots, prediction as a line of the sensor's colour."""

from __future__ import annotations

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.report.figures.group import Group, Sketch, with_unit
from tactbench.core.report.figures.style import GREY, corner, panels
from tactbench.core.samples import Answers, FloatArray
from tactbench.core.tables.numbers import score_with_unit

SHOWN = {"train": "training", "test": "test"}


def draw(group: Group) -> Sketch:
    """Draw one row a sensor: left the training set, right the test set.

    Raises
    ------
    NotApplicable
        If no sensor has answers on its training set: the split has several folds.
    """
    shown = [panel for panel in group.panels if "train" in panel.answers]
    if not shown:
        raise NotApplicable(f"split {group.row['split']!r} has a training set a fold; none stands for all")
    figure, axes = panels(len(shown), len(SHOWN), 1.35, sharey="row")
    unit = group.task.unit
    for line, panel in zip(axes, shown, strict=True):
        for here, (role, word) in zip(line, SHOWN.items(), strict=True):
            answers = panel.answers[role]
            time = end_to_end(answers)
            order = np.lexsort((time, answers.recording))
            breaks = np.flatnonzero(np.diff(answers.recording[order])) + 1  # a line breaks at each new recording
            here.plot(
                time[order], answers.y_true[order], ".", color=GREY, markersize=1.2, markeredgewidth=0, rasterized=True,
            )  # fmt: skip
            here.plot(
                np.insert(time[order], breaks, np.nan),
                np.insert(answers.y_pred[order].astype(np.float64), breaks, np.nan),
                "-", color=group.colours[panel.sensor], linewidth=0.7,
            )  # fmt: skip
            here.set_title(f"{panel.sensor}, {word}")
            value = panel.row["score"]
            if role != "test":
                value = metric_called(group.task.metric).of(answers.y_true, answers.y_pred)
            corner(here, f"{group.metric} {score_with_unit(value, unit)}")
            # A recording without clock counts its rows.
            rows = np.array_equal(answers.time_s, answers.row)
            here.set_xlabel("row of the recording" if rows else "time [s]")
        line[0].set_ylabel(with_unit(group.quantity, unit))
    caption = (
        f"Predicted {group.quantity} (line) and the reference's reading of it (grey dots) against time; left the "
        f"training set, right the test set, in the corner the {group.metric} of the set. Recordings of one set stand "
        "end to end; samples that the protocol discards are missing."
    )
    return group.sketch(
        "prediction-against-time", f"Does the answer follow the {group.quantity} in time?", caption, figure
    )


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
