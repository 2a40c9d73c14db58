"""Tables and files of what accuracy costs in time, as `tactbench cost` has measured it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactbench.core.files import replace_file, writable
from tactbench.core.leaderboard.names import direction, metric_name
from tactbench.core.report.figures.style import save, styled
from tactbench.core.report.figures.trade import draw_trade, title_of
from tactbench.core.tables.numbers import delay, duration, interval, score
from tactbench.core.tables.text import json_text
from tactbench.core.tables.text_table import Entry, TextTable, text_table

_COLUMNS = {
    "knob": "", "setting": "", "front": "", "score": "score", "95 % interval": "ci_low",
    "answer delay": "answer_delay_ms", "training": "fit_s", "simulation": "sim_s", "remark": "",
}  # fmt: skip
"""Key of the number behind each column; empty for a column of words."""


def trade_table(known: Mapping[str, Any]) -> TextTable:
    """Return what `tactbench.core.cost.knobs.measure` yields as a table; raises KeyError where a file of it is damaged.

    The front is of the settings that no other one beats in both score and answer delay.
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
    """Write the measured settings as ``PLACE.json``, and their figure as ``.png`` and ``.pdf``.

    Raises
    ------
    UnwritableError
        If the folder cannot be written.
    """
    with writable(place.parent), styled():
        place.parent.mkdir(parents=True, exist_ok=True)
        replace_file(place.with_name(f"{place.name}.json"), (json_text(known, indent=1) + "\n").encode())
        save(draw_trade(known), place)
