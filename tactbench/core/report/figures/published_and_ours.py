"""First figure of a report: published scores beside ours, one panel for each task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from tactbench.core.leaderboard.names import answer_name, direction, grouped, metric_name
from tactbench.core.report.figures.group import MARKS, Sketch
from tactbench.core.report.figures.style import BLACK, GREY, legend, panels, sensor_colours
from tactbench.core.report.published import Reproduction, reproduce
from tactbench.core.report.results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME = "published-and-ours"
_LINE_IN = 0.24
"""Height of a row of the figure [inch]."""


def draw_published(results: Results) -> Sketch | None:
    """Draw published scores beside ours and those of our replicates; return None if no scores are comparable."""
    lines = [line for line in reproduce(results.registry, results.rows) if line.row["status"] == "done"]
    if not lines:
        return None
    tasks = grouped(lines, lambda line: line.task.name)
    colours = sensor_colours(results.rows)
    heights = [0.75 + _LINE_IN * len(own) for own in tasks.values()]
    figure, axes = panels(len(tasks), 1, sum(heights) / len(tasks), height_ratios=heights)
    for here, own in zip(axes[:, 0], tasks.values(), strict=True):
        _panel(here, own, colours)
    simulated = all(line.row["simulated"] for line in lines)
    figure.suptitle("Published scores and ours" + (" (SIM: ours are simulated)" if simulated else ""))
    legend(figure, axes[:, 0])
    parts = [
        "Open black diamonds are the published scores; filled circles are our scores, small strokes those of each "
        "replicate, with intervals where there are five or more.",
        *(text for key, text in MARKS.items() if any(line.row[key] for line in lines)),
        f"Published: {'; '.join(dict.fromkeys(line.published.reference for line in lines))}.",
    ]
    return Sketch(NAME, "Are the published scores reproduced?", " ".join(parts), figure)


def _panel(here: Axes, lines: Sequence[Reproduction], colours: Mapping[str, str]) -> None:
    """Draw the panel of a task: one row for each published score and sensor, the first on top."""
    for place, line in enumerate(lines):
        row, colour = line.row, colours[line.row["sensor"]]
        scores = row.get("replicate_scores") or []
        if len(scores) > 1:
            here.plot(
                scores, [place] * len(scores), "|", markersize=7, markeredgewidth=0.7, color=colour, alpha=0.6,
                label="each replicate",
            )  # fmt: skip
        if row["ci_low"] is not None and row["ci_high"] is not None:
            spread = [[row["score"] - row["ci_low"]], [row["ci_high"] - row["score"]]]
            here.errorbar(row["score"], place, xerr=spread, color=colour, capsize=3, linewidth=1.6)
        here.plot(row["score"], place, "o", color=colour, markersize=5, label="ours")
        here.plot(
            line.published.score, place, "D", color=BLACK, markersize=5, markerfacecolor="white", zorder=5,
            label="published",
        )  # fmt: skip
    here.set_yticks(range(len(lines)), [f"{line.row['sensor']}, {answer_name(line.row)}" for line in lines])
    here.set_ylim(len(lines) - 0.4, -0.6)
    here.grid(axis="x", linewidth=0.4, color=GREY, alpha=0.3)
    row = lines[0].row
    here.set_xlabel(f"{metric_name(row)}, {direction(row)}")
    here.set_title(f"{row['task']} · {row['protocol']}{' †' if row['dagger'] else ''}")
