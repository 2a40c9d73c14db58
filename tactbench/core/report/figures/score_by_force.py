"""How well a class is told at low, middle and high force."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.interval import ReplicateUnits, score_interval
from tactbench.core.evaluation.metrics import Metric, metric_called
from tactbench.core.report.figures.group import Group, Panel, Remark
from tactbench.core.report.figures.sketch import Sketch, coloured, heading, marks, metric_name
from tactbench.core.report.figures.style import DASHES, GREY, MARKERS, cycled, panels
from tactbench.core.report.smoothing import WINDOW_S, smoothed_force
from tactbench.core.samples import Answers, FloatArray
from tactbench.core.tables.numbers import interval, score, whole

EDGES_N = (1.5, 3.0)
"""A band is from one edge up to the next; the outer ones are open."""
BANDS = ("below 1.5", "1.5 to 3", "3 and above")


@dataclass(frozen=True)
class Band:
    """The score of the rows in one band of force."""

    score: float
    low: float
    high: float
    rows: int


def draw(group: Group, remark: Remark) -> Sketch:
    """Draw the score in each band, one line a sensor, with the trivial baseline below.

    Raises
    ------
    NotApplicable
        If no sensor's test set has a reference force.
    """
    shown = [panel for panel in group.panels if np.isfinite(panel.answers["test"].force_n).any()]
    if not shown:
        raise NotApplicable("no test row has a reference force")
    figure, axes = panels(1, 1, 1.9)
    here = axes[0, 0]
    counted, listed = [], []
    for place, panel in enumerate(shown):
        found = banded(group, panel)
        at = np.flatnonzero([band.rows > 0 for band in found])
        bands = [found[one] for one in at]
        shift = 0.06 * (place - (len(shown) - 1) / 2)
        values = np.array([band.score for band in bands])
        spread = np.abs([[band.low, band.high] for band in bands] - values[:, None]).T
        here.errorbar(
            at + shift, values, yerr=spread, color=group.colours[panel.sensor], marker=cycled(MARKERS, place),
            markersize=4, linestyle=cycled(DASHES, place), capsize=2, label=panel.sensor,
        )  # fmt: skip
        counted.append(f"{panel.sensor} {', '.join(whole(band.rows) for band in found)}")
        listed.append(f"{panel.sensor} {', '.join(_band_text(band, group.task.unit) for band in found)}")
    _baseline(here, group, shown)
    here.set_xticks(range(len(BANDS)), BANDS)
    here.set_xlim(-0.3, len(BANDS) - 0.7)
    here.set_xlabel("reference force [N], centred mean over 1 s")
    here.set_ylabel(metric_name(group.task))
    here.set_ylim(bottom=min(0.0, here.get_ylim()[0]))
    figure.suptitle(heading(group))
    figure.legend(loc="outside lower center", ncols=3)
    return Sketch(
        "score-by-force", f"{metric_name(group.task)} by force", _caption(group, shown, counted, listed), group, figure
    )


def banded(group: Group, panel: Panel) -> list[Band]:
    """Return the score in every band, with its interval."""
    test, metric, n_classes = panel.answers["test"], metric_called(group.task.metric), len(panel.row["classes"])
    within = membership(smoothed_force(test))
    return [_band(metric, test, inside, n_classes, int(panel.row["seed"])) for inside in within]


def membership(force_n: FloatArray) -> list[npt.NDArray[np.bool_]]:
    """Return a mask for each band; a row without force is in none."""
    edges = (-np.inf, *EDGES_N, np.inf)
    return [(force_n >= low) & (force_n < high) for low, high in itertools.pairwise(edges)]


def _band(metric: Metric, test: Answers, inside: npt.NDArray[np.bool_], n_classes: int, seed: int) -> Band:
    """Return the score of one band.

    Time is resampled in blocks of the whole recording and only the rows in the band are counted: the rows of a band
    are no stretch of time, and a block of them would join moments that lie apart.
    """
    if not inside.any():
        return Band(0.0, 0.0, 0.0, 0)
    alone = replace(metric, rows=lambda y, predicted, n: metric.rows(y, predicted, n) * inside[:, None])
    one = ReplicateUnits("session", np.zeros(len(test), dtype=np.int64), ())  # sessions are not resampled
    found = score_interval(alone, test.y_true, test.y_pred, test.recording, one, n_classes, seed)
    value = metric.of(test.y_true[inside], test.y_pred[inside], n_classes)
    return Band(value, found.low, found.high, int(inside.sum()))


def _baseline(here: Any, group: Group, shown: list[Panel]) -> None:
    """Draw what the trivial baseline scores in the same bands."""
    label = True
    for panel in shown:
        trivial = group.baselines.get(panel.sensor)
        if trivial is None:
            continue
        test, metric = trivial.answers["test"], metric_called(group.task.metric)
        masks = membership(smoothed_force(test))
        values = [
            metric.of(test.y_true[inside], test.y_pred[inside], len(trivial.row["classes"])) if inside.any() else np.nan
            for inside in masks
        ]
        name = f"{trivial.row['estimator']} (no sensor)" if label else None
        here.plot(range(len(values)), values, color=GREY, linestyle=":", linewidth=1.0, label=name, zorder=0)
        label = False


def _band_text(band: Band, unit: str) -> str:
    return f"{score(band.score, unit)} ({interval(band.low, band.high, unit)})" if band.rows else "–"


def _caption(group: Group, shown: list[Panel], counted: list[str], listed: list[str]) -> str:
    trivial = next((panel.row["estimator"] for panel in group.baselines.values()), None)
    line = f" Dotted: {trivial}, the trivial baseline, in the same bands, a line a sensor." if trivial else ""
    return (
        f"{metric_name(group.task)} of the test set by force, one line a sensor ({coloured(group, shown)}): "
        f"{'; '.join(listed)}. Bands are below 1.5 N, from 1.5 N to below 3 N, and 3 N and above, by the "
        f"reference force smoothed within a recording by a centred mean over {WINDOW_S:g} s, since a single reading of "
        f"the reference is noisy; test rows in them: {'; '.join(counted)}. A class that is missing in a band counts as "
        f"0. Bars: 95 % intervals, bootstrap over blocks of time within recordings; spread between sessions is not in "
        f"them.{line}{marks(group)}"
    )
