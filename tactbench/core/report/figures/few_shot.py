"""What a calibration of n sessions is worth: score against the number of training sessions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactbench.core.evaluation.protocols import shots
from tactbench.core.leaderboard.names import METRIC_NAMES, answer_name, hardware_name
from tactbench.core.report.figures.saving import write
from tactbench.core.report.figures.sketch import with_unit
from tactbench.core.report.figures.style import (
    COLUMN_IN,
    DASHES,
    GREY,
    MARKERS,
    PAGE_IN,
    colour_name,
    cycled,
    legend,
    panels,
    sensor_colours,
    styled,
)
from tactbench.core.report.results import Results, SavedFigure

Row = Mapping[str, Any]

_NAME = "few-shot"
ACROSS = 3
"""Panels beside each other."""


@dataclass(frozen=True)
class Curve:
    """A score against the number of training sessions."""

    sensor: str
    task: str
    estimator: str
    metric: str
    unit: str
    simulated: bool
    baseline: float | None
    points: tuple[tuple[int, float, float, float], ...]
    """(training sessions, score, low, high), in order of the sessions"""


def few_shot_curves(rows: Iterable[Row]) -> list[Curve]:
    """Return a curve for each sensor, task, estimator and protocol that has answered several few-shot splits."""
    groups: dict[tuple[Any, ...], list[tuple[int, Row]]] = {}
    for row in rows:
        number = shots(str(row["split"]))
        if number and row["status"] == "done":
            key = (row["task"], hardware_name(row), row["repeat"], row["protocol"], row["sensor"], answer_name(row))
            groups.setdefault(key, []).append((number, row))
    curves = []
    for members in groups.values():
        points = sorted((n, row["score"], row["ci_low"], row["ci_high"]) for n, row in members)
        first = members[0][1]
        if len(points) > 1:
            curves.append(
                Curve(
                    sensor=first["sensor"],
                    task=first["task"],
                    estimator=answer_name(first),
                    metric=first["metric"],
                    unit=first["unit"],
                    simulated=first["simulated"],
                    baseline=max(members, key=lambda member: member[0])[1]["baseline"],
                    points=tuple(points),
                )
            )
    return curves


def draw_few_shot(results: Results, folder: Path) -> list[SavedFigure]:
    """Draw one panel a task, a line for each sensor and estimator; nothing where fewer than two numbers were tried.

    Raises
    ------
    OSError
        If `folder` cannot be written.
    """
    answers = [row for row in results.rows if not row["is_baseline"]]
    curves = few_shot_curves(answers)
    if not curves:
        return []
    tasks: dict[str, list[Curve]] = {}
    for curve in curves:
        tasks.setdefault(curve.task, []).append(curve)
    across = min(len(tasks), ACROSS)
    down = -(-len(tasks) // ACROSS)
    with styled():
        figure, axes = panels(down, across, 1.9, width_in=PAGE_IN if across > 1 else COLUMN_IN)
        for here in axes.flat[len(tasks) :]:
            here.set_visible(False)
        lines = list(dict.fromkeys(_name(curve) for curve in curves))
        colours = sensor_colours(results.rows)
        for here, (task, own) in zip(axes.flat, tasks.items(), strict=False):
            _panel(here, own, lines, colours)
            here.set_title(task)
        legend(figure, axes.flat)
        png, pdf = write(figure, _NAME, folder)
    keys = tuple(row["key"] for row in answers if shots(str(row["split"])) and row["key"])
    return [SavedFigure(_NAME, "What few sessions are worth", _caption(curves, colours), png, pdf, keys)]


def _panel(here: Any, own: Sequence[Curve], lines: Sequence[str], colours: Mapping[str, str]) -> None:
    for order, curve in enumerate(own):
        place = lines.index(_name(curve))
        points = np.array(curve.points, dtype=np.float64)  # an end that is not known is NaN, and has no bar
        spread = np.abs(points[:, 2:] - points[:, 1:2]).T
        at = np.log2(points[:, 0]) + 0.06 * (order - (len(own) - 1) / 2)
        here.errorbar(
            at, points[:, 1], yerr=spread, color=colours[curve.sensor], marker=cycled(MARKERS, place), markersize=4,
            linestyle=cycled(DASHES, place), capsize=2, label=_name(curve),
        )  # fmt: skip
    trivial = [curve.baseline for curve in own if curve.baseline is not None]
    if trivial:
        here.axhline(float(np.mean(trivial)), color=GREY, linestyle=":", label="trivial")
    counts = sorted({int(point[0]) for curve in own for point in curve.points})
    here.set_xticks(np.log2(counts), [str(count) for count in counts])
    here.set_xlabel("training sessions")
    here.set_ylabel(with_unit(METRIC_NAMES.get(own[0].metric, own[0].metric), own[0].unit))


def _name(curve: Curve) -> str:
    """Return sensor and estimator; the page's tables have the parameters."""
    return f"{curve.sensor}, {curve.estimator.partition(' (')[0]}"


def _caption(curves: Sequence[Curve], colours: Mapping[str, str]) -> str:
    sensors = ", ".join(f"{name} {colour_name(colours[name])}" for name in dict.fromkeys(one.sensor for one in curves))
    simulated = " SIM: simulated, no hardware was touched." if any(curve.simulated for curve in curves) else ""
    return (
        "Score on the same test sessions after training on the first n sessions, each a recording of every surface; a "
        f"panel a task; sensors by colour: {sensors}. Training sets are nested. Bars: the 95 % intervals of the "
        f"tables, where there are any. Dotted: the trivial baseline, mean over the lines.{simulated}"
    )
