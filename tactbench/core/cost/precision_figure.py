"""The work-precision diagram as a figure: time across, error upwards, both by decades."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from tactbench.core.cost.precision import diagrams, precise
from tactbench.core.plugins.cost import CostPoint

# Okabe and Ito's colours, told apart by people with any colour vision; shapes say the same again.
_MARKS = (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^"), ("#CC79A7", "D"), ("#E69F00", "v"), ("#56B4E9", "P"))


def draw(points: Sequence[CostPoint], title: str, paths: Sequence[Path]) -> None:
    """Draw one panel for each subject and observable, and save it under every one of `paths`.

    Points that share the setting ``family`` share a mark; the front is a line, the default a ring, and the dashed
    line a third of the observable's noise.
    """
    from matplotlib.figure import Figure

    panels = diagrams(points)
    families = list(dict.fromkeys(str(point.settings.get("family", "")) for point in points))
    marks = {family: _MARKS[place % len(_MARKS)] for place, family in enumerate(families)}
    across = min(2, len(panels))
    down = math.ceil(len(panels) / across)
    figure = Figure(figsize=(6.4 * across, 4.6 * down), layout="constrained")
    axes = figure.subplots(down, across, squeeze=False)
    for axis in axes.flat[len(panels) :]:
        axis.set_visible(False)
    for axis, ((subject, observable), group) in zip(axes.flat, panels.items(), strict=False):
        for family in families:
            own = [point for point in group if str(point.settings.get("family", "")) == family]
            if not own:
                continue
            colour, shape = marks[family]
            axis.loglog([p.seconds for p in own], [max(p.error, 1e-12) for p in own], shape, color=colour, ms=6,
                        label=family, ls="none")  # fmt: skip
        best = precise(group)
        axis.plot([p.seconds for p in best], [max(p.error, 1e-12) for p in best], color="#555555", lw=1, zorder=0)
        for point in group:
            if point.default:
                axis.plot(point.seconds, point.error, "o", ms=15, mfc="none", mec="black", mew=1.6)
                axis.annotate("default", (point.seconds, point.error), xytext=(11, 9), textcoords="offset points")
        if math.isfinite(group[0].floor):
            axis.axhline(group[0].floor / 3, color="black", ls="--", lw=0.9)
            axis.annotate("a third of the noise", (0.99, group[0].floor / 3), xycoords=("axes fraction", "data"),
                          ha="right", va="bottom", fontsize=8)  # fmt: skip
        axis.set_title(f"{subject}, {observable}")
        axis.set_xlabel("seconds per recording")
        axis.set_ylabel(f"error, rms [{group[0].unit}]")
        axis.grid(True, which="major", alpha=0.3)
        axis.legend(fontsize=8, frameon=False)
    figure.suptitle(title)
    for path in paths:
        figure.savefig(path, dpi=150)
