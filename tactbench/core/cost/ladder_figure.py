"""The ladder as a figure: score against fit time, and score against answer delay."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tactbench.core.cost.ladder import Ladder
from tactbench.core.cost.ladder_rows import LOOPS_HZ, Record
from tactbench.core.cost.precision import MARKS

_QUARTILES = {"fit_s": ("fit_s_q1", "fit_s_q3"), "answer_delay_ms": ("answer_delay_ms_q1", "answer_delay_ms_q3")}


def draw_ladder(ladder: Ladder, paths: Sequence[Path], metric: str = "") -> Any:
    """Draw the ladder, save it under every one of `paths`, and return the figure.

    `metric` is the score's name for people. Upwards is the score with its interval, across the median time with its
    quartiles, by decades; trivial answers are left out. The line is the front, in steps: between two estimators there
    is none. Vertical lines in the second panel are the periods of control loops.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    about = ladder.about
    rows = [row for row in ladder.rows if row["fit_s"] is not None and not row["is_baseline"]]
    marks = _marks(rows)
    figure = Figure(figsize=(13, 5.6), layout="constrained", dpi=150)
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2, sharey=True)
    for axis, (time, (low, high)), mark, across in zip(
        panels, _QUARTILES.items(), ("front_fit", "front_delay"),
        ("one fit, median and quartiles [s]", "answer delay, median and quartiles [ms]"), strict=True,
    ):  # fmt: skip
        for row in rows:
            if row[time] is None:
                continue
            colour, shape = marks[row["estimator"]]
            axis.errorbar(
                row[time], row["score"],
                xerr=[[row[time] - row[low]], [row[high] - row[time]]],
                yerr=[[max(0.0, row["score"] - _ends(row)[0])], [max(0.0, _ends(row)[1] - row["score"])]],
                fmt=shape, color=colour, ms=6, lw=0.8, alpha=0.9, label=row["estimator"],
            )  # fmt: skip
        best = sorted((row for row in rows if row[mark]), key=lambda row: float(row[time]))
        axis.plot([row[time] for row in best], [row["score"] for row in best], color="#555555", lw=1.2, zorder=0,
                  drawstyle="steps-post")  # fmt: skip
        axis.set_xscale("log")
        axis.set_xlabel(across)
        axis.grid(True, which="major", alpha=0.3)
    for rate in LOOPS_HZ:
        panels[1].axvline(1e3 / rate, color="black", ls="--", lw=0.8, zorder=0)
        panels[1].annotate(f"{rate} Hz", (1e3 / rate, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2),
                           textcoords="offset points", ha="center", va="bottom", fontsize=8)  # fmt: skip
    unit = "" if about["unit"] == "1" else f" [{about['unit']}]"
    better = "higher" if about["higher_is_better"] else "lower"
    known = any(row["ci_low"] is not None for row in rows)
    spread = "95 % interval over replicates" if known else "one replicate"
    panels[0].set_ylabel(f"{metric or about['metric']}{unit}, {spread}; {better} is better")
    simulated = " · SIM" if about["simulated"] else ""
    figure.suptitle(f"{about['sensor']}, {about['task']} · {about['protocol']} · split {about['split']}{simulated}")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center", fontsize=8, frameon=False)
    for path in paths:
        figure.savefig(path)
    return figure


def _ends(row: Record) -> tuple[float, float]:
    """Return the ends of a score's interval; the score itself where too few replicates carry one."""
    low, high = row["ci_low"], row["ci_high"]
    return (row["score"], row["score"]) if low is None or high is None else (low, high)


def _marks(rows: Sequence[Record]) -> dict[str, tuple[str, str]]:
    """Return the colour, the same in a family, and the shape of each estimator."""
    families: dict[str, list[str]] = {}
    for row in rows:
        families.setdefault(row["family"], []).append(row["estimator"])
    marks = {}
    for place, (_, members) in enumerate(sorted(families.items())):
        for number, name in enumerate(members):
            marks[name] = MARKS[place % len(MARKS)][0], MARKS[number % len(MARKS)][1]
    return marks
