"""What accuracy costs in time: what `tactbench cost` has written, and the tables of other rooms."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from tactbench.core.report.plain import ABSENT, Entry, PlainTable, finite, plain
from tactbench.core.report.section import Picture, Section, Subject

FOLDER = "cost"

TABLES: tuple[Callable[[Subject], Sequence[PlainTable]], ...] = ()
"""Tables beside those of `tactbench cost`: comparisons of protocols and splits, probes. None of them: an empty list."""


def costs_section(subject: Subject) -> Section:
    """Return the section of costs and comparisons."""
    tables: list[PlainTable] = []
    pictures: list[Picture] = []
    notes: list[str] = []
    for path in sorted((subject.folder / FOLDER).glob("*.json")):
        try:
            table = read_table(path, subject)
        except (OSError, ValueError, TypeError) as error:
            notes.append(f"{FOLDER}/{path.name} cannot be shown: {error}")
            continue
        tables.append(table)
        drawing = path.with_suffix(".png")
        if drawing.is_file():
            pictures.append(Picture(f"Cost: {path.stem}", _caption(table), drawing.read_bytes()))
    for others in TABLES:
        tables += others(subject)
    if not tables:
        some = next((row for row in subject.rows if row["status"] == "done"), None)
        command = f"tactbench cost --sensor {some['sensor']} --task {some['task']}" if some else "tactbench cost"
        told = (
            f"What an answer costs in time beside its score: `{command}`; of the simulation: `tactbench cost --twin`."
        )
        return Section("cost", "What accuracy costs in time", notes=tuple(notes), missing=(told,))
    return Section(
        "cost", "What accuracy costs in time", tables=tuple(tables), notes=tuple(notes), pictures=tuple(pictures)
    )


def read_table(path: Path, subject: Subject) -> PlainTable:
    """Return what a cost file says: an array of flat records, or an object that holds one, whatever their keys.

    Raises
    ------
    ValueError
        If the file is no such thing.
    OSError
        If it cannot be read.
    """
    held = json.loads(path.read_text(encoding="utf-8"))
    title, notes = f"Cost: {path.stem}", []
    if isinstance(held, dict):
        title = str(held.get("title", title))
        notes = [f"{name}: {value}" for name, value in held.items() if isinstance(value, str) and name != "title"]
        held = next((value for value in held.values() if _records(value)), None)
    if not _records(held):
        raise ValueError("it holds no array of records; make it again with `tactbench cost`")
    columns = list(dict.fromkeys(name for record in held for name in record))
    by_key = {row["key"]: row["cell"] for row in subject.rows if row["key"]}
    numeric = [name for name in columns if any(finite(record.get(name)) is not None for record in held)]
    lines = []
    for record in held:
        cell = record.get("cell") or by_key.get(record.get("key"))
        anchor = subject.anchors.get(cell, "") if isinstance(cell, str) else ""
        lines.append([_entry(record.get(name), anchor) for name in columns])
    return plain(title, columns, lines, numeric=numeric, notes=notes)


def _records(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, dict) for one in value)


def _entry(value: Any, anchor: str) -> Entry:
    measured = finite(value)
    if measured is not None:
        return Entry(f"{measured:.4g}" if isinstance(value, float) else str(value), measured, anchor)
    if value is None:
        return Entry(ABSENT)
    return Entry({True: "yes", False: "no"}.get(value, str(value)) if isinstance(value, bool) else str(value))


def _caption(table: PlainTable) -> str:
    return f"{table.title}: the numbers of the table with this name, as `tactbench cost` has drawn them."
