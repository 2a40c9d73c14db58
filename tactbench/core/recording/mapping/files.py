"""Search for the files of each recording: patterns, words in paths, and tables that belong together."""

from __future__ import annotations

import re
from collections.abc import Iterator
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

BROKEN_LINKS = "are links to files that are not here"
OTHER_CASE = "have an ending in another case"
LINKED_FOLDERS = "are linked folders, which ** does not search"
FOLDERS = "are folders"
APPLE_DOUBLE = "are what macOS keeps beside other files (AppleDouble)"
_SAME_GROUPS = "Give both `path` expressions the same named groups."


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
    found: dict[str, list[FoundFile]] = {}
    left_out: list[str] = []
    no_tables: list[str] = []
    for name, source in mapping.tables.items():
        found[name], notes = _matching(name, source, root)
        left_out += [note for obstacle, note in notes.items() if obstacle in (OTHER_CASE, LINKED_FOLDERS)]
        no_tables += [note for obstacle, note in notes.items() if obstacle in (FOLDERS, APPLE_DOUBLE)]
    lead, *others = found
    shared = {name: sorted({*found[lead][0].words} & {*found[name][0].words} - {"file"}) for name in others}
    by_words: dict[tuple[str, ...], list[FoundFile]] = {}
    for name, names in shared.items():
        for file in found[name]:
            by_words.setdefault((name, *(file.words[word] for word in names)), []).append(file)
    sets: list[FileSet] = []
    used = set()
    for leader in found[lead]:
        files, words = {lead: leader}, dict(leader.words)
        for name in others:
            values = [leader.words[word] for word in shared[name]]
            fitting = by_words.get((name, *values), [])
            if len(fitting) == 1:
                files[name], words = fitting[0], {**fitting[0].words, **words}
                used.add((name, fitting[0].shown))
                continue
            what = ", ".join(map(" ".join, zip(shared[name], values, strict=True))) or "no shared words"
            there = f"are {len(fitting)}: {listed([one.shown for one in fitting], 'files')}" if fitting else "is none"
            left_out.append(f"{leader.shown} needs one file of table {name!r} ({what}); there {there}.")
            if fitting:
                raise MappingError(left_out[-1], hint=_SAME_GROUPS)
        if len(files) == len(found):
            sets.append(FileSet(files, words))
    if not sets:
        raise MappingError(left_out[-1], hint=_SAME_GROUPS)
    for name in others:
        alone = [file.shown for file in found[name] if (name, file.shown) not in used]
        left_out += [f"{shown} of table {name!r} belongs to no file of table {lead!r}." for shown in alone]
    return sets, tuple(left_out), tuple(no_tables)


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


def _matching(name: str, source: TableSource, root: Path) -> tuple[list[FoundFile], dict[str, str]]:
    """Return the files of a table, and a sentence about the other matches by the obstacle to reading them."""
    ending = PurePosixPath(source.files).suffix
    ending = ending if ending[1:].isalnum() else ""
    in_any_case = "".join(f"[{mark.lower()}{mark.upper()}]" if mark.isalpha() else mark for mark in ending)
    kinds: dict[str, list[str]] = {"": []}
    matches = root.glob(source.files.removesuffix(ending) + in_any_case)
    for path in sorted(matches, key=lambda one: one.relative_to(root).parts):
        kinds.setdefault(_obstacle(path, ending), []).append(path.relative_to(root).as_posix())
    if "**" in source.files:
        above, _, inside = source.files.partition("**")
        for path in root.glob(f"{above}**/*"):
            if path.is_symlink() and path.is_dir() and next(path.rglob(inside.lstrip("/") or "*"), None):
                kinds.setdefault(LINKED_FOLDERS, []).append(path.relative_to(root).as_posix())
    total, pattern = sum(map(len, kinds.values())), f"{source.files!r} (table {name!r})"
    notes = {
        obstacle: f"{len(paths)} of {total} matches of {pattern} {obstacle}: {listed(paths, 'paths', 12)}"
        for obstacle, paths in kinds.items()
        if obstacle
    }
    if BROKEN_LINKS in notes:
        raise MappingError(
            f"{notes[BROKEN_LINKS]}.",
            hint="Fetch what git-annex keeps elsewhere: `datalad get FILE`; remove other links, or narrow the pattern.",
        )
    if not kinds[""]:
        raise MappingError(
            f"No file matches {pattern} in {root}{''.join(f'; {note}' for note in notes.values())}.",
            hint="Check --root: the pattern starts below it.",
        )
    found = []
    for shown in kinds[""]:
        match = re.search(source.path, shown)
        if match is None:
            raise MappingError(
                f"{shown} matches {source.files!r} but not the expression {source.path!r} (table {name!r}).",
                hint="Make the pattern narrower, or the expression wider.",
            )
        words = {word: value or "" for word, value in match.groupdict().items()}
        found.append(FoundFile(root / shown, shown, {"file": PurePosixPath(shown).stem, **words}))
    return found, notes


def _obstacle(path: Path, ending: str) -> str:
    """Return the obstacle to reading a match; empty for a plain file with the ending of the pattern."""
    if not path.exists():
        return BROKEN_LINKS
    if not path.is_file():
        return FOLDERS
    if not path.name.endswith(ending):
        return OTHER_CASE
    if path.name.startswith("._"):
        with path.open("rb") as opened:
            return APPLE_DOUBLE if opened.read(4) == b"\0\x05\x16\x07" else ""
    return ""


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
