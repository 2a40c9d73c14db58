"""A test set as a map, the t-SNE of the features an estimator saw: near points look alike to it."""

from __future__ import annotations

import importlib
from collections import Counter
from typing import Any

import numpy as np

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.fitting import features_of
from tactbench.core.evaluation.folds import load_task
from tactbench.core.evaluation.sets import prepared
from tactbench.core.evaluation.summaries import with_windows
from tactbench.core.report.figures.group import Group, Sketch, class_name, with_unit
from tactbench.core.report.figures.score_by_force import WINDOW_S, smoothed_force
from tactbench.core.report.figures.style import MARKERS, cycled, legend, ordered, panels
from tactbench.core.report.results import Results
from tactbench.core.samples import Answers, FloatArray, IntArray

AT_MOST = 1000
"""Points of an embedding: more take longer and hide each other in a column's width."""
PERPLEXITY = 30.0
ITERATIONS = 1000


def draw(group: Group) -> Sketch:
    """Draw one row a sensor: left by class, right by force.

    Raises
    ------
    NotApplicable
        If a sensor's test set cannot be embedded.
    """
    found = [(panel, *embed(group.results, panel.row, panel.answers["test"])) for panel in group.panels]
    figure, axes = panels(len(found), 2, 1.55)
    forces = [smoothed_force(panel.answers["test"])[rows] for panel, rows, _ in found]
    known = np.concatenate([own[np.isfinite(own)] for own in forces])
    for (by_class, by_force), (panel, rows, xy), force in zip(axes, found, forces, strict=True):
        classes, label = panel.row["classes"], panel.answers["test"].y_true[rows]
        for place, (one, colour) in enumerate(zip(classes, ordered(len(classes)), strict=True)):
            by_class.plot(
                *xy[label == place].T, linestyle="none", marker=cycled(MARKERS, place), markersize=2.0,
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
        f"t-SNE of the test set's features as the estimator saw them; left by {group.quantity}, right by reference "
        f"force (centred mean over {WINDOW_S:g} s; lighter points are more force). Test rows shown: "
        f"{points}; perplexity {PERPLEXITY:g} or a third of the points, {ITERATIONS} iterations from the principal "
        f"components, seed {group.row['seed']}. Near points look alike to the estimator; distances between clusters, "
        "their sizes and the axes mean little."
    )
    return group.sketch("embedding", f"Which test rows look alike, by {group.quantity} and force?", caption, figure)


def embed(results: Results, row: dict[str, Any], test: Answers) -> tuple[IntArray, FloatArray]:
    """Return (points,) rows of a cell's test set and (points, 2) the t-SNE [1]_ of what its estimator saw of them.

    Raises
    ------
    NotApplicable
        If the test set is in several folds, each with features of its own.
    DataError
        If the recordings are not those the cell was answered from.

    Notes
    -----
    Every n-th row, n the smallest that leaves at most `AT_MOST`. Computed on one thread, since the order of summation
    decides the last bits and t-SNE is chaotic.

    References
    ----------
    .. [1] van der Maaten and Hinton 2008, Visualizing data using t-SNE.
    """
    if np.ptp(test.fold):
        raise NotApplicable(f"split {row['split']!r} has a test set a fold, and no two are scaled alike")
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
    """Return (n, features) of the test set as the estimator saw them: kept, scaled and filtered by the protocol."""
    task = results.registry.tasks[row["task"]].spec
    estimator = results.registry.estimators[row["estimator"]]
    paths = results.recordings(row)
    data = load_task(task, paths, row["protocol"], row["split"], estimator=estimator, seed=row["seed"])
    if data.data.vote:
        raise NotApplicable("a recording is answered by its frames, and has no features of its own")
    k = int(row["chosen"].get("k", with_windows(estimator, task, data.rules).window_grid[0]))
    test_part = prepared(data.assignments[0], data.data, data.rules, k, Counter()).test
    if not (np.array_equal(test_part.recording, test.recording) and np.array_equal(test_part.row, test.row)):
        raise DataError(
            f"The recordings of {row['cell']} give other test rows than were answered.", hint="Run it again."
        )
    return features_of(test_part, estimator)
