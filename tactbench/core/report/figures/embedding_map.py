"""A test set as a map: near points look alike to the estimator."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tactbench.core.errors import NotApplicable, TactbenchError
from tactbench.core.report.embedding import ITERATIONS, Embedding, embed
from tactbench.core.report.figures.group import Group, Panel, Remark
from tactbench.core.report.figures.sketch import Sketch, heading, marks, quantity, with_unit
from tactbench.core.report.figures.style import MARKERS, cycled, ordered, panels
from tactbench.core.report.smoothing import WINDOW_S, smoothed_force
from tactbench.core.samples import FloatArray
from tactbench.core.spec.task import LabelTarget

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colorizer import ColorizingArtist

SMALLEST_PT2, LARGEST_PT2 = 1.5, 9.0
"""Areas of the points of least and of most force."""


def draw(group: Group, remark: Remark) -> Sketch:
    """Draw one row a sensor: left by class, right by force.

    Raises
    ------
    NotApplicable
        If no sensor's test set can be embedded.
    """
    found: list[tuple[Panel, Embedding]] = []
    for panel in group.panels:
        try:
            found.append((panel, embed(group.results, panel.row, panel.answers["test"])))
        except TactbenchError as error:
            remark(f"No embedding of {panel.row['cell']}: {error}")
    if not found:
        raise NotApplicable("no test set can be embedded")
    force = {panel.sensor: smoothed_force(panel.answers["test"])[embedding.rows] for panel, embedding in found}
    known = np.concatenate([values[np.isfinite(values)] for values in force.values()])
    figure, axes = panels(len(found), 2, 1.55)
    words = quantity(group.task)
    unit = group.task.target.unit if isinstance(group.task.target, LabelTarget) else "1"
    shade: ColorizingArtist | None = None
    for place, (panel, embedding) in enumerate(found):
        by_class, by_force = axes[place]
        _classes(by_class, panel, embedding)
        if len(known):
            shade = _forces(by_force, embedding, force[panel.sensor], float(known.min()), float(known.max()))
        for here, what in ((by_class, words), (by_force, "force")):
            here.set_title(f"{panel.sensor}, by {what}")
            here.set(xticks=[], yticks=[])
            here.set_aspect("equal", adjustable="datalim")
            for side in here.spines.values():
                side.set_visible(True)
    figure.suptitle(heading(group, "test set, t-SNE"))
    if shade is not None:
        bar = figure.colorbar(shade, ax=axes[:, 1], shrink=0.8, aspect=30, pad=0.02)
        bar.set_label("force [N]")
        bar.outline.set_linewidth(0.4)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=min(len(labels), 6), title=with_unit(words, unit),
        markerscale=1.8, handletextpad=0.1, columnspacing=0.8,
    )  # fmt: skip
    title = f"Test set in two dimensions, by {words} and force"
    return Sketch("embedding", title, _caption(group, found), group, figure)


def _classes(here: Axes, panel: Panel, embedding: Embedding) -> None:
    classes = panel.row["classes"]
    label = panel.answers["test"].y_true[embedding.rows]
    for place, (one, colour) in enumerate(zip(classes, ordered(len(classes)), strict=True)):
        mine = embedding.xy[label == place]
        here.plot(
            mine[:, 0], mine[:, 1], linestyle="none", marker=cycled(MARKERS, place), markersize=2.0, markeredgewidth=0,
            color=colour, label=f"{one:g}" if isinstance(one, int | float) else str(one), rasterized=True,
        )  # fmt: skip


def _forces(here: Axes, embedding: Embedding, force_n: FloatArray, low: float, high: float) -> ColorizingArtist:
    there = np.isfinite(force_n)
    share = (force_n[there] - low) / max(high - low, np.finfo(np.float64).tiny)
    return here.scatter(
        embedding.xy[there, 0], embedding.xy[there, 1], c=force_n[there], cmap="cividis", vmin=low, vmax=high,
        s=SMALLEST_PT2 + (LARGEST_PT2 - SMALLEST_PT2) * share, linewidths=0, rasterized=True,
    )  # fmt: skip


def _caption(group: Group, found: list[tuple[Panel, Embedding]]) -> str:
    points = "; ".join(
        f"{panel.sensor} {len(embedding.rows)} points ({_every(embedding.every)} of {len(panel.answers['test'])} test "
        f"rows), perplexity {embedding.perplexity:g}, divergence left {embedding.divergence:.2f}"
        for panel, embedding in found
    )
    return (
        f"t-SNE of the test set's features as the estimator saw them, one row a sensor; left by "
        f"{quantity(group.task)}, right by reference force (centred mean over {WINDOW_S:g} s; larger and "
        f"lighter points are more force). {points}; {ITERATIONS} iterations from the principal components, seed "
        f"{group.row['seed']}. Near points look alike to the estimator; distances between clusters, their sizes and "
        f"the axes mean little.{marks(group)}"
    )


def _every(step: int) -> str:
    return "all" if step == 1 else f"one in {step}"
