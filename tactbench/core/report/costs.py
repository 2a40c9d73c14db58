"""What accuracy costs in time, as `tactbench cost` has measured it: on the terminal, on the page and as files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tactbench.core.cost.knobs import TIMES
from tactbench.core.files import replace_file, writable
from tactbench.core.leaderboard.names import lower_is_better, metric_name
from tactbench.core.report.figures.style import styled
from tactbench.core.report.figures.trade import ACROSS, draw_trade, title_of
from tactbench.core.tables.csv_text import csv_of_records
from tactbench.core.tables.numbers import delay, duration, interval, score
from tactbench.core.tables.text import json_text
from tactbench.core.tables.text_table import Entry, TextTable, text_table

_COLUMNS = {
    "knob": "", "setting": "", "score": "score", "95 % interval": "ci_low", "answer delay": "answer_delay_ms",
    "training": "fit_s", "simulation": "sim_s", "remark": "",
}  # fmt: skip
"""Column -> key of the number behind it."""


def trade_tables(known: Mapping[str, Any]) -> list[TextTable]:
    """Return what `tactbench.core.cost.knobs.measure` yields as tables; raises KeyError where a file of it is damaged.

    The first, where there is one: the settings that no other one beats in both score and answer delay, the quickest
    first.
    """
    best = sorted((one for one in known["settings"] if one["front"]), key=lambda one: float(one["answer_delay_ms"]))
    title = f"{title_of(known)}: what answer delay buys"
    front = [_table(known, title, best).only([name for name in _COLUMNS if name not in ("simulation", "remark")])]
    return (front if best else []) + [_table(known, title_of(known), known["settings"]).compact()]


def _table(known: Mapping[str, Any], title: str, settings: list[Mapping[str, Any]]) -> TextTable:
    lines = []
    for one in settings:
        texts = {
            "knob": one["knob"], "setting": one["value"], "score": score(one["score"], known["unit"]),
            "95 % interval": interval(one["ci_low"], one["ci_high"], known["unit"]),
            "answer delay": delay(one["answer_delay_ms"], one["delay_parts_ms"]), "training": duration(one["fit_s"]),
            "simulation": duration(one["sim_s"]),
            "remark": "" if one["status"] == "done" else f"{one['status']}: {one['reason']}",
        }  # fmt: skip
        lines.append([Entry(texts[name], one.get(key)) for name, key in _COLUMNS.items()])
    better = "lower" if lower_is_better(known["metric"]) else "higher"
    nothing = "" if known["trivial"] is None else f" Looking at nothing: {score(known['trivial'], known['unit'])}."
    notes = [f"Score: {metric_name(known)}, {better} is better.{nothing}"]
    kinds = ["failed" if one["status"] != "done" else "result" if one["front"] else "" for one in settings]
    return text_table(title, tuple(_COLUMNS), lines, numeric=[name for name, key in _COLUMNS.items() if key],
                      notes=notes, kinds=kinds)  # fmt: skip


def told(known: Mapping[str, Any], before: Mapping[str, Any] | None) -> Iterator[str]:
    """Yield a sentence for each setting that was not known before, or one for a replicate that was not."""
    if before is not None and known["replicates"] > before["replicates"]:
        yield f"{known['sensor']}, {known['task']}: {known['replicates']} replicates"
        return
    had = {(one["knob"], one["value"]) for one in before["settings"]} if before else set()
    for one in known["settings"]:
        if (one["knob"], one["value"]) not in had:
            time = TIMES[one["knob"]] or "answer_delay_ms"
            seconds = one[time] if time.endswith("_s") or one[time] is None else one[time] / 1e3
            yield (
                f"{known['sensor']}, {known['task']}, {one['knob']} {one['value']}: "
                f"{score(one['score'], known['unit'])}, {ACROSS[time].partition(' [')[0]} {duration(seconds)}"
            )


def write_trade(known: Mapping[str, Any], place: Path) -> list[Path]:
    """Write what is known as ``PLACE.json``, ``.csv`` (its settings alone), ``.png`` and ``.pdf``; return their paths.

    Raises
    ------
    UnwritableError
        If the folder cannot be written.
    """
    json, csv, *pictures = paths = [place.with_name(f"{place.name}.{end}") for end in ("json", "csv", "png", "pdf")]
    with writable(place.parent):
        place.parent.mkdir(parents=True, exist_ok=True)
        replace_file(json, (json_text(known, indent=1) + "\n").encode())
        replace_file(csv, csv_of_records(known["settings"]).encode())
        with styled():
            figure = draw_trade(known)
            for picture in pictures:
                figure.savefig(picture, dpi=150)
    return paths
