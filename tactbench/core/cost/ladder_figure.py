"""The ladder as a figure: score against fit time, and score against answer delay."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tactbench.core.cost.labels import Box, label
from tactbench.core.cost.ladder import Ladder
from tactbench.core.cost.ladder_rows import LOOPS_HZ, Record

# Okabe and Ito's colours, told apart by people with any colour vision; shapes say the same again. Grey is for answers
# that look at nothing.
_MARKS = (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^"), ("#CC79A7", "D"), ("#E69F00", "v"), ("#56B4E9", "P"),
          ("#000000", "X"), ("#F0E442", "h"))  # fmt: skip
_TRIVIAL = ("#888888", ".")
_QUARTILES = {"fit_s": ("fit_s_q1", "fit_s_q3"), "answer_delay_ms": ("answer_delay_ms_q1", "answer_delay_ms_q3")}


def draw_ladder(ladder: Ladder, paths: Sequence[Path], metric: str = "") -> Any:
    """Draw the ladder, save it under every one of `paths`, and return the figure.

    `metric` is the score's name for people. Upwards is the score with its interval, across the median time with its
    quartiles, by decades. The line is the front, in steps: between two estimators there is none. Vertical lines in the
    second panel are the periods of control loops.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    about = ladder.about
    rows, beyond = _near(
        [row for row in ladder.rows if row["status"] == "done" and row["fit_s"] is not None], about["higher_is_better"]
    )
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
                fmt=shape, color=colour, ms=6, lw=0.8, alpha=0.9,
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
    if beyond:
        worse, height, side = ("below", 0.01, "bottom") if about["higher_is_better"] else ("above", 0.99, "top")
        listed = ", ".join(f"{row['estimator']} at {row['score']:.3g}" for row in beyond)
        panels[0].annotate(f"further {worse}: {listed}", (0.01, height), xycoords="axes fraction", va=side, fontsize=8,
                           color="#555555")  # fmt: skip
    unit = "" if about["unit"] == "1" else f" [{about['unit']}]"
    better = "higher" if about["higher_is_better"] else "lower"
    known = any(row["ci_low"] is not None for row in rows)
    spread = "95 % interval over replicates" if known else "one replicate"
    panels[0].set_ylabel(f"{metric or about['metric']}{unit}, {spread}; {better} is better")
    simulated = " · SIM" if about["simulated"] else ""
    figure.suptitle(f"{about['sensor']}, {about['task']} · {about['protocol']} · split {about['split']}{simulated}")
    for axis in panels:
        axis.margins(x=0.12, y=0.08)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axis, time in zip(panels, _QUARTILES, strict=True):
        drawn = [row for row in rows if row[time] is not None]
        points = [(row[time], row["score"]) for row in drawn]
        label(axis, points, [row["estimator"] for row in drawn], _bars(axis, drawn, time))
    for path in paths:
        figure.savefig(path)
    return figure


def _near(rows: Sequence[Record], higher_is_better: bool) -> tuple[list[Record], list[Record]]:
    """Return the rows to be drawn, and the trivial ones so far off that the others would shrink to a line.

    Off is what lies further from the worst of the others than these are from each other.
    """
    scores = [row["score"] for row in rows if not row["is_baseline"]]
    if not scores:
        return list(rows), []
    spread = max(scores) - min(scores)
    limit = min(scores) - spread if higher_is_better else max(scores) + spread
    off = [row for row in rows if row["is_baseline"]
           and (row["score"] < limit if higher_is_better else row["score"] > limit)]  # fmt: skip
    return [row for row in rows if row not in off], off


def _ends(row: Record) -> tuple[float, float]:
    """Return the ends of a score's interval; the score itself where too few replicates carry one."""
    low, high = row["ci_low"], row["ci_high"]
    return (row["score"], row["score"]) if low is None or high is None else (low, high)


def _marks(rows: Sequence[Record]) -> dict[str, tuple[str, str]]:
    families = list(dict.fromkeys(sorted(row["family"] for row in rows if not row["is_baseline"])))
    own = {family: _MARKS[place % len(_MARKS)] for place, family in enumerate(families)}
    return {row["estimator"]: _TRIVIAL if row["is_baseline"] else own[row["family"]] for row in rows}


def _bars(axis: Any, rows: Sequence[Record], time: str) -> list[Box]:
    """Return the bars of intervals and quartiles as boxes in pixels, a line's breadth wide."""
    low, high = _QUARTILES[time]
    boxes = []
    for row in rows:
        x, y = axis.transData.transform((row[time], row["score"]))
        left, bottom = axis.transData.transform((row[low], _ends(row)[0]))
        right, top = axis.transData.transform((row[high], _ends(row)[1]))
        boxes += [Box(x - 1, bottom, x + 1, top), Box(left, y - 1, right, y + 1)]
    return boxes
