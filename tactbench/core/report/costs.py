"""What accuracy costs in time: what `tactbench cost` has written, and its ladder as the terminal shows it too."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactbench.core.cost.ladder_file import VERSION
from tactbench.core.leaderboard.names import METRIC_NAMES
from tactbench.core.report.section import Picture, ReportData, Section
from tactbench.core.tables.numbers import delay, duration, interval, score, tail
from tactbench.core.tables.text import command_line
from tactbench.core.tables.text_table import ABSENT, Entry, TextTable, finite, text_table

COLUMNS = (
    "estimator", "score", "95 % interval", "fit", "quartiles", "delay", "latency p50", "p95", "batch/row", "data",
    "front", "100 Hz loop", "1 kHz loop", "remark",
)  # fmt: skip
RIGHT = ("score", "fit", "delay", "latency p50", "p95", "batch/row", "data")

SORTED_BY = {
    "score": "score", "95 % interval": "ci_low", "fit": "fit_s", "quartiles": "fit_s_q1",
    "delay": "answer_delay_ms", "latency p50": "latency_ms_p50", "p95": "latency_ms_p95",
    "batch/row": "batch_s_per_row", "data": "data_s",
}  # fmt: skip
"""Column -> key of the number behind it."""


def title(about: Mapping[str, Any]) -> str:
    """Return what holds for all rows: question, metric, protocol, rounds, threads."""
    better = "higher" if about["higher_is_better"] else "lower"
    simulated = f" · SIM ({about['rig']})" if about["simulated"] else ""
    dagger = " †" if about["dagger"] else ""
    threads = "1 thread" if about["threads"] == 1 else f"{about['threads']} threads"
    metric = METRIC_NAMES.get(about["metric"], about["metric"])
    return (
        f"{about['sensor']}, {about['task']}: {metric}, {better} is better · "
        f"{about['protocol']}{dagger} · split {about['split']}{simulated} · {about['rounds']} rounds, {threads}"
    )


def line(row: Mapping[str, Any], unit: str) -> dict[str, str]:
    """Return one estimator's texts by column; what was not measured is left out."""
    what = "oracle" if row.get("looks_at") == "reference" else "trivial"
    name = f"{row['estimator']} ({what})" if row["is_baseline"] else row["estimator"]
    remark = "; ".join((*([f"{row['status']}: {row['reason']}"] if row["status"] != "done" else []), *row["notes"]))
    texts = {"estimator": name, "remark": remark}
    if row["score"] is not None:
        texts |= {"score": score(row["score"], unit), "95 % interval": interval(row["ci_low"], row["ci_high"], unit)}
    if row["fit_s"] is None:
        return texts
    fronts = [what for what, on in (("fit", row["front_fit"]), ("delay", row["front_delay"])) if on]
    return texts | {
        "fit": duration(row["fit_s"]),
        "quartiles": f"{duration(row['fit_s_q1'])} … {duration(row['fit_s_q3'])}",
        "delay": delay(row["answer_delay_ms"], row["delay_parts_ms"]),
        "latency p50": duration(row["latency_ms_p50"] / 1e3),
        "p95": tail(row["latency_ms_p95"], row["latency_ms_max"], row["latency_n"]),
        "batch/row": duration(row["batch_s_per_row"]),
        "data": duration(row["data_s"]),
        "front": ", ".join(fronts),
        "100 Hz loop": _verdict(row, "loop_100_hz"),
        "1 kHz loop": _verdict(row, "loop_1000_hz"),
    }


def _verdict(row: Mapping[str, Any], loop: str) -> str:
    """Return whether the answer keeps up with a loop; if not, which part of its delay is the longest."""
    if row[loop] is None:
        return ""
    parts = row["delay_parts_ms"]
    return "yes" if row[loop] else f"no ({max(parts, key=parts.__getitem__)})"


FOLDER = "cost"


def costs_section(subject: ReportData) -> Section:
    """Return the section of costs and comparisons."""
    tables: list[TextTable] = []
    pictures: list[Picture] = []
    notes: list[str] = []
    for path in sorted((subject.folder / FOLDER).glob("*.json")):
        try:
            table = read_table(path, subject)
        except (OSError, ValueError) as error:
            notes.append(f"{FOLDER}/{path.name} cannot be shown: {error}")
            continue
        tables.append(table)
        drawing = path.with_suffix(".png")
        if drawing.is_file():
            caption = f"The numbers of the table {table.title!r}, as `tactbench cost` has drawn them."
            pictures.append(Picture(table.title, caption, drawing.read_bytes()))
    missing = () if tables else (_command(subject),)
    return Section(
        "cost",
        "What accuracy costs in time",
        tables=tuple(tables),
        notes=tuple(notes),
        pictures=tuple(pictures),
        missing=missing,
    )


def _command(subject: ReportData) -> str:
    timed = (row for row in subject.rows if row["status"] == "done" and row.get("answer_per") != "recording")
    some = next(timed, None)
    words = ("--sensor", some["sensor"], "--task", some["task"]) if some else ()
    command = command_line("tactbench", "cost", *words)
    return f"What an answer costs in time beside its score: `{command}`; of the simulation: `tactbench cost --twin`."


def read_table(path: Path, subject: ReportData) -> TextTable:
    """Return what a cost file says: an array of flat records, or an object that holds one, whatever their keys.

    What is the same in all records stands below the table, as do the object's own words; quartiles (``…_q1``,
    ``…_q3``) stay in the file. Numbers lead to the cell that record and object name between them.

    Raises
    ------
    ValueError
        If the file is no such thing.
    OSError
        If it cannot be read.
    """
    held = json.loads(path.read_bytes())
    about = held if isinstance(held, dict) else {}
    if about.get("version") == VERSION:
        try:
            return _ladder(about, subject)
        except (KeyError, TypeError) as error:
            raise ValueError(f"it is damaged ({error}); make it again with `tactbench cost`") from error
    records: Any = next((value for value in about.values() if _are_records(value)), held)
    if not _are_records(records):
        raise ValueError("it holds no array of records; make it again with `tactbench cost`")
    names = [
        name for name in dict.fromkeys(name for one in records for name in one) if not name.endswith(("_q1", "_q3"))
    ]
    alike = [name for name in names if len(records) > 1 and len({_text(one.get(name)) for one in records}) == 1]
    columns = [name for name in names if name not in alike]
    numeric = [name for name in columns if any(finite(one.get(name)) is not None for one in records)]
    shared = {name: value for name, value in about.items() if not isinstance(value, dict | list)} | {
        name: records[0].get(name) for name in alike
    }
    facts = ", ".join(f"{name} {_text(value)}" for name, value in shared.items() if _text(value) != ABSENT)
    words = [f"{name}: {text}." for name, text in (about.get("definitions") or {}).items()]
    lines = []
    for one in records:
        anchor = subject.anchor_of({**about, **one})
        lines.append([Entry(_text(one.get(name)), finite(one.get(name)), anchor) for name in columns])
    notes = [f"Of all lines: {facts}.", *words] if facts else words
    return text_table(f"Cost: {about.get('title', path.stem)}", columns, lines, numeric=numeric, notes=notes)


def _ladder(about: Mapping[str, Any], subject: ReportData) -> TextTable:
    """Return a ladder of estimators as the terminal shows it, each number leading to the cell it was timed for."""
    lines = []
    for row in about["rows"]:
        texts = line(row, about["unit"])
        anchor = subject.anchor_of({**about, "estimator": row["estimator"]})
        entries = []
        for name in COLUMNS:
            key = SORTED_BY.get(name)
            text = texts.get(name) or ABSENT
            entries.append(Entry(text, finite(row.get(key)), anchor) if key else Entry(text))
        lines.append(entries)
    kinds = ["baseline" if row["is_baseline"] else "result" if row["status"] == "done" else "failed"
             for row in about["rows"]]  # fmt: skip
    words = [f"{text}." for text in about["remarks"]]
    words += [f"{name}: {text}." for name, text in about["definitions"].items()]
    return text_table(f"Cost: {title(about)}", COLUMNS, lines, numeric=tuple(SORTED_BY), notes=words, kinds=kinds)


def _are_records(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, dict) for one in value)


def _text(value: Any) -> str:
    if value is None or value in ("", [], {}):
        return ABSENT
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_text(one)}" for name, one in value.items())
    return "; ".join(map(_text, value)) if isinstance(value, list) else str(value)
