"""Figures of classification results as in the paper: confusion matrices, and t-SNE maps of the test set."""

from __future__ import annotations

import importlib
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.fitting import features_of
from tactbench.core.evaluation.folds import load_task
from tactbench.core.evaluation.sets import prepared
from tactbench.core.evaluation.summaries import with_windows
from tactbench.core.report.figures.group import Group, Panel, Sketch, with_unit
from tactbench.core.report.figures.style import COLUMN_IN, MARKERS, PAGE_IN, legend, ordered, panels
from tactbench.core.report.results import Results
from tactbench.core.samples import Answers, FloatArray, IntArray
from tactbench.core.tables.numbers import score

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDE_FROM = 7
"""Smallest number of classes for which a figure is as wide as both columns of a page."""
NUMBERS_UP_TO = 14
"""Largest number of classes for which numbers fit into the squares of a confusion matrix."""
AT_MOST = 1000
"""Largest number of points of a t-SNE map; more take longer and hide each other in a column's width."""
PERPLEXITY = 30.0
ITERATIONS = 1000


def confusion(group: Group) -> Sketch:
    """Draw confusion matrices, one row of panels for each sensor: validation set, if any, and test set."""
    shown = group.panels
    roles = ("validation", "test") if any("validation" in panel.answers for panel in shown) else ("test",)
    wide = max(len(panel.row["classes"]) for panel in shown) >= WIDE_FROM
    width = PAGE_IN if wide else COLUMN_IN
    figure, axes = panels(len(shown), len(roles), 0.85 * width / len(roles), width_in=width)
    for line, panel in zip(axes, shown, strict=True):
        for here, role in zip(line, roles, strict=True):
            table = _confusion(panel, role)
            if table is None:
                here.set_visible(False)
                continue
            _squares(here, table, panel.row["classes"])
            here.set_title(f"{panel.sensor}, {role}")
            here.set_xlabel(with_unit("predicted", group.unit))
        line[0].set_ylabel(with_unit(f"true {group.quantity}", group.unit))
    rows = [np.sum(panel.row["confusion"], axis=1) for panel in shown]
    counts = ", ".join(f"{panel.sensor} {own.min()} to {own.max()}" for panel, own in zip(shown, rows, strict=True))
    scores = ", ".join(f"{panel.sensor} {score(panel.row['score'], group.task.unit)}" for panel in shown)
    caption = (
        f"Rows are the true {group.quantity}, columns the prediction; numbers are per cent of the row. Tested "
        f"{group.task.answer_per}s of a class: {counts}. {group.metric} of the test set: {scores}."
    )
    return group.sketch("confusion", f"Which {group.quantity} is taken for which?", caption, figure)


def _confusion(panel: Panel, role: str) -> IntArray | None:
    """Return the (classes, classes) counts by true and predicted class for a role; None without its answers."""
    table: IntArray = np.asarray(panel.row["confusion"], dtype=np.int64)
    if role == "test":
        return table
    validation = panel.answers.get(role)
    if validation is None:
        return None
    table = np.zeros_like(table)
    np.add.at(table, (validation.y_true.astype(int), validation.y_pred.astype(int)), 1)
    return table


def _squares(here: Axes, table: IntArray, classes: list[Any]) -> None:
    total = table.sum(axis=1, keepdims=True)
    per_cent = np.divide(100 * table, total, out=np.zeros(table.shape), where=total > 0)
    names = list(map(class_name, classes))
    importlib.import_module("sklearn.metrics").ConfusionMatrixDisplay(per_cent, display_labels=names).plot(
        ax=here, cmap="Blues", colorbar=False, values_format=".0f", include_values=len(names) <= NUMBERS_UP_TO,
        im_kw={"vmin": 0.0, "vmax": 100.0}, xticks_rotation=90 if max(map(len, names)) > 4 and len(names) > 3 else 0.0,
    )  # fmt: skip
    here.set_ylabel("")
    here.tick_params(length=0)
    here.spines[:].set_visible(False)


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
    found = [(panel, *_embedded(group.results, panel.row, panel.answers["test"])) for panel in group.panels]
    figure, axes = panels(len(found), 2, 1.55)
    forces = [panel.answers["test"].force_n[rows] for panel, rows, _ in found]
    known = np.concatenate([own[np.isfinite(own)] for own in forces])
    for (by_class, by_force), (panel, rows, xy), force in zip(axes, found, forces, strict=True):
        classes, label = panel.row["classes"], panel.answers["test"].y_true[rows]
        for place, (one, colour) in enumerate(zip(classes, ordered(len(classes)), strict=True)):
            by_class.plot(
                *xy[label == place].T, linestyle="none", marker=MARKERS[place % len(MARKERS)], markersize=2.0,
                markeredgewidth=0, color=colour, label=class_name(one), rasterized=True,
            )  # fmt: skip
        if len(known):
            shade = by_force.scatter(*xy.T, c=force, s=4.0, cmap="cividis", vmin=known.min(), vmax=known.max(),
                                     linewidths=0, rasterized=True)  # fmt: skip
        for here, what in ((by_class, group.quantity), (by_force, "force")):
            here.set_title(f"{panel.sensor}, by {what}")
            here.set(xticks=[], yticks=[])
            here.set_aspect("equal", adjustable="datalim")
            here.spines[:].set_visible(True)
    if len(known):
        figure.colorbar(shade, ax=axes[:, 1], shrink=0.8, aspect=30, pad=0.02, label="force [N]")
    title = with_unit(group.quantity, group.unit)
    legend(figure, axes[:, 0], ncols=6, title=title, markerscale=1.8, handletextpad=0.1, columnspacing=0.8)
    points = ", ".join(f"{panel.sensor} {len(rows)} of {len(panel.answers['test'])}" for panel, rows, _ in found)
    caption = (
        f"t-SNE of the test set's features as the estimator read them; left by {group.quantity}, right by the force "
        f"of the reference (lighter points are more force). Test rows shown: {points}; perplexity "
        f"{PERPLEXITY:g} or a third of the points, {ITERATIONS} iterations from the principal components, seed "
        f"{group.row['seed']}. Near points look alike to the estimator; distances between clusters, their sizes and "
        "the axes mean little."
    )
    return group.sketch("embedding", f"Which test rows look alike, by {group.quantity} and force?", caption, figure)


def _embedded(results: Results, row: dict[str, Any], test: Answers) -> tuple[IntArray, FloatArray]:
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
    if np.ptp(test.fold):
        raise NotApplicable(f"split {row['split']!r} has one test set for each fold, scaled differently")
    rows = np.arange(0, len(test), -(-len(test) // AT_MOST), dtype=np.int64)
    features = _features(results, row, test)[rows]
    model = importlib.import_module("sklearn.manifold").TSNE(
        perplexity=min(PERPLEXITY, (len(rows) - 1) / 3), max_iter=ITERATIONS, init="pca", learning_rate="auto",
        random_state=int(row["seed"]),
        n_jobs=1,
    )  # fmt: skip
    with importlib.import_module("threadpoolctl").threadpool_limits(limits=1):
        return rows, np.asarray(model.fit_transform(features), dtype=np.float64)


def _features(results: Results, row: dict[str, Any], test: Answers) -> FloatArray:
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
