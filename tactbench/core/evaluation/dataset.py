"""Read recordings into tables: for each recording, features, targets and group labels on one clock."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.channels import (
    SlipReference,
    channel_on,
    channels_for,
    feature_streams,
    numbers,
    on_clock,
    read_channel,
    require_forward,
    slip_reference,
)
from tactbench.core.recording.health import Finding, marking
from tactbench.core.recording.reader import Recording, open_recording
from tactbench.core.samples import Answers, FloatArray, IntArray, Part, StreamData, StreamReadings
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.recording import INCOMPLETE, RecordingMeta
from tactbench.core.spec.task import ChannelTarget, LabelTarget, TaskSpec, VectorTarget

Mask = npt.NDArray[np.bool_]
MUCH = 0.05
"""Smallest share of rows left out that is reported beside the score."""
MOST_NAMED = 4
"""Largest number of left-out recordings that a finding names."""
_SPACES = re.compile(r"(?<!\d)\s+|\s+(?!\d)")
"""Spaces, except those between digits, so that the labels '1 12' and '11 2' remain different."""
LARGEST = 1e100
"""Largest size of a reading or target, in any unit: the squares of a billion such numbers still sum to a finite one."""


@dataclass(frozen=True)
class Table:
    """One recording as rows on the clock of its features, without the rows in which a feature is missing."""

    meta: RecordingMeta
    X: FloatArray
    """(n, features) readings, in the recorded units"""
    y: npt.NDArray[Any]
    """(n,) numbers in the task's unit, (n, components) of a vector target, or (n,) class indices; meaningless where
    `labelled` is False"""
    labelled: npt.NDArray[np.bool_]
    """(n,) True where the recording has a label for the row"""
    force: FloatArray | None
    """(n,) reference force, NaN where it has no sample; None without a reference force"""
    time_s: FloatArray
    """(n,) seconds since the first sample, or row indices if the recording has no clock"""
    row: IntArray
    """(n,) index of each row in the recorded stream"""
    rows: int
    """Number of rows in the recorded stream, with those left out here"""
    groups: Mapping[str, npt.NDArray[np.str_]]
    """(n,) labels of the rows by name, by which a split can keep rows together"""
    readings: tuple[StreamReadings, ...] = ()
    """Each stream on its own clock, times in s since the table's first row; only for tasks on summaries or frames"""
    reference: SlipReference | None = None
    """Slip measured by the reference sensor, on that sensor's clock; only for slip tasks"""

    def taken(self, rows: slice | IntArray | Mask) -> Table:
        """Return a table of the selected rows only."""
        columns = {name: getattr(self, name) for name in ("X", "y", "labelled", "force", "time_s", "row")}
        kept: dict[str, Any] = {name: None if one is None else one[rows] for name, one in columns.items()}
        return replace(self, **kept, groups={name: one[rows] for name, one in self.groups.items()})

    @property
    def slip(self) -> SlipReference:
        """The slip measured by the reference sensor; only for slip tasks."""
        assert self.reference is not None
        return self.reference


@dataclass(frozen=True)
class Dataset:
    """All recordings that a cell is evaluated on, as tables with the same features."""

    tables: tuple[Table, ...]
    features: tuple[str, ...]
    classes: tuple[Any, ...]
    """Class labels in order of their index; empty for regression"""
    counts: Mapping[str, int] = field(default_factory=dict)
    """Counts of recordings, rows and samples that were left out or flagged, by reason"""
    findings: tuple[str, ...] = ()
    """Texts on faults in the recordings that may affect a score, and on data left out"""
    paths: tuple[Path, ...] = ()
    """Files that the tables were read from, in the same order"""
    whole: bool = False
    """True if the task has one answer for each recording or frame, so that no split may cut a recording"""

    @property
    def labelled(self) -> Mask:
        """(rows,) True for a row with a label; rows of all recordings, one recording after the other."""
        return self.column(lambda table: table.labelled)

    @property
    def recording(self) -> IntArray:
        """(rows,) index of the recording to which each row belongs."""
        return np.repeat(np.arange(len(self.tables)), [len(table.row) for table in self.tables])

    def column(self, of: Callable[[Table], Any], rows: Mask | None = None) -> npt.NDArray[Any]:
        """Return (n, …) values of all rows, or of those in a mask; `of` gives one value per recording or per row."""
        masks: Sequence[Any] = [...] * len(self.tables) if rows is None else self.parted(rows)
        found = []
        for table, mask in zip(self.tables, masks, strict=True):
            value = of(table)
            found.append(np.broadcast_to(value, (len(table.row), *np.shape(value)[1:]))[mask])
        return np.concatenate(found)

    def parted(self, column: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
        """Return the (rows, …) values of all rows as a list of arrays, one array for each recording."""
        return np.split(column, np.cumsum([len(table.row) for table in self.tables])[:-1])

    @property
    def metas(self) -> tuple[RecordingMeta, ...]:
        """Metadata of each recording, in the order of the tables."""
        return tuple(table.meta for table in self.tables)


def at_rows(data: Dataset, column: npt.NDArray[Any], rows: Part | Answers) -> npt.NDArray[Any]:
    """Return the (m, …) values at the m rows of a training, validation or test set, from (n, …) values of all rows."""
    found, columns = np.empty((len(rows), *column.shape[1:]), dtype=column.dtype), data.parted(column)
    for place in np.unique(rows.recording):
        mine = rows.recording == place
        found[mine] = columns[place][np.searchsorted(data.tables[place].row, rows.row[mine])]
    return found


def thinned(data: Dataset, every: int) -> Dataset:
    """Return the first and then each `every`-th row of each recording, as from a sensor with a lower sampling rate."""
    return replace(data, tables=tuple(table.taken(slice(None, None, every)) for table in data.tables))


def load_dataset(task: TaskSpec, recordings: Sequence[Path], *, include_incomplete: bool = False) -> Dataset:
    """Read the features, targets and group labels that `task` needs from `recordings`.

    Parameters
    ----------
    include_incomplete
        True to read also recordings that miss more samples than their rig file allows.

    Raises
    ------
    NotApplicable
        If the sensor has no channel of a kind that the task needs, or no recording has the task's target.
    DataError
        If a channel has no sample at all, the recordings are of several sensors or differ in their channels, a
        recording is given twice, or no recording is left.
    """
    counts: Counter[str] = Counter()
    incomplete: Counter[str] = Counter()
    seen: dict[str, dict[str, str]] = {}
    tables: list[Table] = []
    paths: list[Path] = []
    features: tuple[str, ...] = ()
    for path in recordings:
        with open_recording(path) as recording:
            excluded = recording.meta.excluded
            taken = include_incomplete and excluded.startswith(INCOMPLETE)
            if excluded.startswith(INCOMPLETE):
                incomplete[f"recordings {'take part although' if taken else 'left out:'} {excluded}"] += 1
            if excluded and not taken:
                counts[f"recordings left out ({excluded})"] += 1
                continue
            names, table = _read(recording, task, counts)
            for one in _bearing(recording, task, names):
                seen.setdefault(one.check, {}).setdefault(recording.meta.name, one.message)
        meta, first = table.meta, (tables or [table])[0].meta
        if tables and (meta.sensor.name, names) != (first.sensor.name, features):
            raise DataError(
                f"The recordings {first.name!r} of {first.sensor.name} and {meta.name!r} of {meta.sensor.name} differ "
                "in their sensor or its channels.",
                hint="Evaluate the recordings of each sensor separately.",
            )
        if any(one.meta.name == meta.name and np.array_equal(one.X, table.X, equal_nan=True) for one in tables):
            raise DataError(f"The recording {meta.name!r} is given twice, also as {path}.", hint="Leave one file out.")
        features = names
        tables.append(table)
        paths.append(path)
    if not tables:
        why = ", ".join(f"{number} {what}" for what, number in counts.items())
        raise DataError(
            f"No recording is left to evaluate{f': {why}' if why else ''}.",
            hint="List the reasons with `tactbench inspect`, or add --include-incomplete for incomplete recordings.",
        )
    target, labelled = _target_name(task), np.concatenate([table.labelled for table in tables])
    if not labelled.any():
        raise NotApplicable(
            f"No recording has any {target}, which task {task.name!r} asks for.",
            hint="State this target in the mapping, correct the times of its stream, or choose another task.",
        )
    if not labelled.all():
        counts[f"of {len(labelled)} rows have no {target} and were left out"] = int((~labelled).sum())
    classes: tuple[Any, ...] = ()
    if task.kind == "classification" and task.answer_per != "frame":
        found = {value for table in tables for value in np.unique(table.y[table.labelled]).tolist()}
        classes = tuple(sorted(found, key=lambda value: (isinstance(value, str), value)))
        index = {label: place for place, label in enumerate(classes)}
        tables = [replace(one, y=np.array([index.get(value, -1) for value in one.y.tolist()])) for one in tables]
    whole = task.answer_per != "sample"
    if whole:
        tables = [_whole(table, task, target) for table in tables]
    findings = [f"{n} of {len(recordings)} {what}" for what, n in incomplete.items()]
    findings += [*_in_some(seen, len(tables)), *_left_out(tables, task, target), *alike("classes", classes)]
    return Dataset(tuple(tables), features, classes, dict(counts), tuple(findings), tuple(paths), whole)


def _bearing(recording: Recording, task: TaskSpec, features: Sequence[str]) -> list[Finding]:
    """Return the findings in a recording, except findings about streams and channels that `task` does not use."""
    streams = {*feature_streams(recording, task), *(stream.name for stream in recording.meta.reference)}
    channels = {*features, *(channel.name for stream in recording.meta.reference for channel in stream.channels)}
    return [
        one
        for one in marking(recording)
        if (not one.channels or channels & set(one.channels))
        and (not one.stream or any(name in one.stream for name in streams))  # it may name several
    ]


def _in_some(seen: Mapping[str, Mapping[str, str]], n: int) -> Iterator[str]:
    """Yield one text for each check: its message, and how many of `n` recordings have it.

    `seen` maps the name of a check to messages by the name of the recording.
    """
    for by_name in seen.values():
        (name, message), *_ = by_name.items()
        such = f", such as {name}" if len(set(by_name.values())) > 1 else ""
        yield f"in {len(by_name)} of {n} recordings{such}: {message}"


def _left_out(tables: Sequence[Table], task: TaskSpec, target: str) -> Iterator[str]:
    """Yield texts on recordings without a labelled row, and on rows (5 % or more) left out for missing samples."""
    out = [table for table in tables if not table.labelled.any()]
    if out:
        names = ", ".join(one.meta.name for one in out[:MOST_NAMED]) + (", …" if len(out) > MOST_NAMED else "")
        yield f"{len(out)} of {len(tables)} recordings left out, without any {target}: {names}"
    there = [table for table in tables if table.labelled.any()]
    rows, labelled = sum(table.rows for table in there), np.concatenate([table.labelled for table in there])
    missing = {
        "a sample of each channel": rows - len(labelled),
        f"a {target}": int((~labelled).sum()) if _channels_of(task) else 0,
    }
    if sum(missing.values()) >= MUCH * rows:
        why = " and ".join(f"{count} without {what}" for what, count in missing.items() if count)
        yield f"{sum(missing.values()) / rows:.0%} of {rows} rows left out: {why}"


def alike(what: str, labels: Iterable[Any]) -> Iterator[str]:
    """Yield a text for each set of labels that differ by case or spaces alone, and so are probably the same label."""
    by_letters: dict[str, list[str]] = {}
    for label in labels:
        by_letters.setdefault(_SPACES.sub("", str(label).casefold()), []).append(repr(label))
    yield from (f"{what} {', '.join(some)} differ by case or spaces alone" for some in by_letters.values() if some[1:])


def _whole(table: Table, task: TaskSpec, target: str) -> Table:
    """Return a recording with only those group labels that are constant in it, so that no split can cut it.

    If the task has one answer per recording, a changing label is refused.
    """
    if task.answer_per == "recording" and len(np.unique(table.y[table.labelled])) > 1:
        raise NotApplicable(
            f"Task {task.name!r} has one answer per recording, but {target} changes within {table.meta.name!r}.",
            hint="Cut recordings where it changes (`recording` in the mapping), or choose a task on single samples.",
        )
    constant = {name: column for name, column in table.groups.items() if len(np.unique(column)) < 2}
    return replace(table, groups=constant)


def _read(recording: Recording, task: TaskSpec, counts: Counter[str]) -> tuple[tuple[str, ...], Table]:
    """Return the names of a recording's features, and its table; `y` of a classification holds labels, not indices."""
    meta = recording.meta
    streams = [recording.read(name) for name in feature_streams(recording, task)]
    clock = streams[0]
    for stream in streams:
        require_forward(stream, meta.name)
    if not len(clock.data):
        raise DataError(f"The recording {meta.name!r} has no samples.", hint="Record it again.")
    columns: dict[str, FloatArray] = {}
    own: list[StreamReadings] = []
    for stream in streams:
        picked = [place for place, channel in enumerate(stream.spec.channels) if channel.kind in task.looks_at]
        values = numbers(stream)[:, picked]
        if task.summaries:
            own.append(_own_readings(stream, clock, picked, values, counts))
        names = [stream.spec.channels[place].name for place in picked]
        columns |= dict(zip(names, on_clock(values, stream, clock, meta.name).T, strict=True))
    X = np.column_stack(list(columns.values()))
    empty = [name for name, column in columns.items() if np.isnan(column).all()]
    if empty:
        raise DataError(
            f"In recording {meta.name!r}, {', '.join(empty)} has no sample at all.",
            hint="Leave the channel out of the mapping, or record it again.",
        )
    y, labelled = _target(recording, task, clock)
    for name, column in (columns | ({"the target": y} if task.kind == "regression" else {})).items():
        require_computable(column, name, meta)
    force = y if isinstance(task.target, ChannelTarget) and task.target.kind == "force" else None
    found = channels_for(recording, ChannelTarget(kind="force"))
    if force is None and len(found) == 1:
        force = read_channel(recording, clock, found[0])
    reference = None
    if isinstance(task.target, SlipTarget):
        reference = slip_reference(recording, task.target, 0 if clock.t_ns is None else int(clock.t_ns[0]), counts)
    whole = np.asarray(~np.isnan(X).any(axis=1))
    if not whole.all():
        counts["rows left out because a channel has no sample"] += int((~whole).sum())
    row = np.arange(len(X), dtype=np.int64)
    time_s = (clock.t_ns - clock.t_ns[0]) * 1e-9 if clock.t_ns is not None else row.astype(np.float64)
    table = Table(
        meta=meta,
        X=X,
        y=y,
        labelled=labelled,
        force=force,
        time_s=time_s,
        row=row,
        rows=len(row),
        groups=_groups(meta, clock, task),
        readings=tuple(own),
        reference=reference,
    )
    return tuple(columns), table.taken(whole)


def require_computable(values: FloatArray, name: str, meta: RecordingMeta) -> None:
    """Raise DataError if a number, in an array of any shape, is so large that sums of squares overflow; ignore NaN."""
    largest = float(np.max(np.abs(values), initial=0.0, where=~np.isnan(values)))
    if largest > LARGEST:
        raise DataError(
            f"In recording {meta.name!r}, {name} reaches {largest:.3g}; at most {LARGEST:g} is allowed.",
            hint="If this number means a missing sample, state it under `sentinels` in the mapping.",
        )


def _own_readings(
    stream: StreamData, clock: StreamData, picked: Sequence[int], values: FloatArray, counts: Counter[str]
) -> StreamReadings:
    """Return the `picked` columns of one stream at its own times, in seconds since the first row of `clock`."""
    whole = ~np.isnan(values).any(axis=1)
    if stream is not clock and not whole.all():
        counts[f"rows of {stream.spec.name} left out because a channel has no sample"] += int((~whole).sum())
    time_s = (stream.t_ns - clock.t_ns[0]) * 1e-9 if stream.t_ns is not None and clock.t_ns is not None else None
    step_s = float(np.median(np.diff(time_s))) if time_s is not None and len(time_s) > 1 else 0.0
    channels = [stream.spec.channels[place] for place in picked]
    return StreamReadings(
        stream=stream.spec.name,
        channels=tuple(channel.name for channel in channels),
        kinds=tuple(channel.kind for channel in channels),
        data=values[whole],
        time_s=None if time_s is None else time_s[whole],
        rate_hz=1.0 / step_s if step_s > 0 else stream.spec.rate_hz,
    )


Labels = tuple[npt.NDArray[Any], npt.NDArray[np.bool_]]
"""(n,) or (n, components) targets of rows, and an (n,) mask, True where a row has a target."""


def _target(recording: Recording, task: TaskSpec, features: StreamData) -> Labels:
    if isinstance(task.target, LabelTarget):
        found = _label(recording.meta, task.target.name, features)
        return found if task.kind == "classification" else _as_numbers(found, task.target.name, recording.meta.name)
    if isinstance(task.target, SlipTarget):  # of frames, which are made of the recording later
        return np.zeros(len(features.data)), np.ones(len(features.data), dtype=bool)
    targets = _channels_of(task)
    y = np.column_stack([channel_on(recording, one, features) for one in targets])
    labelled = np.asarray(~np.isnan(y).any(axis=1))
    return (y if isinstance(task.target, VectorTarget) else y[:, 0]), labelled


def _channels_of(task: TaskSpec) -> tuple[ChannelTarget, ...]:
    """Return the target channels of a task; an empty tuple if the target is a label or slip."""
    if isinstance(task.target, VectorTarget):
        return task.target.components
    return (task.target,) if isinstance(task.target, ChannelTarget) else ()


def _as_numbers(found: Labels, name: str, recording: str) -> Labels:
    """Return labels converted from texts, as a mapping gives them, to numbers; NaN where a row has no label."""
    values, there = found
    numbers = np.full(len(values), np.nan)
    try:
        numbers[there] = values[there].astype(np.float64)
    except ValueError as error:
        raise DataError(
            f"In recording {recording!r}, a label {name!r} is not a number: {error}.",
            hint="Choose a classification task, or correct the label in the mapping.",
        ) from error
    return numbers, there


def _label(meta: RecordingMeta, name: str, features: StreamData) -> Labels:
    n = len(features.data)
    if name in meta.labels:
        return np.full(n, meta.labels[name]), np.ones(n, dtype=bool)
    if name in features.annotations:
        column = features.annotations[name]
        return column, np.asarray(column != "") if column.dtype.kind == "U" else np.ones(n, dtype=bool)
    return np.full(n, ""), np.zeros(n, dtype=bool)


def _groups(meta: RecordingMeta, data: StreamData, task: TaskSpec) -> dict[str, npt.NDArray[np.str_]]:
    """Return (n,) labels of the rows by name, by which a split can keep rows together, without the task's target."""
    n = len(data.data)
    constant = {
        "session": meta.session,
        "recording": meta.name,
        **({"unit": meta.scene.unit} if meta.scene is not None else {}),
        **{key: str(value) for key, value in meta.labels.items()},
    }
    if meta.trial:
        constant["trial"] = meta.trial
    groups = {name: np.full(n, value) for name, value in constant.items()}
    # Numbers of presses count within their session.
    for name, column in data.annotations.items():
        own = column.dtype.kind in "iu"
        groups[name] = np.array([f"{meta.session}/{value}" if own else str(value) for value in column], dtype=np.str_)
    if not isinstance(task.target, SlipTarget | VectorTarget):
        groups.pop(task.target.name or "", None)
    return groups


def _target_name(task: TaskSpec) -> str:
    if isinstance(task.target, SlipTarget):
        return "slip of the reference"
    if isinstance(task.target, LabelTarget):
        return f"label {task.target.name!r}"
    names = [repr(one.name) for one in _channels_of(task) if one.name]
    return f"{task.target.kind} sample" + (f" called {' and '.join(names)}" if names else "")
