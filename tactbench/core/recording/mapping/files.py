"""Search for the files of each recording by path patterns, and pairing of tables by words in their paths."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from tactbench.core.errors import MappingError
from tactbench.core.recording.health import listed
from tactbench.core.recording.mapping.channels import columns_of
from tactbench.core.recording.mapping.formats import (
    Topic,
    read_arrays,
    read_bag,
    read_parquet,
    read_sheet,
    require_format,
)
from tactbench.core.recording.mapping.model import Arrays, Bag, Column, Mapping, Parquet, TableSource, Xlsx
from tactbench.core.recording.mapping.table import Table, Used, read_text

Words = dict[str, str]

BROKEN_LINKS = "are links to files that are not here"
OTHER_CASE = "have an ending in another case"
LINKED_FOLDERS = "are linked folders, which ** does not search"
_SAME_GROUPS = "Give both `path` expressions the same named groups."


@dataclass(frozen=True)
class FoundFile:
    """A file, its path below the root folder, and the words (named values) in that path."""

    path: Path
    shown: str
    words: Words = field(compare=False)


class FileSet(NamedTuple):
    """Files of the same recordings, by the name of their table, and the words in all their paths."""

    files: dict[str, FoundFile]
    words: Words


class RawRecording(NamedTuple):
    """The unconverted tables of one recording, its words, and the paths of its files below the root folder."""

    tables: dict[str, Table]
    words: Words
    files: tuple[str, ...]


def find(mapping: Mapping, root: Path) -> tuple[list[FileSet], tuple[str, ...]]:
    """Return the files that belong together, in the order of the first table's paths, and sentences about other files.

    Raises MappingError if a pattern matches no file or only broken links, a path does not match its expression, a file
    has several matches in another table, or no file has a match.
    """
    if not root.is_dir():
        raise MappingError(f"There is no folder {root}.", hint="Name the folder of the data set with --root DIR.")
    found: dict[str, list[FoundFile]] = {}
    left_out: list[str] = []
    for name, source in mapping.tables.items():
        found[name], notes = _matching(name, source, root)
        left_out += notes.values()
    lead, *others = found
    shared = {name: sorted({*found[lead][0].words} & {*found[name][0].words} - {"file"}) for name in others}
    by_words: dict[tuple[str, ...], list[FoundFile]] = {}
    for name, names in shared.items():
        for file in found[name]:
            by_words.setdefault((name, *(file.words[word] for word in names)), []).append(file)
    sets: list[FileSet] = []
    for leader in found[lead]:
        files, words = {lead: leader}, dict(leader.words)
        for name in others:
            needed = {word: leader.words[word] for word in shared[name]}
            fitting = by_words.get((name, *needed.values()), [])
            if len(fitting) == 1:
                files[name], words = fitting[0], {**fitting[0].words, **words}
                continue
            text = f"{leader.shown} needs one file of table {name!r} with the words {needed}; {len(fitting)} are found."
            left_out.append(text)
            if fitting:
                raise MappingError(text, hint=_SAME_GROUPS)
        if len(files) == len(found):
            sets.append(FileSet(files, words))
    if not sets:
        raise MappingError(left_out[-1], hint=_SAME_GROUPS)
    for name in others:
        used = {one.files[name].shown for one in sets}
        unmatched = [file.shown for file in found[name] if file.shown not in used]
        left_out += [f"{shown} of table {name!r} belongs to no file of table {lead!r}." for shown in unmatched]
    return sets, tuple(left_out)


def read(mapping: Mapping, files: FileSet) -> Iterator[RawRecording]:
    """Yield the recordings in files that belong together: one, or several by an array's axis or by `split_by`."""
    shown = tuple(dict.fromkeys(file.shown for file in files.files.values()))
    tables: dict[str, Table] = {}
    topics: dict[FoundFile, dict[str, Topic]] = {}
    for name, file in files.files.items():
        how, used = mapping.tables[name].read, used_columns(mapping, name)
        require_format(file.path, file.shown, how.format)
        if isinstance(how, Arrays):  # of which the model allows no others beside it
            for words, array in read_arrays(file.path, file.shown, how, file.words):
                yield RawRecording({name: array}, {**files.words, **words}, shown)
            return
        if isinstance(how, Bag):
            topics.setdefault(file, {})[name] = how, used, mapping.tables[name].time
        elif isinstance(how, Xlsx):
            tables[name] = read_sheet(file.path, file.shown, how)
        elif isinstance(how, Parquet):
            tables[name] = read_parquet(file.path, file.shown, used)
        else:
            tables[name] = read_text(file.path, file.shown, how)
    for file, wanted in topics.items():
        tables |= read_bag(file.path, file.shown, wanted)
    tables = {name: tables[name] for name in mapping.tables}
    lead, *others = tables.values()
    for table in others:
        if mapping.join is not None and mapping.join.by == "rows" and len(table) != len(lead):
            raise MappingError(
                f"{table.shown} has {len(table)} rows, {lead.shown} has {len(lead)}.",
                hint="Tables joined by rows must be equally long; if each has a clock, write `by: clock`.",
            )
    if not mapping.split_by:
        yield RawRecording(tables, files.words, shown)
        return
    rows_of: dict[tuple[str, ...], list[int]] = {}
    for row, values in enumerate(zip(*map(lead.texts, mapping.split_by.values()), strict=True)):
        rows_of.setdefault(values, []).append(row)
    for values, rows in rows_of.items():
        words = {**files.words, **dict(zip(mapping.split_by, values, strict=True))}
        yield RawRecording({name: table.take(rows) for name, table in tables.items()}, words, shown)


class Shape(NamedTuple):
    """Columns of a table: in its first file, `shown`; in any of its files; and columns that the mapping uses."""

    shown: str
    columns: tuple[Column, ...]
    everywhere: dict[Column, None]
    used: Used


def require_same_shape(mapping: Mapping, raw: RawRecording, shapes: dict[str, Shape]) -> None:
    """Raise MappingError if columns that the mapping gives by place differ from those in the table's first file."""
    for name, table in raw.tables.items():
        if name not in shapes:
            shapes[name] = Shape(table.shown, table.columns, {}, used_columns(mapping, name))
        first = shapes[name]
        first.everywhere.update(dict.fromkeys(table.columns))
        by_place = {one for one in first.used if isinstance(one, int)}
        for place, (one, other) in enumerate(zip_longest(table.columns, first.columns)):
            if by_place and one != other and (place in by_place or None in (one, other)):
                raise MappingError(
                    f"Column {place} is {one!r} in {table.shown} and {other!r} in {first.shown} (table {name!r}).",
                    hint="Repair the file, import it by another mapping, or give columns by their names.",
                )


def unused_columns(shapes: dict[str, Shape]) -> Iterator[str]:
    """Yield a sentence for each table with unused columns, with the names of these columns."""
    for name, (_, _, columns, used) in shapes.items():
        left = [str(one) or str(place) for place, one in enumerate(columns) if not {one, place} & {*used}]
        if left:
            yield f"{len(left)} of {len(columns)} columns of table {name}: {listed(left, 'columns', 12)}"


def used_columns(mapping: Mapping, name: str) -> Used:
    """Return the columns of a table that the mapping uses; True for readings, False for texts and times."""
    streams, time = [one for one in mapping.streams.values() if one.table == name], mapping.tables[name].time
    numbers = [column for one in streams for group in one.channels for column in columns_of(group)]
    texts = [note.column for one in streams for note in one.annotations.values() if note.column is not None]
    texts += mapping.split_by.values() if name == next(iter(mapping.tables)) else ()
    return dict.fromkeys(texts, False) | dict.fromkeys(numbers, True) | ({time.column: False} if time else {})


def _matching(name: str, source: TableSource, root: Path) -> tuple[list[FoundFile], dict[str, str]]:
    """Return the files of a table and, by obstacle to reading, a sentence about matching files that are left out."""
    ending = found[0] if (found := re.search(r"\.\w+$", source.files)) else ""
    in_any_case = re.sub("[A-Za-z]", lambda letter: f"[{letter[0].lower()}{letter[0].upper()}]", ending)
    kinds: dict[str, list[str]] = {"": []}
    matches = root.glob(source.files.removesuffix(ending) + in_any_case)
    for path in sorted(matches, key=lambda one: one.relative_to(root).parts):
        if path.is_dir() or path.name.startswith("._"):  # which macOS keeps beside other files (AppleDouble)
            continue
        obstacle = BROKEN_LINKS if not path.exists() else "" if path.name.endswith(ending) else OTHER_CASE
        kinds.setdefault(obstacle, []).append(path.relative_to(root).as_posix())
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
            hint="Fetch files of git-annex: `datalad get FILE`; remove other links, or narrow the pattern.",
        )
    if not kinds[""]:
        raise MappingError(
            f"No file matches {pattern} in {root}{''.join(f'; {note}' for note in notes.values())}.",
            hint="Check --root: the pattern starts below it.",
        )
    files = []
    for shown in kinds[""]:
        match = source.path.search(shown)
        if match is None:
            raise MappingError(
                f"{shown} matches {source.files!r} but not the expression {source.path.pattern!r} (table {name!r}).",
                hint="Make the pattern narrower, or the expression wider.",
            )
        words = {word: value or "" for word, value in match.groupdict().items()}
        files.append(FoundFile(root / shown, shown, {"file": PurePosixPath(shown).stem, **words}))
    return files, notes
