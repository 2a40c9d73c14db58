"""Import of all recordings that a mapping file describes (after an error, of none), and of a sensor's log file."""

from __future__ import annotations

import os
import re
import shutil
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Mapping as AnyMapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from dataclasses import replace as replaced
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import yaml
from pydantic import ValidationError

from tactbench.core.errors import (
    DataError,
    LinkError,
    MappingError,
    MissingRecordingError,
    RecordingError,
    UsageError,
    complaint,
)
from tactbench.core.files import try_lock, writable
from tactbench.core.plugins.interfaces import DeviceLog
from tactbench.core.plugins.registry import load_object
from tactbench.core.progress import Progress
from tactbench.core.recording.health import FINDINGS, MONOTONE, Finding, examine, is_copy
from tactbench.core.recording.mapping.channels import MappedStream, fill, no_translation, sensor_of
from tactbench.core.recording.mapping.files import RawRecording, Shape, find, read, require_same_shape, unused_columns
from tactbench.core.recording.mapping.model import MUST_NAME_SENTINELS, Mapping, Word
from tactbench.core.recording.mapping.samples import compare_clocks, samples, times, translations
from tactbench.core.recording.reader import UnwrittenRecording, content_digest, open_recording
from tactbench.core.recording.writer import write_recording
from tactbench.core.samples import Block, Quality, StreamData
from tactbench.core.spec.recording import RecordingMeta, Scalar, composed
from tactbench.core.spec.rig import SensorDescriptor
from tactbench.core.spec.scene import Role
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.spec.task import TASKS_FILE
from tactbench.core.spec.yaml_file import load_yaml

RIG = "import"
"""Name, in the meta of imported recordings, that stands for the unknown rig of another laboratory."""

ENDING = ".h5"
WAITING, PLACING = ".importing-", ".placing-"
"""Prefixes of an import's temporary folder: while it writes recordings, and while it moves them to their place."""
_OTHERWISE = "Give another folder with --out DIR, or replace the file with --replace."
_FILE_NAME = re.compile(r"^[A-Za-z0-9][A-Za-z0-9._-]*$")


@dataclass(frozen=True)
class Imported:
    """A recording written by an import, with its counts and findings."""

    path: Path
    meta: RecordingMeta
    rows: int
    """Number of rows of the recording's longest stream."""
    missing: dict[str, int]
    """Number of samples marked as missing, by channel."""
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class ImportReport:
    """Report of an import: files read, recordings written, and files and columns left out."""

    title: str
    recordings: tuple[Imported, ...]
    files_read: int
    tasks: tuple[str, ...] = ()
    """Names of the tasks that the mapping declares."""
    left_out: tuple[str, ...] = ()
    """Sentences about files that match a pattern but are not imported."""
    unused: tuple[str, ...] = ()
    """Sentences about columns that the mapping does not use, one for each table."""

    @property
    def rows(self) -> int:
        """Number of rows of all recordings together."""
        return sum(recording.rows for recording in self.recordings)

    @property
    def missing(self) -> dict[str, int]:
        """Number of samples marked as missing in all recordings together, by channel."""
        return dict(sum((Counter(recording.missing) for recording in self.recordings), Counter()))


def import_tables(
    mapping: Path, *, root: Path | None, out: Path, progress: Progress | None = None, replace: bool = False
) -> ImportReport:
    """Convert the tables that a mapping file describes into recordings.

    Parameters
    ----------
    mapping, root
        The mapping file, and the folder of the data set; None is the folder of the mapping file.
    out
        Folder for the recordings. After an error, no recording is placed there.
    progress
        Receives a step for every recording.
    replace
        True: existing recordings of the same name with other content are replaced; False: they are an error. Existing
        recordings with the same content are kept.

    Raises
    ------
    ConfigError, UnwritableError
        If the mapping file is not valid (the message names the line), or `out` cannot be written.
    MappingError
        If a table does not fit the mapping; the message names file, line and column where there are any.
    """
    loaded = load_yaml(mapping, Mapping)
    sensor, streams = sensor_of(loaded)
    tasks = _tasks_text(loaded)
    sets, left_out = find(loaded, mapping.parent if root is None else root)
    more = f" And {len(left_out) - 1} more." if left_out[1:] else ""
    beside = [Finding("left-out", "warning", f"the import left files out: {text}{more}") for text in left_out[:1]]
    made: list[Imported] = []
    shapes: dict[str, Shape] = {}
    origins: dict[str, str] = {}
    progress = progress or Progress()
    progress.begin(f"importing {mapping.stem}", len(sets))
    with aside(out) as folder:
        for files in sets:
            for raw in read(loaded, files):
                require_same_shape(loaded, raw, shapes)
                meta = _meta(loaded, raw, sensor, streams)
                first = origins.setdefault(meta.name.casefold(), meta.origin)  # on some disks A.h5 and a.h5 are one
                if len(origins) == len(made):
                    raise MappingError(
                        f"{first} and {meta.origin} would both become the recording {meta.name!r}.",
                        hint="Put a word that differs between them into `recording.name`.",
                    )
                made.append(_write(folder / f"{meta.name}{ENDING}", meta, loaded, raw, streams, beside))
            progress.advance(next(iter(files.files.values())).shown)
        target = out / TASKS_FILE
        if tasks and not replace and target.exists() and target.read_text(encoding="utf-8") != tasks:
            raise MappingError(f"{target} exists already and declares other tasks.", hint=_OTHERWISE)
        _write_tasks(folder, tasks)
        placed = [_in_place(one, out, replace=replace) for one in made]
        with writable(out):
            _place(folder.rename(folder.with_name(folder.name.replace(WAITING, PLACING))), out)
    names = tuple(task.name for task in loaded.tasks)
    count = len({file for one in sets for file in one.files.values()})
    return ImportReport(loaded.title, tuple(placed), count, names, left_out, tuple(unused_columns(shapes)))


def import_log(
    log: Path,
    sensor: SensorDescriptor,
    options: AnyMapping[str, Any],
    *,
    out: Path,
    session: str,
    role: Role | None,
    labels: AnyMapping[str, Scalar],
    replace: bool,
) -> ImportReport:
    """Convert a log file of a sensor's own tools into a recording at `out`; after an error, none is written.

    `options` are those of the sensor's log reader, by name; `session`, `role` and `labels` are fields of
    :class:`~tactbench.core.spec.recording.RecordingMeta`. With `replace`, an existing file at `out` is replaced.

    Raises MissingRecordingError if the log does not exist, UsageError if the sensor has no reader for logs, the file is
    no such log, an option is not known or `out` is no name for a recording, and RecordingError if `out` exists or
    cannot be written.
    """
    if sensor.log_reader is None:
        raise UsageError(
            f"The sensor {sensor.name!r} has no reader for logs.",
            hint="Describe the log's tables in a mapping (docs/mappings.md), or add `log_reader` to its descriptor.",
        )
    if not log.is_file():
        raise MissingRecordingError(f"There is no log {log}.", hint="Check the path.")
    if out.suffix != ENDING:
        raise UsageError(f"{out} is no file name for a recording.", hint=f"Give --out a file that ends in {ENDING}.")
    try:
        found: DeviceLog = load_object(sensor.log_reader)(log, options)
    except (DataError, LinkError) as error:  # no fault of this machine: another file, or other options, are needed
        raise UsageError(error.message, hint=error.hint) from error
    began = (f"The log says that it began {found.started}.",) if found.started else ()
    meta = RecordingMeta(
        name=out.stem,
        sensor=sensor.spec.model_copy(update={"streams": found.streams}),
        rig=RIG,
        clock=found.clock,
        session=session,
        role=role,
        labels=dict(labels),
        remarks=(*found.remarks, *began),
        origin=log.name,
        counts=dict(found.counts),
    )
    write_recording(out, meta, found.blocks, {}, replace=replace)
    with open_recording(out) as written:
        rows = max(len(written.stream(name)) for name in written.stream_names)
        made = Imported(out, written.meta, rows, {}, tuple(examine(written)))
    return ImportReport(sensor.spec.title, (made,), 1)


def import_arrays(mapping: Mapping, raws: Iterable[RawRecording], out: Path, **about: object) -> list[Path]:
    """Write recordings from tables in memory, like :func:`import_tables`; `about`: further fields of their meta."""
    sensor, streams = sensor_of(mapping)
    _write_tasks(out, _tasks_text(mapping))
    metas = [(raw, _meta(mapping, raw, sensor, streams).model_copy(update=about)) for raw in raws]
    return [_write(out / f"{meta.name}{ENDING}", meta, mapping, raw, streams, ()).path for raw, meta in metas]


def _tasks_text(mapping: Mapping) -> str:
    """Return the text of the tasks file for the folder of the recordings; empty if the mapping declares no tasks."""
    if not mapping.tasks:
        return ""
    tasks = [task.model_dump(mode="json", exclude_unset=True) for task in mapping.tasks]
    body = yaml.safe_dump({"version": 1, "tasks": tasks}, sort_keys=False, allow_unicode=True)
    return f"# Tasks of these recordings, from their mapping; `tactbench run --recordings` reads them.\n{body}"


def _write_tasks(folder: Path, text: str) -> None:
    if text:
        with writable(folder / TASKS_FILE):
            (folder / TASKS_FILE).write_text(text, encoding="utf-8")


@contextmanager
def aside(out: Path) -> Iterator[Path]:
    """Return a context manager of a temporary folder, ignored by rigs, for recordings until all are written.

    Recordings of a killed import are removed or, if it had begun to move them to their place, moved there.
    """
    with writable(out):
        out.mkdir(parents=True, exist_ok=True)
        for left in (*out.glob(f"{WAITING}*"), *out.glob(f"{PLACING}*")):
            with _locked(left) as free:
                if free and left.name.startswith(PLACING):
                    _place(left, out)
                elif free:
                    shutil.rmtree(left, ignore_errors=True)
        folder = Path(mkdtemp(prefix=WAITING, dir=out))
    try:
        with _locked(folder):
            yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _locked(folder: Path) -> Iterator[bool]:
    """Return a context manager that locks an import's folder; its value is True if this process has the lock."""
    lock = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT, 0o666)
    try:
        yield bool(try_lock(lock))
    finally:
        os.close(lock)


def _place(folder: Path, out: Path) -> None:
    """Move the recordings in `folder` to `out`, and remove `folder`, whose presence keeps rigs from replaying `out`."""
    for path in sorted(folder.glob("[!.]*")):
        path.replace(out / path.name)
    shutil.rmtree(folder, ignore_errors=True)


def _write(
    path: Path,
    meta: RecordingMeta,
    mapping: Mapping,
    raw: RawRecording,
    streams: dict[str, MappedStream],
    beside: Sequence[Finding],
) -> Imported:
    """Write one recording with its findings; `beside` are further findings about the whole import."""
    clocks = {
        name: times(table, time)
        for name, table in raw.tables.items()
        if (time := mapping.tables[name].time) is not None
    }
    found = [*compare_clocks(mapping, raw.tables, clocks)]
    written: dict[str, StreamData] = {}
    for name, stream in streams.items():
        written[name], doubtful = samples(stream, raw.tables[stream.source.table], clocks.get(stream.source.table))
        found += doubtful
    found += _target_copies(meta, written)
    findings = (*beside, *examine(UnwrittenRecording(meta, written.values())), *found)
    missing = {
        channel.name: int(lacking)
        for one in written.values()
        for channel, lacking in zip(one.spec.channels, np.sum(one.quality == Quality.MISSING, axis=0), strict=True)
        if lacking
    }
    counts = {f"rows of {name}": len(one.data) for name, one in written.items()}
    counts |= {f"{channel} without a sample": number for channel, number in missing.items()}
    kept = [asdict(one) for one in findings if one.severity != "info"]
    meta = meta.model_copy(update={"counts": counts, "provenance": {FINDINGS: kept}})
    blocks = (Block(name, one.t_ns, one.data, one.quality) for name, one in written.items())
    write_recording(path, meta, blocks, {name: dict(one.annotations) for name, one in written.items()})
    return Imported(path, meta, max(len(table) for table in raw.tables.values()), missing, findings)


def _target_copies(meta: RecordingMeta, streams: dict[str, StreamData]) -> Iterator[Finding]:
    """Yield a finding for each channel of the sensor that is a copy of a force or torque of the reference."""
    reference = {one.name for one in meta.reference}
    sensed, forces = [], []
    for stream, one in streams.items():
        values = np.where(np.asarray(one.quality), np.nan, one.data)
        for channel, column in zip(one.spec.channels, values.T, strict=True):
            if stream not in reference:
                sensed.append((channel.name, column))
            elif channel.kind in MUST_NAME_SENTINELS:
                forces.append((channel.name, column))
    for (force, wanted), (name, column) in product(forces, sensed):
        if len(column) == len(wanted) and is_copy(column, wanted):
            text = f"{name}, a channel of the sensor, is {MONOTONE.format(force)}"
            yield Finding("target-among-features", "warning", text, channels=(name,))


def _meta(mapping: Mapping, raw: RawRecording, sensor: SensorSpec, streams: dict[str, MappedStream]) -> RecordingMeta:
    origin, names = ", ".join(raw.files), mapping.recording
    words: dict[str, Scalar] = dict(raw.words)
    for name, word in mapping.words.items():
        words[name] = _derived(name, word, words, origin)
    given = {one: fill(getattr(names, one), words, f"recording.{one}") for one in ("name", "session", "trial", "role")}
    if not _FILE_NAME.match(given["name"]):
        raise MappingError(
            f"The recording made from {origin} would be called {given['name']!r}, which is not a valid file name.",
            hint="Use letters, digits, dots, dashes and underscores; map other words to such names by the key `words`.",
        )
    reasons = [one.reason for one in mapping.exclude if any(fnmatchcase(file, one.files) for file in raw.files)]
    remarks = [] if mapping.clock != "none" else [
        "No clock: the source gives no times and no rate, only the order of rows."
    ]  # fmt: skip
    for name, table in mapping.tables.items():
        if table.time and table.time.epoch == "unknown":
            remarks.append(f"The meaning of time zero in table {name} is not known.")
    about = {one: fill(getattr(mapping.sensor, one), words, f"sensor.{one}") for one in ("name", "title")}
    try:
        return RecordingMeta.model_validate(given | {
            "sensor": SensorSpec.model_validate(dict(sensor) | about),
            "reference": [one.spec for one in streams.values() if one.source.of == "reference"],
            "rig": RIG,
            "simulated": False,
            "clock": mapping.clock,
            "role": given["role"] or None,
            "labels": {
                label: fill(value, words, f"recording.labels.{label}") if isinstance(value, str) else value
                for label, value in names.labels.items()
            },
            "excluded": "; ".join(dict.fromkeys(reasons)),
            "remarks": (*mapping.remarks, *remarks),
            "origin": origin,
        })  # fmt: skip
    except ValidationError as error:
        raise MappingError(
            f"{origin} gives no valid recording: {complaint(error)}.", hint="Translate words in its path under `words`."
        ) from error


def _derived(name: str, word: Word, words: dict[str, Scalar], origin: str) -> str:
    given = composed(fill(f"{{{word.of}}}", words, f"word {name}"))
    if word.divided_by is not None:
        if not given.isdecimal():
            raise MappingError(f"{origin}: the word {word.of!r} is {given!r}, no whole number.", hint="Use `values`.")
        return str(int(given) // word.divided_by)
    known = translations(word.values or {})
    if given not in known:
        raise no_translation(f"{origin}: {word.of}", given, name, known)
    return known[given]


def _in_place(made: Imported, out: Path, *, replace: bool) -> Imported:
    """Return a recording with its path in `out`; not moved if `out` already has a recording with equal content."""
    target = out / made.path.name
    if target.exists() and not replace:
        there = ""
        with suppress(RecordingError):
            there = content_digest(target)
        if there != content_digest(made.path):
            raise MappingError(f"{target} exists already, and differs from what would be written.", hint=_OTHERWISE)
        made.path.unlink()
    return replaced(made, path=target)
