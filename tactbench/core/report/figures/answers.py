"""Figures of answers as in the paper: against time and target; confusion matrices and t-SNE maps of the test set."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.fitting import features_of
from tactbench.core.evaluation.folds import load_task
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.evaluation.sets import prepared
from tactbench.core.evaluation.summaries import with_windows
from tactbench.core.leaderboard.names import METRIC_NAMES, Row
from tactbench.core.report.figures.group import MARKERS, Group, Panel, Sketch, legend, panels, with_unit
from tactbench.core.report.results import Results
from tactbench.core.samples import Answers, FloatArray, IntArray
from tactbench.core.spec.task import VectorTarget
from tactbench.core.tables.text import score_with_unit


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


WIDE_FROM = 7
"""Smallest number of classes for which a figure is as wide as both columns of a page."""
NUMBERS_UP_TO = 12
"""Largest number of classes for which numbers fit into the squares of a confusion matrix."""
AT_MOST = 1000
"""Largest number of points of a t-SNE map; more take longer and hide each other in a column's width."""
PERPLEXITY = 30.0
ITERATIONS = 1000


def confusion(group: Group) -> Sketch:
    """Draw confusion matrices, one row of panels for each sensor: validation set, if any, and test set."""
    from sklearn.metrics import ConfusionMatrixDisplay

    shown = group.panels
    roles = [role for role in ("validation", "test") if role in shown[0].answers]
    wide = max(len(panel.row["classes"]) for panel in shown) >= WIDE_FROM
    figure, axes = panels(len(shown), len(roles), wide=wide)
    for line, panel in zip(axes, shown, strict=True):
        names = list(map(class_name, panel.row["classes"]))
        for here, role in zip(line, roles, strict=True):
            answers = panel.answers[role]
            ConfusionMatrixDisplay.from_predictions(
                answers.y_true, answers.y_pred, labels=range(len(names)), display_labels=names, normalize="true",
                values_format=".0%", include_values=len(names) <= NUMBERS_UP_TO, im_kw={"vmin": 0, "vmax": 1},
                text_kw={"size": "small"}, cmap="Blues", colorbar=False, ax=here,
                xticks_rotation=90 if max(map(len, names)) > 4 and len(names) > 3 else 0.0,
            )  # fmt: skip
            here.set(title=f"{panel.sensor}, {role}", xlabel=with_unit("predicted", group.unit), ylabel="")
            here.tick_params(length=0)
            here.spines[:].set_visible(False)
        line[0].set_ylabel(with_unit(f"true {group.quantity}", group.unit))
    caption = f"Rows are the true {group.quantity}, columns the prediction; numbers are shares of the row."
    return group.sketch("confusion", f"Which {group.quantity} is taken for which?", caption, figure)


def class_name(one: Any) -> str:
    """Return a class as text for a label, numbers without trailing zeros."""
    return f"{one:g}" if isinstance(one, int | float) else str(one)


def embedding(group: Group) -> Sketch:
    """Draw t-SNE maps of an estimator's features, one row of panels for each sensor: left by class, right by force.

    Raises
    ------
    NotApplicable
        If a sensor's test set cannot be embedded.
    """
    found = [(panel, *_embedded(group.results, panel)) for panel in group.panels]
    figure, axes = panels(len(found), 2)
    for (by_class, by_force), (panel, rows, xy) in zip(axes, found, strict=True):
        test, classes = panel.answers["test"], panel.row["classes"]
        for place, one in enumerate(classes):
            by_class.plot(*xy[test.y_true[rows] == place].T, MARKERS[place % len(MARKERS)], label=class_name(one),
                          rasterized=True)  # fmt: skip
        force_n = test.force_n[rows]
        if np.isfinite(force_n).any():
            shade = by_force.scatter(*xy.T, c=force_n, cmap="cividis", rasterized=True)
            figure.colorbar(shade, ax=by_force, label="force [N]")
        for here, what in ((by_class, group.quantity), (by_force, "force")):
            here.set(title=f"{panel.sensor}, by {what}", xticks=[], yticks=[])
            here.spines[:].set_visible(True)
    legend(figure, axes[:, 0], title=with_unit(group.quantity, group.unit))
    caption = (
        f"t-SNE of the test set's features as the estimator read them, of at most {AT_MOST} rows; left by "
        f"{group.quantity}, right by the force of the reference. Near points look alike to the estimator; distances "
        "between clusters, their sizes and the axes mean little."
    )
    return group.sketch("embedding", f"Which test rows look alike, by {group.quantity} and force?", caption, figure)


def _embedded(results: Results, panel: Panel) -> tuple[IntArray, FloatArray]:
    """Return (points,) indices of test rows of a cell, and (points, 2) the t-SNE [1]_ of their features.

    Raises
    ------
    NotApplicable
        If the test set consists of folds with different scaling.
    DataError
        If the recordings differ from those that the cell was evaluated on.

    Notes
    -----
    Every n-th row is used, n the smallest that leaves at most `AT_MOST`. One thread is used: t-SNE is chaotic and the
    order of summation changes the last bits.

    References
    ----------
    .. [1] van der Maaten and Hinton 2008, Visualizing data using t-SNE.
    """
    from sklearn.manifold import TSNE
    from threadpoolctl import threadpool_limits

    row, test = panel.row, panel.answers["test"]
    if np.ptp(test.fold):
        raise NotApplicable(f"split {row['split']!r} has one test set for each fold, scaled differently")
    rows = np.arange(0, len(test), -(-len(test) // AT_MOST), dtype=np.int64)
    features = _features(results, row, test)[rows]
    model = TSNE(perplexity=min(PERPLEXITY, (len(rows) - 1) / 3), max_iter=ITERATIONS, init="pca",
                 learning_rate="auto", random_state=int(row["seed"]), n_jobs=1)  # fmt: skip
    with threadpool_limits(limits=1):
        return rows, np.asarray(model.fit_transform(features), dtype=np.float64)


def _features(results: Results, row: Row, test: Answers) -> FloatArray:
    """Return the (n, features) test set as given to the estimator: selected, scaled and filtered by the protocol."""
    task = results.registry.tasks[row["task"]].spec
    estimator = results.registry.estimators[row["estimator"]]
    paths = results.recordings(row)
    data = load_task(task, paths, row["protocol"], row["split"], estimator=estimator, seed=row["seed"])
    k = int(row["chosen"].get("k", with_windows(estimator, task, data.rules).window_grid[0]))
    test_part = prepared(data.assignments[0], data.data, data.rules, k, Counter()).test
    if not (np.array_equal(test_part.recording, test.recording) and np.array_equal(test_part.row, test.row)):
        raise DataError(
            f"The recordings of {row['cell']} have changed since it was evaluated.", hint="Run the cell again."
        )
    return features_of(test_part, estimator)
