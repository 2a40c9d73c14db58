"""Score against time along each knob that `tactbench cost` turns."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.cost.knobs import TIMES
from tactbench.core.leaderboard.names import lower_is_better, metric_name
from tactbench.core.report.figures.style import GREY, LINES, PAGE_IN, panels
from tactbench.core.tables.text import visible

ACROSS = {
    "answer_delay_ms": "answer delay [ms]", "fit_s": "training: one fit [s]", "sim_s": "simulating one campaign [s]",
    "": "protocol",
}  # fmt: skip
"""Time -> label of its axis."""
LEAST_APART = 0.04
"""Of the width of a panel, between two settings of one path that are both written."""
_COLOURS = dict(zip(TIMES, (*LINES[:5], *LINES[:2], LINES[5]), strict=True))


def draw_trade(known: Mapping[str, Any]) -> Any:
    """Return the figure, in the style that is set: a panel for each time, in it a path for each knob that costs it.

    Along each path one setting changes and all others stay as they are. Upwards is the median over replicates with its
    interval; the dashed line is the best answer that looks at nothing.
    """
    paths: dict[str, list[Mapping[str, Any]]] = {}
    for one in known["settings"]:
        if one["score"] is not None and one.get(TIMES[one["knob"]], 0.0) is not None:
            paths.setdefault(one["knob"], []).append(one)
    paths = {knob: path for knob, path in paths.items() if len(path) > 1} or paths
    times = [time for time in ACROSS if time in {TIMES[knob] for knob in paths}] or ["answer_delay_ms"]
    widths = [2.0 if time == "answer_delay_ms" else 1.3 if time else 0.8 for time in times]
    figure, axes = panels(1, len(times), 3.4, width_in=PAGE_IN, sharey=True, width_ratios=widths)
    for axis, time in zip(axes[0], times, strict=True):
        axis.margins(x=0.08, y=0.12)
        own = [knob for knob in paths if TIMES[knob] == time]
        for knob in own:
            _path(axis, knob, paths[knob], time)
        if known["trivial"] is not None:
            axis.axhline(known["trivial"], color=GREY, ls="--", lw=0.8)
        axis.set_xlabel(ACROSS[time])
        if time:
            axis.set_xscale("log")
            low, high = axis.get_xlim()
            axis.set_xlim(low, high * (high / low) ** 0.65)  # room for the last name
            for place, knob in enumerate(own):
                _values(axis, paths[knob], time, _COLOURS[knob], above=place % 2 == 0)
            axis.xaxis.set_major_formatter("{x:g}")
            axis.xaxis.set_minor_formatter(lambda x, _: f"{x:g}" if f"{x:e}"[0] in "25" else "")
        axis.grid(True, which="major", alpha=0.25, lw=0.5)
    if known["trivial"] is not None:
        axes[0][0].annotate("looks at nothing", (0.99, known["trivial"]), (0, -8), color=GREY, ha="right",
                            xycoords=("axes fraction", "data"), textcoords="offset points")  # fmt: skip
    for axis, time in zip(axes[0], times, strict=True):  # now the limits, which all share, are known
        _names(axis, {knob: path[-1]["score"] for knob, path in paths.items() if TIMES[knob] == time and time})
    better = "lower" if lower_is_better(known["metric"]) else "higher"
    axes[0][0].set_ylabel(f"{metric_name(known)}, {better} is better")
    figure.suptitle(visible(title_of(known)))
    return figure


def title_of(known: Mapping[str, Any]) -> str:
    """Return what holds for all settings."""
    simulated = " · SIM" if known["simulated"] else ""
    several = f"{known['replicates']} replicates" if known["replicates"] > 1 else "one replicate"
    bars = ", bars: 95 %" if any(one["ci_low"] is not None for one in known["settings"]) else ""
    return f"{known['sensor']}, {known['task']} · {known['protocol']}{simulated} · {several}{bars}"


def _path(axis: Any, knob: str, path: Sequence[Mapping[str, Any]], time: str) -> None:
    colour = _COLOURS[knob]
    across = [one[time] for one in path] if time else list(range(len(path)))
    upwards = [one["score"] for one in path]
    low, high = ([one["score"] if one[end] is None else one[end] for one in path] for end in ("ci_low", "ci_high"))
    bars = [
        [max(0.0, score - end) for score, end in zip(upwards, low, strict=True)],
        [max(0.0, end - score) for score, end in zip(upwards, high, strict=True)],
    ]
    joined = "o-" if time and knob != "estimator" else "o"
    axis.errorbar(across, upwards, yerr=bars, color=colour, fmt=joined, ms=3, lw=1.2, elinewidth=0.6)
    if not time:
        axis.set_xticks(across, [visible(one["value"]) for one in path], rotation=90, fontsize=6)


def _values(axis: Any, path: Sequence[Mapping[str, Any]], time: str, colour: str, *, above: bool) -> None:
    """Write the setting at each point, but for those that stand too close to one that is written already."""
    low, high = map(math.log, axis.get_xlim())
    written: list[float] = []
    for one in path[::-1]:  # the last setting always
        x = (math.log(one[time]) - low) / (high - low)
        if all(abs(x - other) > LEAST_APART for other in written):
            written.append(x)
            axis.annotate(visible(one["value"]), (one[time], one["score"]), (3, 3 if above else -8), color=colour,
                          textcoords="offset points", fontsize=5.5)  # fmt: skip


def _names(axis: Any, last: Mapping[str, float]) -> None:
    """Write the knobs at the right edge, in the order in which their paths end, one above the other."""
    low, high = axis.get_ylim()
    y = -math.inf
    for knob, score in sorted(last.items(), key=lambda item: item[1]):
        y = max((score - low) / (high - low), y + 0.1)
        name = knob if len(knob) < 10 else "\n".join(knob.rsplit(" ", 1))
        axis.annotate(name, (0.99, y), xycoords="axes fraction", color=_COLOURS[knob], weight="bold", ha="right",
                      va="center")  # fmt: skip
