"""How late a slip is noticed, against how often a detector cries without one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.event_answers import BOUNDS_PER_MINUTE
from tactbench.core.leaderboard.names import answer_name
from tactbench.core.report.figures.group import Group, Sketch
from tactbench.core.report.figures.style import LINES, MARKERS, PAGE_IN, cycled, legend, panels

LEAST_RECALL = 0.25
"""A latency over fewer hits than such a share of the slips is not shown."""
SMALLEST_PT, LARGEST_PT = 2.0, 8.0
"""Sizes of marks at recall 0 and 1."""


def draw(group: Group) -> Sketch:
    """Draw one panel a sensor and a line a detector, through its operating points.

    Raises
    ------
    NotApplicable
        If no detector of the group has an operating point with enough hits.
    """
    same = ("task", "protocol", "split", "rig")
    rows = [
        row
        for row in group.results.rows
        if row["status"] == "done" and row.get("operating_points") and all(row[key] == group.row[key] for key in same)
    ]
    points = [_points(row) for row in rows]
    if not any(map(len, points)):
        raise NotApplicable(f"no detector finds {LEAST_RECALL:.0%} of the slips at any bound of false alarms")
    names = sorted({answer_name(row) for row in rows})
    figure, (axes,) = panels(1, len(group.panels), 2.2, width_in=PAGE_IN, sharey=True)
    for here, panel in zip(axes, group.panels, strict=True):
        for row, found in zip(rows, points, strict=True):
            if row["sensor"] != panel.sensor or not len(found):
                continue
            place = names.index(answer_name(row))
            colour, marker = cycled(LINES, place), cycled(MARKERS, place)
            here.plot(found[:, 0], found[:, 1], color=colour, linewidth=0.6)
            sizes = (SMALLEST_PT + (LARGEST_PT - SMALLEST_PT) * found[:, 2]) ** 2
            here.scatter(found[:, 0], found[:, 1], s=sizes, color=colour, marker=marker, label=answer_name(row))
        here.set_xscale("symlog", linthresh=1.0)
        here.set_xticks(BOUNDS_PER_MINUTE, [f"{bound:g}" for bound in BOUNDS_PER_MINUTE])
        here.set_xlim(left=-0.1)
        here.set_xlabel("false alarms a minute of disturbances")
        here.set_title(panel.sensor)
    axes[0].set_ylabel("median onset latency [ms]")
    legend(figure, axes)
    caption = (
        "Median onset latency on test recordings against false alarms a minute of their disturbances, at thresholds "
        "that validation recordings chose for several bounds of false alarms. A mark is as large as its recall, and is "
        f"left out below {LEAST_RECALL:g}: latencies are over hits alone."
    )
    return group.sketch("latency-and-false-alarms", "How many false alarms buy an earlier one?", caption, figure)


def _points(row: Mapping[str, Any]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return (k, 3) false alarms a minute, median latency [ms] and recall, each operating point once."""
    found = {
        (point["false alarms per minute"], point["onset latency p50 ms"], point["recall"])
        for point in row["operating_points"]
        if "false alarms per minute" in point and point.get("recall", 0.0) >= LEAST_RECALL
    }
    return np.array(sorted(found), dtype=np.float64).reshape(-1, 3)
