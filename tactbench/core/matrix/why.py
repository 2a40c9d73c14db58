"""Why a cell would be reused, or computed: what its key is made of now, held against what it was made of before."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactbench.core.errors import TactbenchError
from tactbench.core.matrix.key_book import Entry, KeyBook, Sections, recording_key, recording_names
from tactbench.core.matrix.keys import Fixed, Keys, Section, configuration_of
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.plan_recordings import RecordingRequest
from tactbench.core.matrix.recorded import Recorded
from tactbench.core.matrix.store import Store


@dataclass(frozen=True)
class Explanation:
    """What would happen to a cell, and why."""

    key: str
    """Empty: not known before its recordings are there."""
    hit: bool
    reasons: tuple[str, ...]
    """What differs from the result that is there, in words; what is missing."""
    unknown: str = ""
    """Why nothing can be said about what differs."""


def recording_entry(request: RecordingRequest, keys: Keys) -> Entry:
    """Return what went into a recording's key, for the book."""
    name = f"recording {request.sensor} {request.rig} {request.scene.name} {request.role} {request.seed}"
    scene = {"role": request.role, "seed": request.seed, "scene": request.scene.model_dump()}
    maker = keys.maker(request.sensor, request.rig, request.rig_file, request.scene)
    return Entry(name, recording_key(request.path), scene, maker)


def cell_entries(
    cells: Iterable[tuple[Cell, str, Sequence[Path]]], keys: Keys, recorded: Recorded, folder: Path
) -> Iterator[Entry]:
    """Yield what went into the keys of cells, for the book: each cell with its key and its recordings."""
    data: dict[tuple[Path, ...], dict[str, dict[str, str]]] = {}
    for cell, key, paths in cells:
        several = tuple(paths)
        if several not in data:  # one object for all cells of the same recordings: the book writes it once
            data[several] = _data(paths, recorded, folder)
        yield Entry(cell.name, key, _configuration(cell), keys.shared_by_cells(cell), data[several])


def explain(
    cell: Cell,
    paths: Sequence[Path],
    requests: Sequence[RecordingRequest],
    keys: Keys,
    recorded: Recorded,
    book: KeyBook,
    store: Store,
    known: str,
) -> Explanation:
    """Say whether the result of `cell` would be reused, and what differs.

    Parameters
    ----------
    paths
        Its recordings, whether they are there or not.
    requests
        How they are made; none if they were made elsewhere.
    known
        Key of the latest result of that name, or nothing.
    """
    now = _sections(keys.shared_by_cells(cell), _configuration(cell))
    missing = [path for path in paths if not path.exists()]
    before = book.sections(cell.name, known) if known else book.sections(cell.name)
    if missing or not paths:
        reasons = differences({name: part for name, part in (before or {}).items() if name != "data"}, now)
        reasons = reasons if before else []
        return Explanation("", False, (*reasons, *_unmade(paths, requests, missing, keys, book)))
    try:
        key = keys.of_cell(cell, [recorded.digest(path) for path in paths])
        now["data"] = _plain(_data(paths, recorded, store.folder))
    except TactbenchError as error:
        return Explanation("", False, (str(error),))
    if key == known or store.finished(key) is not None:
        return Explanation(key, True, ())
    if before is None:
        unknown = "" if not known else "What the result that is there was made of is not recorded in this folder."
        return Explanation(key, False, ("It was never computed into this folder.",) if not known else (), unknown)
    return Explanation(key, False, tuple(differences(before, now)))


def _unmade(
    paths: Sequence[Path], requests: Sequence[RecordingRequest], missing: Sequence[Path], keys: Keys, book: KeyBook
) -> list[str]:
    """Say why recordings have to be made; a reason that several share is said once."""
    if not paths:
        return ["There are no recordings of it."]
    if not requests:
        return [f"recording {path} is not there" for path in missing]
    reasons: dict[str, None] = {}
    never: list[str] = []
    for request in requests:
        if request.path not in missing:
            continue
        entry = recording_entry(request, keys)
        before = book.sections(entry.name)
        if before is None:
            never.append(request.scene.name)
            continue
        found = differences(before, _sections(entry.fixed, entry.configuration))
        reasons.update(dict.fromkeys(found or [f"recording {request.scene.name} was removed"]))
    unmade = [f"{len(never)} of {len(requests)} recordings were never made, {never[0]} first"] if never else []
    return [*unmade, *reasons]


def _configuration(cell: Cell) -> Section:
    # What the simulation was asked for decides through the recordings' bytes; here it tells why those differ.
    return {**configuration_of(cell), "simulation": cell.simulation.model_dump(exclude_defaults=True)}


def _sections(fixed: Fixed, configuration: Section) -> dict[str, Section]:
    return {name: _plain(part) for name, part in {**fixed.sections, "configuration": configuration}.items()}


def _plain(section: Section) -> Section:
    """Return a section as it reads when it comes back from the book."""
    plain: Section = json.loads(json.dumps(section, default=repr))
    return plain


def _data(paths: Sequence[Path], recorded: Recorded, folder: Path) -> dict[str, dict[str, str]]:
    return {
        name: {"digest": recorded.digest(path), "path": beside(path, folder)}
        for name, path in zip(recording_names(paths), paths, strict=True)
    }


def beside(path: Path, folder: Path) -> str:
    """Return `path` relative to the result folder where it lies inside, so that the folder may be moved."""
    inside = path.is_relative_to(folder)
    return str(path.relative_to(folder)) if inside else str(path.resolve())


_SOURCE = "source of "
_NONE = object()


def differences(before: Sections, now: Sections) -> list[str]:
    """Return one sentence for everything that differs, the most telling first; none if nothing does."""
    first = {"configuration": 0, "data": 1, "versions": 3}
    found: list[str] = []
    for name in sorted({*before, *now}, key=lambda one: (first.get(one, 2), one)):
        found += _section(name, before.get(name, {}), now.get(name, {}))
    return found


def _section(name: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    package = name.removeprefix(_SOURCE)
    if package != name and bool(old) != bool(new):
        yield f"the source of {package} {'counts now' if new else 'counts no longer'}"
        return
    if name == "data":  # where a recording lies decides nothing
        old, new = ({key: one.get("digest") for key, one in side.items()} for side in (old, new))
    flat_old, flat_new = dict(_flat(old)), dict(_flat(new))
    for place in sorted({*flat_old, *flat_new}):
        was, is_ = flat_old.get(place, _NONE), flat_new.get(place, _NONE)
        if was == is_:
            continue
        if package != name or name == "data":
            what = f"{package}/{place}" if package != name else f"recording {place}"
            other = "has other bytes" if name == "data" else "changed"
            yield f"{what} {'is new' if was is _NONE else 'is gone' if is_ is _NONE else other}"
        else:
            within = "" if name in ("configuration", "versions") else f"{name}: "
            yield f"{within}{place} {short(was)} -> {short(is_)}"


def _flat(facts: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every leaf with its dotted place."""
    if isinstance(facts, Mapping):
        for name, value in facts.items():
            yield from _flat(value, f"{prefix}.{name}" if prefix else str(name))
    elif isinstance(facts, list | tuple) and any(isinstance(value, Mapping | list | tuple) for value in facts):
        for place, value in enumerate(facts):
            yield from _flat(value, f"{prefix}[{place}]")
    else:
        yield prefix, list(facts) if isinstance(facts, tuple) else facts


def short(value: Any) -> str:
    """Return a value as text of 60 characters at most."""
    text = "nothing" if value is _NONE else value if isinstance(value, str) else repr(value)
    return text if len(text) <= 60 else f"{text[:59]}…"
