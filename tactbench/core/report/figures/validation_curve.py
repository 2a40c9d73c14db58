"""How the score on validation data depends on what was searched: one line for each length of the mean filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.report.figures.group import Group, Panel, Remark
from tactbench.core.report.figures.sketch import Sketch, heading, marks, metric_name, sensors, with_unit
from tactbench.core.report.figures.style import DASHES, MARKERS, VERMILLION, cycled, ordered, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Curve = tuple[list[float], list[float]]
"""Values of a parameter, and the score at each."""
ACROSS = 3
"""Sensors that fit beside each other."""
LOG_FROM = 20.0
"""A parameter whose largest value is this many times its smallest stands on a logarithmic axis."""


def draw(group: Group, remark: Remark) -> Sketch:
    """Draw the validation scores: one panel a sensor and parameter, the chosen candidate ringed.

    Raises
    ------
    NotApplicable
        If no sensor's cell has compared anything.
    """
    shown = [panel for panel in group.panels if panel.row["search"]]
    if not shown:
        raise NotApplicable("nothing was chosen on validation data")
    names = list(dict.fromkeys(name for panel in shown for name in searched(panel.row["search"])))
    if not names:
        raise NotApplicable("no number was searched")
    higher = metric_called(group.task.metric).higher_is_better
    # Sensors side by side, a row a parameter; where a column has no room for that, the other way round.
    stacked = len(shown) > ACROSS
    if stacked:
        figure, axes = panels(len(shown), len(names), 1.2, sharex="col", sharey=True)
    else:
        figure, axes = panels(len(names), len(shown), 1.45, sharex="row", sharey=True)
    lengths = sorted({int(one["k"]) for panel in shown for one in panel.row["search"]})
    colours = dict(zip(lengths, ordered(len(lengths)), strict=True))
    for down, name in enumerate(names):
        for across, panel in enumerate(shown):
            here = axes[across, down] if stacked else axes[down, across]
            _curves(here, panel, name, lengths, colours, higher)
            if stacked or down == 0:
                here.set_title(panel.sensor)
            if not stacked or across == len(shown) - 1:
                here.set_xlabel(_called(name))
    for here in axes[:, 0]:
        here.set_ylabel(with_unit(metric_name(group.task), group.task.unit))
    figure.suptitle(heading(group, "validation"))
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(handles), 4), columnspacing=1.0)
    caption = _caption(group, shown, names)
    return Sketch("validation-curve", "What the validation data chose", caption, group, figure)


def searched(search: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the parameters that took several numbers; k, where it is all that did."""
    found = []
    for name in search[0]:
        values = {one.get(name) for one in search}
        if name not in ("k", "score", "fold") and len(values) > 1 and all(_number(value) for value in values):
            found.append(name)
    return found or (["k"] if len({one["k"] for one in search}) > 1 else [])


def curve(search: Sequence[Mapping[str, Any]], name: str, k: int | None, higher: bool) -> Curve:
    """Return the score at each value of `name`: mean over folds, the best over whatever else was searched.

    Parameters
    ----------
    k
        Only candidates with this length of filter; None: all.
    """
    folds: dict[tuple[Any, ...], list[float]] = {}
    for one in search:
        if k is None or one["k"] == k:
            rest = tuple(sorted((key, str(value)) for key, value in one.items() if key not in ("score", "fold", name)))
            folds.setdefault((float(one[name]), rest), []).append(float(one["score"]))
    best: dict[float, float] = {}
    choose = max if higher else min
    for (value, _), scores in folds.items():
        mean = float(np.mean(scores))
        best[value] = choose(best.get(value, mean), mean)
    values = sorted(best)
    return values, [best[value] for value in values]


def _curves(
    here: Axes, panel: Panel, name: str, lengths: Sequence[int], colours: Mapping[int, Any], higher: bool
) -> None:
    search, chosen = panel.row["search"], panel.row["chosen"]
    if name == "k":
        here.plot(*curve(search, name, None, higher), "o-", color="black", markersize=2.5, label="best at this k")
    else:
        for place, k in enumerate(lengths):
            values, scores = curve(search, name, k, higher)
            if values:
                here.plot(
                    values, scores, linestyle=cycled(DASHES, place), marker=cycled(MARKERS, place), color=colours[k],
                    markersize=1.0 + 1.0 * (len(lengths) - place), markerfacecolor="none", label=f"k = {k}",
                )  # fmt: skip
    values = sorted({float(one[name]) for one in search})
    if values[0] > 0 and values[-1] / values[0] >= LOG_FROM:
        here.set_xscale("log")
        here.xaxis.set_major_formatter("{x:g}")
    here.margins(x=0.06, y=0.1)
    rings = set()
    for fold in dict.fromkeys(str(one["fold"]) for one in search):
        value, own = (_of_fold(chosen, key, fold) for key in (name, "k"))
        if value is not None and own is not None:
            at = dict(zip(*curve(search, name, None if name == "k" else int(own), higher), strict=True))
            rings.add((value, at[value]))
    if rings:
        here.plot(
            *zip(*sorted(rings), strict=True), linestyle="none", marker="o", markersize=9, markerfacecolor="none",
            markeredgecolor=VERMILLION, markeredgewidth=1.2, label="chosen", clip_on=False,
        )  # fmt: skip


def _of_fold(chosen: Mapping[str, float], name: str, fold: str) -> float | None:
    """Return what one fold chose: the common value where all chose alike."""
    value = chosen.get(name, chosen.get(f"{name} of fold {fold}"))
    return None if value is None else float(value)


def _caption(group: Group, shown: Sequence[Panel], names: Sequence[str]) -> str:
    picks = []
    for panel in shown:
        chosen = panel.row["chosen"]
        picked = (f"{_called(name)} = {value:g}" for name, value in sorted(chosen.items()))
        picks.append(f"{panel.sensor}: {', '.join(picked)}")
    folds = any(" of fold " in name for panel in shown for name in panel.row["chosen"])
    means = " Scores are means over folds, which did not all choose alike: a ring each." if folds else ""
    others = " At each value the best over the other parameters is shown." if len(names) > 1 else ""
    low = "higher" if metric_called(group.task.metric).higher_is_better else "lower"
    return (
        f"{metric_name(group.task)} on validation data ({low} is better) against what was searched, "
        f"{', '.join(_called(name) for name in names)}; one panel a sensor ({sensors(group)}), one line a length k of "
        f"the mean filter over samples t−k … t. Ringed: the candidate chosen ({'; '.join(picks)}).{means}{others}"
        f"{marks(group)}"
    )


def _called(name: str) -> str:
    plain, of, fold = name.partition(" of fold ")
    return {"lambda_": "λ", "alpha": "α"}.get(plain, plain) + of + fold


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
