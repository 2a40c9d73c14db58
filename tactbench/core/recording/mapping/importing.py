"""The import itself: all recordings of a mapping, or none."""

from __future__ import annotations

import fnmatch
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from dataclasses import replace as replaced
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast, get_args

import numpy as np

from tactbench.core.errors import MappingError, RecordingError
from tactbench.core.files import writable
from tactbench.core.progress import Progress
from tactbench.core.recording.health import MONOTONE, Finding, examine, is_copy
from tactbench.core.recording.mapping.channels import MappedStream, device, fill, sensor_of
from tactbench.core.recording.mapping.files import RawRecording, find, read
from tactbench.core.recording.mapping.model import MUST_NAME_SENTINELS, Mapping, Word
from tactbench.core.recording.mapping.samples import compare_clocks, labels, samples, times
from tactbench.core.recording.mapping.table import TextTable
from tactbench.core.recording.mapping.tasks import check_tasks, place_tasks, require_answerable, tasks_text
from tactbench.core.recording.reader import content_digest, open_recording
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block, FloatArray
from tactbench.core.spec.recording import RecordingMeta, Scalar
from tactbench.core.spec.scene import Role
from tactbench.core.spec.sensor import SensorSpec, StreamSpec
from tactbench.core.spec.yaml_file import load_yaml

RIG = "import"
"""What an imported recording says about its rig: somebody else's, made known by a mapping."""

ENDING = ".h5"
_FILE_NAME = re.compile(r"^[A-Za-z0-9][A-Za-z0-9._-]*$")


@dataclass(frozen=True)
class Imported:
    """One recording that was written."""

    path: Path
    name: str
    rows: int
    """Rows of its longest stream"""
    sensor: str
    missing: dict[str, int] = field(default_factory=dict)
    """Samples marked as missing, by channel"""
    excluded: str = ""
    origin: str = ""
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class ImportReport:
    """What an import did."""

    title: str
    recordings: tuple[Imported, ...]
    files_read: int
    tasks: tuple[str, ...] = ()
    """Names of those that the mapping declares"""
    orphans: tuple[str, ...] = ()
    """Files that make no recording because another table has none for them, and why"""

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensors, in order of appearance."""
        return tuple(dict.fromkeys(recording.sensor for recording in self.recordings))

    @property
    def rows(self) -> int:
        """Rows of all recordings."""
        return sum(recording.rows for recording in self.recordings)

    @property
    def missing(self) -> dict[str, int]:
        """Samples marked as missing in all recordings, by channel."""
        counted: Counter[str] = Counter()
        for recording in self.recordings:
            counted.update(recording.missing)
        return dict(counted)

    @property
    def excluded(self) -> dict[str, int]:
        """Recordings that no evaluation will use, by reason."""
        return dict(Counter(recording.excluded for recording in self.recordings if recording.excluded))


def import_tables(
    mapping: Path, *, root: Path | None, out: Path, progress: Progress | None = None, replace: bool = False
) -> ImportReport:
    """Turn the tables that a mapping file describes into recordings.

    Parameters
    ----------
    mapping
        The mapping file.
    root
        Folder of the data set; None is the folder of the mapping file.
    out
        Folder of the recordings. It gets all of them or, if anything is wrong, none.
    progress
        Receives every set of files that is read.
    replace
        Replace recordings of the same name that hold something else; otherwise they are refused. One that holds the
        same already is left as it is.

    Raises
    ------
    ConfigError
        If the mapping file is wrong; the message names its line.
    MappingError
        If a table does not fit the mapping; the message names file, line and column where there are any.
    UnwritableError
        If `out` cannot be written.
    """
    loaded = load_yaml(mapping, Mapping)
    sensor, reference, streams = sensor_of(loaded)
    require_answerable(loaded, streams, mapping)
    tasks = tasks_text(loaded)
    sets, orphans = find(loaded, mapping.parent if root is None else root)
    made: list[Imported] = []
    progress = progress or Progress()
    progress.begin(f"importing {mapping.stem}", len(sets))
    with _aside(out) as folder:
        for files in sets:
            for raw in read(loaded, files):
                meta = _meta(loaded, raw, sensor, reference)
                _unique_name(meta, made)
                made.append(_write(folder / f"{meta.name}{ENDING}", meta, loaded, raw, streams))
            progress.advance(next(iter(files.files.values())).shown)
        check_tasks(out, tasks, replace=replace)
        placed = _place(made, out, replace=replace)
        place_tasks(out, folder, tasks)
    names = tuple(task.name for task in loaded.tasks)
    shown = {file.shown for files in sets for file in files.files.values()}
    return ImportReport(loaded.title, tuple(placed), len(shown), names, orphans)


@contextmanager
def _aside(out: Path) -> Iterator[Path]:
    """Give the folder in which recordings wait until all of them are good; hidden, so that no rig replays it.

    Folders that were made for an import that is refused are removed again.
    """
    made = [folder for folder in (out, *out.parents) if not folder.exists()]
    with writable(out):
        out.mkdir(parents=True, exist_ok=True)
        waiting = TemporaryDirectory(prefix=".importing-", dir=out)
    try:
        with waiting as folder:
            yield Path(folder)
    except BaseException:
        for empty in made:
            with suppress(OSError):
                empty.rmdir()
        raise


def _write(
    path: Path, meta: RecordingMeta, mapping: Mapping, raw: RawRecording, streams: dict[str, MappedStream]
) -> Imported:
    counts: dict[str, int] = {}
    missing: dict[str, int] = {}
    clocks = {
        name: times(table, time)
        for name, table in raw.tables.items()
        if (time := mapping.tables[name].time) is not None
    }
    found = [*compare_clocks(mapping, raw.tables, clocks)]
    sensed: dict[str, FloatArray] = {}
    reference: dict[str, FloatArray] = {}
    with RecordingWriter(path, meta, keep=False) as writer:
        for name, stream in streams.items():
            table = raw.tables[stream.source.table]
            read_in = samples(stream, table)
            found.extend(read_in.findings)
            columns = zip(stream.spec.channels, np.where(read_in.quality, np.nan, read_in.data).T, strict=True)
            for channel, column in columns:
                if stream.source.of == "sensor":
                    sensed[channel.name] = column
                elif channel.kind in MUST_NAME_SENTINELS:
                    reference[channel.name] = column
            writer.append(Block(name, clocks.get(stream.source.table), read_in.data, read_in.quality))
            for label, annotation in stream.source.annotations.items():
                writer.annotate(name, label, labels(label, annotation, table))
            missing.update(read_in.missing)
            counts[f"rows of {name}"] = len(table)
        counts |= {f"{channel} without a sample": number for channel, number in missing.items()}
        writer.revise(counts=counts)
    with open_recording(path) as written:
        findings = (*examine(written), *found, *_given_away(sensed, reference), *_trailing_delimiters(raw))
    rows = max(len(table) for table in raw.tables.values())
    return Imported(path, meta.name, rows, meta.sensor.name, missing, meta.excluded, meta.origin, findings)


def _given_away(sensed: dict[str, FloatArray], reference: dict[str, FloatArray]) -> Iterator[Finding]:
    """Yield what stands among the sensor's channels and gives a force of the reference away."""
    for (force, wanted), (name, column) in product(reference.items(), sensed.items()):
        if len(column) == len(wanted) and is_copy(column, wanted):
            text = f"{name}, a channel of the sensor, is {MONOTONE.format(force)}"
            yield Finding("target-among-features", "warning", "", (name,), 1, text)


def _trailing_delimiters(raw: RawRecording) -> Iterator[Finding]:
    for name, table in raw.tables.items():
        if isinstance(table, TextTable) and table.trailing:
            text = f"every line of table {name} ends with a delimiter; the empty cell behind it is left out"
            yield Finding("trailing-delimiter", "info", "", (), len(table), text)


def _meta(mapping: Mapping, raw: RawRecording, sensor: SensorSpec, reference: tuple[StreamSpec, ...]) -> RecordingMeta:
    origin = ", ".join(raw.files)
    words: dict[str, Scalar] = dict(raw.words)
    for name, word in mapping.words.items():
        words[name] = _derived(name, word, words, origin)
    names = mapping.recording
    name = fill(names.name, words, "recording.name")
    if not _FILE_NAME.match(name):
        raise MappingError(
            f"The recording made from {origin} would be called {name!r}, which is no file name.",
            hint="Use letters, digits, dots, dashes and underscores; translate words under `words`.",
        )
    role = fill(names.role, words, "recording.role") or None
    if role is not None and role not in get_args(Role):
        raise MappingError(
            f"The role of {origin} would be {role!r}.", hint=f"Roles: {', '.join(get_args(Role))}, or empty."
        )
    return RecordingMeta(
        name=name,
        sensor=device(sensor, mapping, words, origin),
        reference=reference,
        rig=RIG,
        simulated=False,
        clock=mapping.clock,
        session=fill(names.session, words, "recording.session"),
        trial=fill(names.trial, words, "recording.trial"),
        role=cast("Role | None", role),
        labels={
            label: fill(value, words, f"recording.labels.{label}") if isinstance(value, str) else value
            for label, value in names.labels.items()
        },
        excluded=_excluded(mapping, raw.files),
        remarks=(*mapping.remarks, *_clock_remarks(mapping)),
        origin=origin,
    )


def _derived(name: str, word: Word, words: dict[str, Scalar], origin: str) -> str:
    if word.of not in words:
        raise MappingError(
            f"The word {name!r} is made of {word.of!r}, which nothing gives; there are: {', '.join(sorted(words))}.",
            hint="Words may be made of words above them.",
        )
    given = str(words[word.of])
    if word.divided_by is not None:
        if not given.isdecimal():
            raise MappingError(f"{origin}: the word {word.of!r} is {given!r}, no whole number.", hint="Use `values`.")
        return str(int(given) // word.divided_by)
    known = {str(key): value for key, value in (word.values or {}).items()}
    if given not in known:
        raise MappingError(
            f"{origin}: {word.of} {given!r} has no translation for {name!r}; there are: {', '.join(known)}.",
            hint="Add it to `values`.",
        )
    return known[given]


def _excluded(mapping: Mapping, files: Sequence[str]) -> str:
    reasons = [rule.reason for rule in mapping.exclude if any(fnmatch.fnmatchcase(file, rule.files) for file in files)]
    return "; ".join(dict.fromkeys(reasons))


def _clock_remarks(mapping: Mapping) -> tuple[str, ...]:
    if mapping.clock == "none":
        return ("No clock: the source gives no time and no rate; rows are ordered, that is all.",)
    unknown = [name for name, table in mapping.tables.items() if table.time and table.time.epoch == "unknown"]
    return tuple(f"What time zero means in table {name} is not known." for name in unknown)


def _unique_name(meta: RecordingMeta, made: Sequence[Imported]) -> None:
    # Folded: on some disks Press.h5 and press.h5 are one file.
    other = next((one for one in made if one.name.casefold() == meta.name.casefold()), None)
    if other is not None:
        raise MappingError(
            f"{other.origin} and {meta.origin} would both become the recording {meta.name!r}.",
            hint="Put a word that tells them apart into `recording.name`.",
        )


def _place(made: Sequence[Imported], out: Path, *, replace: bool) -> list[Imported]:
    """Move finished recordings to their place, after all of them have been found to fit there."""
    to_move = []
    for one in made:
        target = out / one.path.name
        if target.exists() and not replace:
            if not _holds_the_same(target, one.path):
                raise MappingError(
                    f"{target} exists already and holds something else.",
                    hint="Give another folder with --out DIR, or replace it with --replace.",
                )
            continue
        to_move.append((one.path, target))
    with writable(out):
        for path, target in to_move:
            path.replace(target)
    return [replaced(one, path=out / one.path.name) for one in made]


def _holds_the_same(target: Path, path: Path) -> bool:
    try:
        return content_digest(target) == content_digest(path)
    except RecordingError:
        return False
