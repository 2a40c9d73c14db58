"""The conformance level of a sensor beside its rows, if they were made by the package that was checked.

`check NAME --out FOLDER` leaves ``conformance/NAME.json`` in a result folder.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tactbench.core.files import replace_file
from tactbench.core.provenance.source import PACKAGE

Row = dict[str, Any]

FOLDER = "conformance"
KEY = "conformance_level"
"""Key of a row for the level, or for why there is none, in a folder with such a file."""
NOT_CHECKED, OTHER_VERSION = "not checked", "other version"
_LEVELS = ("none", "bronze", "silver", "gold")


def identity_of(package: str, provenance: Mapping[str, Any]) -> dict[str, str]:
    """Return what identifies one state of a plugin's package, from the provenance of a run; empty: not known."""
    if package == PACKAGE:
        return {name: str(provenance[name]) for name in ("tactbench", "commit") if name in provenance}
    for one in provenance.get("plugins", ()):
        if one["package"] == package:
            return {name: str(one.get(name)) for name in ("distribution", "version", "source")}
    return {}


def write_level(folder: Path, sensor: str, facts: Mapping[str, Any]) -> Path:
    """Write what a check found into a result folder and return the file; raises OSError if it cannot be written."""
    path = folder / FOLDER / f"{sensor}.json"
    path.parent.mkdir(exist_ok=True)
    replace_file(path, (json.dumps({"sensor": sensor, **facts}, indent=1) + "\n").encode())
    return path


def read_levels(folder: Path) -> dict[str, dict[str, Any]]:
    """Return the findings of the checks, by sensor."""
    return {path.stem: json.loads(path.read_bytes()) for path in sorted((folder / FOLDER).glob("*.json"))}


def merge_levels(folders: Sequence[Path], into: Path) -> None:
    """Write the levels of `folders` into another folder; of two levels of one sensor the lower one."""
    found = [one for folder in folders for one in read_levels(folder).items()]
    # The last one that is written stays.
    for sensor, facts in sorted(found, key=lambda one: (-_LEVELS.index(one[1]["level"]), json.dumps(one[1]))):
        write_level(into, sensor, facts)


def with_levels(rows: Sequence[Row], folder: Path, provenance: Callable[[str], Mapping[str, Any]]) -> list[Row]:
    """Return rows with the level of their sensors under `KEY`, or as they are where nothing was checked.

    Parameters
    ----------
    provenance
        By a row's ``made_by``.
    """
    levels = read_levels(folder)
    return [{**row, KEY: _level(row, levels, provenance)} for row in rows] if levels else list(rows)


def _level(row: Row, levels: Mapping[str, Mapping[str, Any]], provenance: Callable[[str], Mapping[str, Any]]) -> str:
    facts = levels.get(str(row.get("sensor")))
    if facts is None:
        return NOT_CHECKED
    made_with = identity_of(str(facts.get("package")), provenance(str(row.get("made_by"))))
    return str(facts["level"]) if made_with and made_with == facts.get("identity") else OTHER_VERSION
