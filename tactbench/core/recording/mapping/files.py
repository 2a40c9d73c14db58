"""Search for the files of each recording: patterns, words in paths, and tables that belong together."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from tactbench.core.errors import MappingError
from tactbench.core.recording.health import listed
from tactbench.core.recording.mapping.arrays import read_arrays
from tactbench.core.recording.mapping.bags import read_bag
from tactbench.core.recording.mapping.channels import columns_of
from tactbench.core.recording.mapping.model import Arrays, Bag, Column, Mapping, Parquet, TableSource, Xlsx
from tactbench.core.recording.mapping.parquet import read_parquet
from tactbench.core.recording.mapping.sheets import read_sheet
from tactbench.core.recording.mapping.signatures import require_format
from tactbench.core.recording.mapping.table import Table, UsedColumns
from tactbench.core.recording.mapping.text import read_text

Words = dict[str, str]


@dataclass(frozen=True)
class FoundFile:
    """A file, its path below the root folder, and the words in that path."""

    path: Path
    shown: str
    words: Words = field(compare=False)


@dataclass(frozen=True)
class FileSet:
    """Files that belong together, by their table, and the words of all their paths."""

    files: dict[str, FoundFile]
    words: Words


@dataclass(frozen=True)
class RawRecording:
    """The tables of one recording as they were read, and its words."""

    tables: dict[str, Table]
    words: Words
    files: tuple[str, ...]
    """Paths below the root folder."""


def find(mapping: Mapping, root: Path) -> tuple[list[FileSet], tuple[str, ...], tuple[str, ...]]:
    """Return the files that belong together, in the order of the first table's paths, and sentences about the others.

    The sentences of the second result are about files that make no recording, those of the third about no tables.

    Raises
    ------
    MappingError
        If a pattern finds no file, or links to files that are not here, a path lacks the words, a file has several
        partners, or none has one.
    """
    if not root.is_dir():
        raise MappingError(f"There is no folder {root}.", hint="Name the folder of the data set with --root DIR.")
    left_out: list[str] = []
    none: list[str] = []
    found = {name: _matching(name, source, root, left_out, none) for name, source in mapping.tables.items()}
    lead, *others = found
    shared = {name: sorted({*found[lead][0].words} & {*found[name][0].words} - {"file"}) for name in others}
    by_words: dict[str, dict[tuple[str, ...], list[FoundFile]]] = {name: {} for name in others}
    for name, names in shared.items():
        for file in found[name]:
            by_words[name].setdefault(tuple(file.words[word] for word in names), []).append(file)
    sets, orphans = [], []
    used: dict[str, set[str]] = {name: set() for name in others}
    for leader in found[lead]:
        files, words = {lead: leader}, dict(leader.words)
        for name in others:
            partner = _partner(leader, name, shared[name], by_words[name])
            if isinstance(partner, str):
                orphans.append(partner)
                continue
            used[name].add(partner.shown)
            files[name] = partner
            words = {**partner.words, **words}
        if len(files) == len(found):
            sets.append(FileSet(files, words))
    if not sets:
        raise MappingError(orphans[0], hint="Give both `path` expressions the same named groups.")
    for name in others:
        alone = [file.shown for file in found[name] if file.shown not in used[name]]
        orphans += [f"{shown} of table {name!r} belongs to no file of table {lead!r}." for shown in alone]
    return sets, (*left_out, *orphans), tuple(none)


def read(mapping: Mapping, files: FileSet) -> list[RawRecording]:
    """Return the recordings of files that belong together: one, or those of an array or of the values of a column."""
    shown = tuple(dict.fromkeys(file.shown for file in files.files.values()))
    for name, file in files.files.items():
        require_format(file.path, file.shown, mapping.tables[name].read.format)
    (first, source), *_ = mapping.tables.items()
    if isinstance(source.read, Arrays):
        file = files.files[first]
        return [
            RawRecording({first: array}, {**files.words, **words}, shown)
            for words, array in read_arrays(file.path, file.shown, source.read, file.words)
        ]
    tables: dict[str, Table] = {}
    topics: dict[FoundFile, dict[str, tuple[str, UsedColumns]]] = {}
    for name, file in files.files.items():
        how = mapping.tables[name].read
        assert not isinstance(how, Arrays)  # the model refuses an archive beside other tables
        if isinstance(how, Bag):
            topics.setdefault(file, {})[name] = how.topic, used_columns(mapping, name)
        elif isinstance(how, Xlsx):
            tables[name] = read_sheet(file.path, file.shown, how)
        elif isinstance(how, Parquet):
            tables[name] = read_parquet(file.path, file.shown, used_columns(mapping, name))
        else:
            tables[name] = read_text(file.path, file.shown, how)
    for file, wanted in topics.items():
        tables |= read_bag(file.path, file.shown, wanted)
    lead = tables[first]
    for name, table in tables.items():
        if mapping.join is not None and mapping.join.by == "rows" and len(table) != len(lead):
            raise MappingError(
                f"{table.shown} (table {name!r}) has {len(table)} rows, {lead.shown} has {len(lead)}.",
                hint="Tables joined by rows must be equally long; with a clock each, `by: clock` is an alternative.",
            )
    return list(_split(mapping, RawRecording({name: tables[name] for name in mapping.tables}, files.words, shown)))


class Shape(NamedTuple):
    """The columns of a table: of its first file, `shown`, of all files, and those that the mapping uses."""

    shown: str
    columns: tuple[Column, ...]
    everywhere: dict[Column, None]
    used: tuple[Column, ...]


def require_same_shape(mapping: Mapping, raw: RawRecording, shapes: dict[str, Shape]) -> None:
    """Raise MappingError if a table has other columns than the first file where the mapping names places."""
    for name, table in raw.tables.items():
        if name not in shapes:
            shapes[name] = Shape(table.shown, table.columns, {}, used_columns(mapping, name).columns)
        first = shapes[name]
        first.everywhere.update(dict.fromkeys(table.columns))
        by_place = [one for one in first.used if isinstance(one, int) and one < len(first.columns)]
        if by_place and len(table.columns) != len(first.columns):
            raise MappingError(
                f"{table.shown} has {len(table.columns)} columns, {first.shown} has {len(first.columns)} "
                f"(table {name!r}).",
                hint="Repair the file, import it by another mapping, or name the columns by a header.",
            )
        for place in by_place:
            if table.columns[place] != first.columns[place]:
                raise MappingError(
                    f"Column {place} is {table.columns[place]!r} in {table.shown} and {first.columns[place]!r} in "
                    f"{first.shown} (table {name!r}).",
                    hint="Name the columns by their headers instead of their places.",
                )


def unused_columns(shapes: dict[str, Shape]) -> Iterator[str]:
    """Yield a sentence for each table that names the columns that the mapping does not use."""
    for name, (_, _, columns, used) in shapes.items():
        left = [str(one) or str(place) for place, one in enumerate(columns) if not {one, place} & {*used}]
        if left:
            yield f"{len(left)} of {len(columns)} columns of table {name}: {listed(left, 'columns', 12)}"


def used_columns(mapping: Mapping, name: str) -> UsedColumns:
    """Return which columns of a table the mapping uses."""
    streams = [stream for stream in mapping.streams.values() if stream.table == name]
    numbers = [column for one in streams for group in one.channels for column in columns_of(group)]
    texts = [note.column for one in streams for note in one.annotations.values() if note.column is not None]
    texts += mapping.split_by.values() if name == next(iter(mapping.tables)) else ()
    return UsedColumns(tuple(dict.fromkeys(numbers)), tuple(dict.fromkeys(texts)), mapping.tables[name].time)


def _matching(name: str, source: TableSource, root: Path, left_out: list[str], none: list[str]) -> list[FoundFile]:
    """Return the files of a table; add sentences about other matches to `left_out` and, about no tables, to `none`."""
    ending = PurePosixPath(source.files).suffix
    ending = ending if ending[1:].isalnum() else ""
    in_any_case = "".join(f"[{mark.lower()}{mark.upper()}]" if mark.isalpha() else mark for mark in ending)
    pattern = f"{source.files!r} (table {name!r})"
    kinds: dict[str, list[Path]] = {"": [], "links": [], "folders": [], "case": [], "macOS": [], "linked": []}
    matches = root.glob(source.files.removesuffix(ending) + in_any_case)
    for path in sorted(matches, key=lambda one: one.relative_to(root).parts):
        kinds[_kind(path, ending)].append(path)
    if "**" in source.files:
        inside = source.files.partition("**")[2].lstrip("/")
        folders = [path for path in root.glob(source.files.partition("**")[0] + "**/*") if path.is_symlink()]
        kinds["linked"] += [path for path in folders if path.is_dir() and next(path.rglob(inside or "*"), None)]

    def listing(kind: str) -> str:
        return listed([path.relative_to(root).as_posix() for path in kinds[kind]], "files", 12)

    if kinds["links"]:
        raise MappingError(
            f"{len(kinds['links'])} of {len(kinds['links'] + kinds[''])} matches of {pattern} are links to files that "
            f"are not here: {listing('links')}.",
            hint="Fetch what git-annex keeps elsewhere: `datalad get FILE`; remove other links, or narrow the pattern.",
        )
    obstacles = {
        "case": f"files end in another case than {ending!r}",
        "linked": "linked folders hold matches; ** does not search them",
        "folders": "matches are folders", "macOS": "files are what macOS keeps beside others (AppleDouble)",
    }  # fmt: skip
    notes = {
        kind: f"{pattern}: {len(kinds[kind])} {obstacle}: {listing(kind)}"
        for kind, obstacle in obstacles.items()
        if kinds[kind]
    }
    left_out += [note for kind, note in notes.items() if kind in ("case", "linked")]
    none += [note for kind, note in notes.items() if kind in ("folders", "macOS")]
    if not kinds[""]:
        raise MappingError(
            f"No file matches {pattern} in {root}{''.join(f'; {note}' for note in notes.values())}.",
            hint="Check --root: the pattern starts below it.",
        )
    found = []
    for path in kinds[""]:
        shown = path.relative_to(root).as_posix()
        match = re.search(source.path, shown)
        if match is None:
            raise MappingError(
                f"{shown} matches {source.files!r} but not the expression {source.path!r} (table {name!r}).",
                hint="Make the pattern narrower, or the expression wider.",
            )
        words = {word: value or "" for word, value in match.groupdict().items()}
        found.append(FoundFile(path, shown, {"file": path.stem, **words}))
    return found


def _kind(path: Path, ending: str) -> str:
    """Return the kind of a match: the empty text for a plain file with the ending of the pattern, else the obstacle."""
    if not path.exists():
        return "links"
    if not path.is_file():
        return "folders"
    if not path.name.endswith(ending):
        return "case"
    if not path.name.startswith("._"):
        return ""
    with path.open("rb") as opened:
        return "macOS" if opened.read(4) == b"\0\x05\x16\x07" else ""


def _partner(
    leader: FoundFile, name: str, shared: Sequence[str], candidates: dict[tuple[str, ...], list[FoundFile]]
) -> FoundFile | str:
    """Return the file of table `name` that belongs to a file of the first; where there is none, a sentence about it."""
    fitting = candidates.get(tuple(leader.words[word] for word in shared), [])
    if len(fitting) == 1:
        return fitting[0]
    what = ", ".join(f"{word} {leader.words[word]}" for word in shared) or "no shared words"
    needs = f"{leader.shown} needs one file of table {name!r} ({what}); there "
    if not fitting:
        return f"{needs}is none."
    listed = ", ".join(one.shown for one in fitting[:3])
    raise MappingError(
        f"{needs}are {len(fitting)}: {listed}.", hint="Give both `path` expressions the same named groups."
    )


def _split(mapping: Mapping, raw: RawRecording) -> Iterator[RawRecording]:
    """Yield a recording for each combination of values in the columns of `split_by`, in order of appearance."""
    if not mapping.split_by:
        yield raw
        return
    lead = next(iter(raw.tables.values()))
    rows_of: dict[tuple[str, ...], list[int]] = {}
    for row, values in enumerate(zip(*(lead.texts(column) for column in mapping.split_by.values()), strict=True)):
        rows_of.setdefault(values, []).append(row)
    for values, rows in rows_of.items():
        words = dict(zip(mapping.split_by, values, strict=True))
        yield RawRecording(
            {name: table.take(rows) for name, table in raw.tables.items()}, {**raw.words, **words}, raw.files
        )
