"""Figures and tables of accuracy against time: settings varied by `tactbench cost`, errors of a simulated rig."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.cost.knobs import SHARE, TIMES, diagrams
from tactbench.core.files import replace_file, writable
from tactbench.core.leaderboard.names import direction, grouped, metric_name
from tactbench.core.plugins.interfaces import CostPoint
from tactbench.core.report.figures.group import MARKERS, legend, panels, save, styled
from tactbench.core.tables.text import (
    Entry,
    TextTable,
    delay,
    duration,
    interval,
    json_text,
    score,
    text_table,
    visible,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ACROSS = {
    "answer_delay_ms": "answer delay [ms]", "fit_s": "training: one fit [s]", "sim_s": "simulating one campaign [s]",
}  # fmt: skip
"""Axis label of each kind of time, by key of a record."""


def draw_trade(known: Mapping[str, Any]) -> Figure:
    """Return the figure of score against time: a panel for each kind of time, with a path for each setting varied.

    Along a path one setting changes and all others keep their defaults. Upwards is the median over replicates with its
    interval; the dashed line is the best score without any input.
    """
    shown = [one for one in known["settings"] if one["score"] is not None and one.get(TIMES[one["knob"]]) is not None]
    times = [time for time in ACROSS if any(TIMES[one["knob"]] == time for one in shown)] or ["answer_delay_ms"]
    figure, axes = panels(1, len(times), wide=len(times) > 1, sharey=True)
    for here, time in zip(axes[0], times, strict=True):
        own = [one for one in shown if TIMES[one["knob"]] == time]
        for knob, path in grouped(own, lambda one: str(one["knob"])).items():
            place = list(TIMES).index(knob)
            points = [(one[time], one["score"], str(one["value"])) for one in path]
            _draw_points(here, points, place, line="" if knob == "estimator" else "-", label=knob)
            for one in path:
                if one["ci_low"] is not None and one["ci_high"] is not None:
                    here.vlines(one[time], one["ci_low"], one["ci_high"], color=f"C{place}")
        if known["trivial"] is not None:
            here.axhline(known["trivial"], color="grey", ls="--", label="best answer that looks at nothing")
        here.set(xlabel=ACROSS[time], xscale="log")
        _plain_numbers(here.xaxis)
    axes[0][0].set_ylabel(f"{metric_name(known)}, {direction(known)}")
    figure.suptitle(visible(title_of(known)))
    legend(figure, axes.flat)
    return figure


def title_of(known: Mapping[str, Any]) -> str:
    """Return a title with the sensor, task, protocol and number of replicates that all settings share."""
    simulated = " · SIM" if known["simulated"] else ""
    several = f"{known['replicates']} replicates" if known["replicates"] > 1 else "one replicate"
    bars = ", bars: 95 %" if any(one["ci_low"] is not None for one in known["settings"]) else ""
    return f"{known['sensor']}, {known['task']} · {known['protocol']}{simulated} · {several}{bars}"


def draw_precision(points: Sequence[CostPoint], title: str) -> Figure:
    """Return the figure of a simulated rig: error against seconds per recording, one panel for each observable.

    The dashed line is a third of the observable's noise.
    """
    found = diagrams(points)
    figure, axes = panels(1, len(found), wide=len(found) > 1)
    for here, ((subject, observable), group) in zip(axes[0], found.items(), strict=True):
        _draw_points(here, [(one.seconds, one.error, one.label) for one in group], 0, line="")
        if math.isfinite(group[0].floor):
            here.axhline(SHARE * group[0].floor, color="black", ls="--", label="a third of the noise")
        here.set(title=f"{subject}, {observable}", xlabel="seconds per recording", xscale="log", yscale="log",
                 ylabel=f"error, rms [{group[0].unit}]")  # fmt: skip
        _plain_numbers(here.xaxis)
        _plain_numbers(here.yaxis)
    figure.suptitle(title)
    legend(figure, axes.flat)
    return figure


def _plain_numbers(axis: Any) -> None:
    """Label a logarithmic axis with 1, 2, 5, 10 … instead of powers of ten."""
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(lambda x, _: f"{x:g}" if f"{x:e}"[0] in "25" else "")


def _draw_points(
    here: Axes, points: Sequence[tuple[float, float, str]], place: int, *, line: str, label: str = ""
) -> None:
    """Draw points with a text beside each, joined by a line of the style `line`; `place` selects colour and marker."""
    across, upwards, texts = zip(*points, strict=True)
    here.plot(across, upwards, MARKERS[place] + line, color=f"C{place}", label=label)
    for x, y, text in zip(across, upwards, texts, strict=True):
        here.annotate(f" {visible(text)}", (x, y), color=f"C{place}")


_COLUMNS = {
    "knob": "", "setting": "", "front": "", "score": "score", "95 % interval": "ci_low",
    "answer delay": "answer_delay_ms", "training": "fit_s", "simulation": "sim_s", "remark": "",
}  # fmt: skip
"""Key of the number by which a column is sorted; empty for a column of words."""


def trade_table(known: Mapping[str, Any]) -> TextTable:
    """Return the result of `tactbench.core.cost.knobs.measure` as a table; raises KeyError if a key is missing.

    The front consists of the settings that no other setting beats in both score and answer delay.
    """
    lines = []
    for one in known["settings"]:
        texts = {
            "knob": one["knob"], "setting": one["value"], "front": "yes" if one["front"] else "",
            "score": score(one["score"], known["unit"]),
            "95 % interval": interval(one["ci_low"], one["ci_high"], known["unit"]),
            "answer delay": delay(one["answer_delay_ms"], one["delay_parts_ms"]), "training": duration(one["fit_s"]),
            "simulation": duration(one["sim_s"]),
            "remark": "" if one["status"] == "done" else f"{one['status']}: {one['reason']}",
        }  # fmt: skip
        lines.append([Entry(texts[name], one.get(key)) for name, key in _COLUMNS.items()])
    nothing = "" if known["trivial"] is None else f" Looking at nothing: {score(known['trivial'], known['unit'])}."
    notes = [
        f"Score: {metric_name(known)}, {direction(known)}.{nothing}",
        "Front: no other setting is better in both score and answer delay; trees, window, rate and estimators compete.",
    ]
    kinds = ["failed" if one["status"] != "done" else "result" if one["front"] else "" for one in known["settings"]]
    numeric = [name for name, key in _COLUMNS.items() if key]
    return text_table(title_of(known), tuple(_COLUMNS), lines, numeric=numeric, notes=notes, kinds=kinds)


def write_trade(known: Mapping[str, Any], place: Path) -> None:
    """Write the measured settings as ``PLACE.json``, and their figure as ``PLACE.png`` and ``PLACE.pdf``.

    Raises
    ------
    UnwritableError
        If the folder cannot be written.
    """
    with writable(place.parent), styled():
        place.parent.mkdir(parents=True, exist_ok=True)
        replace_file(place.with_name(f"{place.name}.json"), (json_text(known, indent=1) + "\n").encode())
        save(draw_trade(known), place)
