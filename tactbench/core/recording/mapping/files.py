"""Which files make which recording: patterns, words in paths, and the tables that belong together."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tactbench.core.errors import MappingError
from tactbench.core.recording.mapping.arrays import read_arrays
from tactbench.core.recording.mapping.bags import Topic, read_bag
from tactbench.core.recording.mapping.channels import columns_of
from tactbench.core.recording.mapping.model import Arrays, Bag, Mapping, TableSource, Xlsx
from tactbench.core.recording.mapping.samples import check_join
from tactbench.core.recording.mapping.sheets import read_sheet
from tactbench.core.recording.mapping.table import BagTable, Table
from tactbench.core.recording.mapping.text import read_text

Words = dict[str, str]


@dataclass(frozen=True)
class FoundFile:
    """A file, its path below the root, and the words in that path."""

    path: Path
    shown: str
    words: Words = field(compare=False)


@dataclass(frozen=True)
class FileSet:
    """The files of one or more recordings: one for each table of the mapping."""

    files: dict[str, FoundFile]
    words: Words


@dataclass(frozen=True)
class RawRecording:
    """Tables of one recording, read."""

    tables: dict[str, Table]
    words: Words
    files: tuple[str, ...]
    """Paths below the root"""


def find(mapping: Mapping, root: Path) -> tuple[list[FileSet], tuple[str, ...]]:
    """Return what belongs together, in the order of the first table's paths, and which files lack a partner.

    Raises
    ------
    MappingError
        If a pattern finds no file, a path lacks the words, a file has several partners, or none has one.
    """
    if not root.is_dir():
        raise MappingError(f"There is no folder {root}.", hint="Name the folder of the data set with --root DIR.")
    found = {name: _matching(name, source, root) for name, source in mapping.tables.items()}
    lead, *others = found
    sets, orphans = [], []
    used: dict[str, set[str]] = {name: set() for name in others}
    for leader in found[lead]:
        files, words = {lead: leader}, dict(leader.words)
        for name in others:
            partner = _partner(leader, name, found[name])
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
    return sets, tuple(orphans)


def read(mapping: Mapping, files: FileSet) -> Iterator[RawRecording]:
    """Read what belongs together; an archive may hold several recordings."""
    shown = tuple(dict.fromkeys(file.shown for file in files.files.values()))
    (first, source), *_ = mapping.tables.items()
    if isinstance(source.read, Arrays):
        file = files.files[first]
        for words, array in read_arrays(file.path, file.shown, source.read, file.words):
            yield RawRecording({first: array}, {**files.words, **words}, shown)
        return
    tables: dict[str, Table] = {}
    topics: dict[FoundFile, dict[str, Topic]] = {}
    for name, file in files.files.items():
        how = mapping.tables[name].read
        assert not isinstance(how, Arrays)  # the model refuses an archive beside other tables
        if isinstance(how, Bag):
            tables[name] = BagTable(file.shown)  # keeps its place; read below, all topics of a bag at once
            topics.setdefault(file, {})[name] = _asked(mapping, name, how.topic)
        elif isinstance(how, Xlsx):
            tables[name] = read_sheet(file.path, file.shown, how)
        else:
            tables[name] = read_text(file.path, file.shown, how)
    for file, asked in topics.items():
        tables |= read_bag(file.path, file.shown, asked)
    check_join(mapping, tables)
    yield from _split(mapping, RawRecording(tables, files.words, shown))


def _asked(mapping: Mapping, name: str, topic: str) -> Topic:
    """Return which fields of a topic the mapping uses; no others are kept."""
    source = mapping.tables[name]
    streams = [stream for stream in mapping.streams.values() if stream.table == name]
    numbers = [column for one in streams for group in one.channels for column in columns_of(group)]
    texts = [note.column for one in streams for note in one.annotations.values() if note.column is not None]
    texts += mapping.split_by.values() if name == next(iter(mapping.tables)) else ()
    time = source.time.column if source.time is not None else None
    return Topic(topic, tuple(dict.fromkeys(numbers)), tuple(dict.fromkeys(texts)), time)


def _matching(name: str, source: TableSource, root: Path) -> list[FoundFile]:
    matches = list(root.glob(source.files))
    paths = [path for path in matches if path.is_file()]
    if not paths:
        instead = f"; {matches[0]} is none" if matches else ""
        raise MappingError(
            f"No file matches {source.files!r} (table {name!r}) in {root}{instead}.",
            hint="Check --root: the pattern starts below it.",
        )
    found = []
    for path in sorted(paths, key=lambda one: one.relative_to(root).parts):
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


def _partner(leader: FoundFile, name: str, candidates: list[FoundFile]) -> FoundFile | str:
    """Return the file of table `name` that belongs to a file of the first, or what to say where there is none."""
    shared = (set(leader.words) & set(candidates[0].words)) - {"file"}
    fitting = [one for one in candidates if all(one.words[word] == leader.words[word] for word in shared)]
    if len(fitting) == 1:
        return fitting[0]
    what = ", ".join(f"{word} {leader.words[word]}" for word in sorted(shared)) or "no shared words"
    needs = f"{leader.shown} needs one file of table {name!r} ({what}); there "
    if not fitting:
        return f"{needs}is none."
    listed = ", ".join(one.shown for one in fitting[:3])
    raise MappingError(
        f"{needs}are {len(fitting)}: {listed}.", hint="Give both `path` expressions the same named groups."
    )


def _split(mapping: Mapping, raw: RawRecording) -> Iterator[RawRecording]:
    """One recording for each combination of values in the columns of `split_by`, in order of appearance."""
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
