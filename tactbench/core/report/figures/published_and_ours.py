"""The first picture of a report: published scores beside ours, a panel a task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.leaderboard.names import LOWER_IS_BETTER, METRIC_NAMES, answer_name
from tactbench.core.report.figures.saving import write
from tactbench.core.report.figures.sketch import with_unit
from tactbench.core.report.figures.style import (
    BLACK,
    COLUMN_IN,
    GREY,
    PAGE_IN,
    colour_name,
    panels,
    sensor_colours,
    styled,
)
from tactbench.core.report.published import Reproduction, reproduce
from tactbench.core.report.results import Results, SavedFigure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAME = "published-and-ours"
COLUMN = f"{NAME}-column"
"""The same with its panels below each other, for a column of a paper and a narrow screen."""
ACROSS = 2
"""Panels beside each other."""
_LINE_IN = 0.24
"""Height of a row of the picture."""


def draw_published(results: Results, folder: Path) -> list[SavedFigure]:
    """Draw each published score beside our row, and what its replicates scored; nothing where no row stands beside one.

    Raises
    ------
    OSError
        If `folder` cannot be written.
    """
    tasks: dict[str, list[Reproduction]] = {}
    for line in reproduce(results.registry, results.rows):
        if line.row is not None and line.row["status"] == "done":
            tasks.setdefault(line.task, []).append(line)
    if not tasks:
        return []
    every = [line for lines in tasks.values() for line in lines]
    colours = sensor_colours(results.rows)
    keys = tuple(dict.fromkeys(str(line.row["key"]) for line in every if line.row and line.row["key"]))
    drawn = []
    with styled():
        for name, across in ((NAME, min(len(tasks), ACROSS)), (COLUMN, 1)):
            figure = _figure(list(tasks.values()), across, colours)
            png, pdf = write(figure, name, folder)
            drawn.append(SavedFigure(name, "Published scores and ours", _caption(every, colours), png, pdf, keys))
    return drawn


def _figure(tasks: Sequence[Sequence[Reproduction]], across: int, colours: Mapping[str, str]) -> Figure:
    down = -(-len(tasks) // across)
    heights = [0.75 + _LINE_IN * max(map(len, tasks[one * across : (one + 1) * across])) for one in range(down)]
    figure, axes = panels(
        down, across, sum(heights) / down, width_in=PAGE_IN if across > 1 else COLUMN_IN, height_ratios=heights
    )  # fmt: skip
    for here in axes.flat[len(tasks) :]:
        here.set_visible(False)
    for here, lines in zip(axes.flat, tasks, strict=False):
        _panel(here, lines, colours)
    rows = [line.row for lines in tasks for line in lines if line.row]
    simulated = all(row["simulated"] for row in rows)
    figure.suptitle("Published scores and ours" + (" (SIM: ours are simulated)" if simulated else ""))
    handles = _legend(rows)
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), across + 1))
    return figure


def _panel(here: Axes, lines: Sequence[Reproduction], colours: Mapping[str, str]) -> None:
    """Draw one task: a row a published number and a sensor, the first on top."""
    for place, line in enumerate(lines):
        row: Any = line.row
        colour = colours[row["sensor"]]
        scores = row.get("replicate_scores") or []
        if len(scores) > 1:
            here.plot(
                scores, [place] * len(scores), linestyle="none", marker="|", markersize=7, markeredgewidth=0.7,
                color=colour, alpha=0.6,
            )  # fmt: skip
        if row["ci_low"] is not None and row["ci_high"] is not None:
            spread = [[row["score"] - row["ci_low"]], [row["ci_high"] - row["score"]]]
            here.errorbar(row["score"], place, xerr=spread, color=colour, capsize=3, linewidth=1.6)
        here.plot(row["score"], place, "o", color=colour, markersize=5)
        here.plot(
            line.published, place, "D", color=BLACK, markersize=5, markerfacecolor="white", markeredgewidth=1.1,
            zorder=5,
        )  # fmt: skip
    row = lines[0].row or {}
    here.set_yticks(range(len(lines)), [_name(line) for line in lines])
    for label, line in zip(here.get_yticklabels(), lines, strict=True):
        label.set_color(colours[line.sensor])
    here.tick_params(axis="y", length=0)
    here.set_ylim(len(lines) - 0.4, -0.6)
    here.margins(x=0.08)
    here.grid(axis="x", linewidth=0.4, color=GREY, alpha=0.3)
    better = "lower" if row["metric"] in LOWER_IS_BETTER else "higher"
    metric = METRIC_NAMES.get(row["metric"], row["metric"])
    here.set_xlabel(f"{with_unit(metric, row['unit'])}, {better} is better")
    here.set_title(f"{row['task']} · {row['protocol']}{' †' if row['dagger'] else ''}")


def _name(line: Reproduction) -> str:
    return f"{line.sensor}, {answer_name(line.row)}" if line.row else line.sensor


def _legend(rows: Sequence[Mapping[str, Any]]) -> list[Any]:
    from matplotlib.lines import Line2D

    marks = [("ours: median, 95 % interval" if _carried(rows) else "ours", "o", GREY, GREY, 5.0)]
    if any(len(row.get("replicate_scores") or []) > 1 for row in rows):
        marks.append(("each replicate", "|", GREY, GREY, 7.0))
    marks.append(("published", "D", BLACK, "white", 5.0))
    return [
        Line2D([], [], linestyle="none", marker=shape, color=edge, markerfacecolor=face, markersize=size, label=label)
        for label, shape, edge, face, size in marks
    ]


def _carried(rows: Sequence[Mapping[str, Any]]) -> bool:
    return any(row["ci_low"] is not None for row in rows)


def _caption(lines: Sequence[Reproduction], colours: Mapping[str, str]) -> str:
    rows = [line.row for line in lines if line.row]
    sensors = ", ".join(f"{name} {colour_name(colours[name])}" for name in dict.fromkeys(row["sensor"] for row in rows))
    counts = sorted({(int(row.get("n_replicates") or 1), str(row.get("replicate_unit") or "")) for row in rows})
    named = " or ".join(f"{n} {unit or 'replicate'}s" if n > 1 else f"one {unit or 'replicate'}" for n, unit in counts)
    ours = (
        f"filled circles are our scores, the median over {named}, with their 95 % intervals"
        if _carried(rows)
        else f"filled circles are our scores, of {named}: too few for an interval"
    )
    parts = [f"Open black diamonds are the published scores; {ours}. Sensors by colour: {sensors}."]
    if any(len(row.get("replicate_scores") or []) > 1 for row in rows):
        parts.append("Small strokes are the replicates.")
    if any(row["simulated"] for row in rows):
        parts.append("SIM: simulated, no hardware was touched.")
    if any(row["dagger"] for row in rows):
        parts.append("†: each set, the test set too, is scaled by its own mean and deviation.")
    references = "; ".join(dict.fromkeys(line.reference for line in lines))
    parts.append(f"Published: {references}.")
    return " ".join(parts)
