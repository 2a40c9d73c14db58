"""What a measured ladder leaves in a result folder, and how it is read again.

::

    OUT/cost/SENSOR-TASK.json     the whole table, as below
    OUT/cost/SENSOR-TASK.csv      its rows alone
    OUT/cost/SENSOR-TASK.png, .pdf    score against fit time and against answer delay

The JSON file has ``version`` 3, what was asked (``sensor``, ``task``, ``rig``, ``protocol``, ``split``, ``seed``), the
score's ``metric``, ``unit``, ``higher_is_better``, ``simulated`` and ``dagger`` as in a leaderboard's row, how it was
timed (``fold``, ``rounds``, ``threads``, ``load``, ``cores``, ``remarks``), ``provenance``, and ``rows``:
one for each estimator, the best score first, what nobody could measure null. Times of different hosts are never
compared. docs/glossary.md says what each time of a row is; ``_q1`` and ``_q3`` are quartiles, ``delay_parts_ms`` what a
delay is the sum of.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tactbench.core.cost.ladder import Ladder
from tactbench.core.cost.precision import MARKS
from tactbench.core.files import replace_file, writable
from tactbench.core.tables.csv_text import csv_of_records

VERSION = 3
_PANELS = (
    ("fit_s", "front_fit", "one fit, median and quartiles [s]"),
    ("answer_delay_ms", "front_delay", "answer delay, median and quartiles [ms]"),
)


def write_ladder(ladder: Ladder, folder: Path, metric: str = "") -> list[Path]:
    """Write a ladder's four files into the result folder, each whole or not at all; return their paths.

    `metric` is the score's name for people, in the figure.

    Raises
    ------
    UnwritableError
        If the folder cannot be written.
    """
    place = folder / "cost" / f"{ladder.about['sensor']}-{ladder.about['task']}"
    whole = {"version": VERSION, **ladder.about, "rows": ladder.rows}
    paths = [place.with_name(f"{place.name}.{ending}") for ending in ("json", "csv", "png", "pdf")]
    with writable(place.parent):
        place.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        replace_file(paths[0], text.encode())
        replace_file(paths[1], csv_of_records(ladder.rows).encode())
        draw_ladder(ladder, paths[2:], metric)
    return paths


def draw_ladder(ladder: Ladder, paths: Sequence[Path], metric: str = "") -> Any:
    """Draw score against fit time and against answer delay, save it under every one of `paths`, return the figure.

    Upwards is the score with its interval, across the median time with its quartiles, by decades; trivial answers are
    left out. The line is the front, in steps: between two estimators there is none.
    """
    from matplotlib.figure import Figure

    about = ladder.about
    rows = [row for row in ladder.rows if row["fit_s"] is not None and not row["is_baseline"]]
    figure = Figure(figsize=(13, 5.6), layout="constrained", dpi=150)
    panels = figure.subplots(1, 2, sharey=True)
    for axis, (time, front, across) in zip(panels, _PANELS, strict=True):
        for place, row in enumerate(rows):
            if row[time] is not None:
                low, high = (row["score"] if row[end] is None else row[end] for end in ("ci_low", "ci_high"))
                axis.errorbar(
                    row[time], row["score"],
                    xerr=[[row[time] - row[f"{time}_q1"]], [row[f"{time}_q3"] - row[time]]],
                    yerr=[[max(0.0, row["score"] - low)], [max(0.0, high - row["score"])]],
                    fmt=MARKS[place % len(MARKS)][1], color=f"C{place % 10}", ms=6, lw=0.8, label=row["estimator"],
                )  # fmt: skip
        best = sorted((row for row in rows if row[front]), key=lambda row: float(row[time]))
        axis.plot([row[time] for row in best], [row["score"] for row in best], color="#555555", lw=1.2, zorder=0,
                  drawstyle="steps-post")  # fmt: skip
        axis.set(xscale="log", xlabel=across)
        axis.grid(True, which="major", alpha=0.3)
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
