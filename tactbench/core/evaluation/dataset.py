"""Recordings on one clock each, with what the task asks of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.alignment import require_forward
from tactbench.core.evaluation.channels import (
    channel_on,
    channels_for,
    feature_streams,
    features_on,
    on_clock,
    own_readings,
)
from tactbench.core.evaluation.slip_reference import SlipReference, slip_reference
from tactbench.core.recording.reader import Recording, open_recording
from tactbench.core.samples import FloatArray, IntArray, StreamData, StreamReadings
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.task import ChannelTarget, LabelTarget, TaskSpec, VectorTarget

LARGEST = 1e100
"""Of a reading or a target, in whatever unit: sums of the squares of a billion of them are still numbers."""


@dataclass(frozen=True)
class Table:
    """One recording on the clock of its features. Rows with a missing feature are not in it."""

    meta: RecordingMeta
    X: FloatArray
    """(n, features) readings as recorded"""
    y: npt.NDArray[Any]
    """(n,) numbers in the task's unit, (n, components) where it asks for a vector, or class indices; meaningless where
    `labelled` is False"""
    labelled: npt.NDArray[np.bool_]
    """(n,) False where the recording has no label for the row"""
    force: FloatArray | None
    """(n,) reference force, if there is one; NaN where it has no sample"""
    time_s: FloatArray
    """(n,) seconds since the first sample, or the row index where the recording has no clock"""
    row: IntArray
    """(n,) index of the row in its stream"""
    groups: Mapping[str, npt.NDArray[np.str_]]
    """Labels by which rows can be kept together: name -> (n,)"""
    readings: tuple[StreamReadings, ...] = ()
    """Every stream on its own clock, times from the first row on; read where a task summarises recordings or frames"""
    reference: SlipReference | None = None
    """What the reference says about slip, on its own clock; read where a task asks for it"""


@dataclass(frozen=True)
class Dataset:
    """All recordings of a cell."""

    tables: tuple[Table, ...]
    features: tuple[str, ...]
    classes: tuple[Any, ...]
    """Class labels in order of their index; empty for regression"""
    counts: Mapping[str, int] = field(default_factory=dict)
    """What was left out, and why"""
    paths: tuple[Path, ...] = ()
    """The files of the tables"""
    stamps: tuple[str, ...] = ()
    """What a reader of a score must know of the recordings"""
    whole: bool = False
    """Each recording has one answer: no split may cut it"""
    vote: bool = False
    """That answer is combined from those of the recording's rows"""

    @property
    def metas(self) -> tuple[RecordingMeta, ...]:
        """What the recordings say about themselves, in order."""
        return tuple(table.meta for table in self.tables)


def load_dataset(task: TaskSpec, recordings: Sequence[Path]) -> Dataset:
    """Read `recordings` as `task` needs them.

    Raises
    ------
    NotApplicable
        If the sensor has no channel of a kind the task needs, or no recording has the label it asks for.
    DataError
        If a channel has no sample at all, the recordings disagree about their channels, or nothing is left.
    """
    counts: Counter[str] = Counter()
    repeated: dict[str, int] = {}
    read: list[tuple[RecordingMeta, _Raw]] = []
    used: list[Path] = []
    for path in recordings:
        with open_recording(path) as recording:
            if recording.meta.excluded:
                counts[f"recordings left out ({recording.meta.excluded})"] += 1
                continue
            read.append((recording.meta, _read(recording, task, counts, repeated)))
            used.append(path)
    if not read:
        raise DataError("No recording is left to evaluate.", hint="See what was left out with `tactbench inspect`.")
    _same_features([(meta, raw.features) for meta, raw in read])
    framed = task.answer_per == "frame"
    classes = _classes([raw for _, raw in read]) if task.kind == "classification" and not framed else ()
    if not any(raw.labelled.any() for _, raw in read):
        raise NotApplicable(
            f"Task {task.name!r} asks for {_target_name(task)}, and no recording has it.",
            hint="State it in the mapping, or choose another task.",
        )
    tables = tuple(_table(meta, raw, classes) for meta, raw in read)
    unlabelled = sum(int((~table.labelled).sum()) for table in tables)
    if unlabelled:
        counts[f"of {sum(len(table.row) for table in tables)} rows have no {_target_name(task)} and were left out"] = (
            unlabelled
        )
    whole = task.answer_per != "sample"
    if whole:
        tables = tuple(_whole(_reduced(table, task), task) for table in tables)
    return Dataset(
        tables, read[0][1].features, classes, dict(counts), tuple(used), _clock_stamps(repeated), whole, bool(task.vote)
    )


def _reduced(table: Table, task: TaskSpec) -> Table:
    """Return a recording whose target, if it is a channel, is one number: reduced over the samples that are there."""
    if task.answer_per != "recording" or not isinstance(task.target, ChannelTarget) or not table.labelled.any():
        return table
    there = table.y[table.labelled]
    number = there.max() if task.target.reduce == "max" else there.mean()
    return replace(table, y=np.full(len(table.y), number), labelled=np.ones(len(table.y), dtype=bool))


def _whole(table: Table, task: TaskSpec) -> Table:
    """Return a recording that no group cuts; where it is to have one answer, one whose answer changes is refused."""
    if task.answer_per == "recording" and len(np.unique(table.y[table.labelled])) > 1:
        raise NotApplicable(
            f"Task {task.name!r} asks one answer of each recording, and {_target_name(task)} changes within "
            f"{table.meta.name!r}.",
            hint="Cut the recordings where it changes (`recording` in the mapping), or ask a task of single samples.",
        )
    constant = {name: column for name, column in table.groups.items() if len(np.unique(column)) < 2}
    return replace(table, groups=constant)


def _clock_stamps(repeated: Mapping[str, int]) -> tuple[str, ...]:
    if not repeated:
        return ()
    worst = max(repeated, key=lambda name: repeated[name])
    number = f"{len(repeated)} recording{'s' if len(repeated) > 1 else ''}"
    return (f"clock: times equal the one before in {number}, {repeated[worst]} times in {worst!r}.",)


@dataclass
class _Raw:
    features: tuple[str, ...]
    X: FloatArray
    y: npt.NDArray[Any]
    labelled: npt.NDArray[np.bool_]
    force: FloatArray | None
    time_s: FloatArray
    row: IntArray
    groups: dict[str, npt.NDArray[np.str_]]
    readings: tuple[StreamReadings, ...]
    reference: SlipReference | None


def _read(recording: Recording, task: TaskSpec, counts: Counter[str], repeated: dict[str, int]) -> _Raw:
    meta = recording.meta
    streams = [recording.read(name) for name in feature_streams(recording, task)]
    data = streams[0]
    again = max(require_forward(stream, meta.name) for stream in streams)
    if again:
        repeated[meta.name] = again
    columns = [features_on(meta, data, stream, task, counts) for stream in streams]
    names = tuple(name for some, _ in columns for name in some)
    X = np.hstack([block for _, block in columns])
    if len(X) == 0:
        raise DataError(f"The recording {meta.name!r} has no samples.", hint="Record it again.")
    empty = [name for name, column in zip(names, X.T, strict=True) if np.isnan(column).all()]
    if empty:
        raise DataError(
            f"In recording {meta.name!r}, {', '.join(empty)} has no sample at all.",
            hint="Leave the channel out of the mapping, or record it again.",
        )
    y, labelled = _target(recording, task, data)
    force = _force(recording, task, data, y)
    targets = [("the target", y)] if task.kind == "regression" else []
    for name, column in (*zip(names, X.T, strict=True), *targets):
        largest = float(np.max(np.abs(column), initial=0.0, where=~np.isnan(column)))
        if largest > LARGEST:
            raise DataError(
                f"In recording {meta.name!r}, {name} reaches {largest:.3g}, which cannot be computed with.",
                hint="Is it a fill value? State it under `sentinels` in the mapping, or mark it as missing.",
            )
    time_s = (data.t_ns - data.t_ns[0]) * 1e-9 if data.t_ns is not None else np.arange(len(X), dtype=np.float64)
    own: tuple[StreamReadings, ...] = ()
    if task.summaries or task.features_by:
        own = tuple(own_readings(data, stream, task, counts) for stream in streams)
    row = np.arange(len(X), dtype=np.int64)
    slip = None
    if isinstance(task.target, SlipTarget):
        slip = slip_reference(recording, task.target, 0 if data.t_ns is None else int(data.t_ns[0]), counts)
    raw = _Raw(names, X, y, labelled, force, time_s, row, _groups(meta, data, task), own, slip)
    whole = np.asarray(~np.isnan(X).any(axis=1))
    if not whole.all():
        for name, column in zip(names, X.T, strict=True):
            if np.isnan(column).any():
                counts[f"rows left out because {name} has no sample"] += int(np.isnan(column).sum())
        raw = _rows(raw, whole)
    return raw


def _rows(raw: _Raw, keep: npt.NDArray[np.bool_]) -> _Raw:
    return _Raw(
        raw.features, raw.X[keep], raw.y[keep], raw.labelled[keep], None if raw.force is None else raw.force[keep],
        raw.time_s[keep], raw.row[keep], {name: column[keep] for name, column in raw.groups.items()}, raw.readings,
        raw.reference,
    )  # fmt: skip


Labels = tuple[npt.NDArray[Any], npt.NDArray[np.bool_]]
"""Targets, and which of them are there."""


def _target(recording: Recording, task: TaskSpec, features: StreamData) -> Labels:
    if isinstance(task.target, LabelTarget):
        found = _label(recording.meta, task.target.name, features)
        return found if task.kind == "classification" else _as_numbers(found, task.target.name, recording.meta.name)
    if isinstance(task.target, SlipTarget):  # of frames, which are made of the recording later
        return np.zeros(len(features.data)), np.ones(len(features.data), dtype=bool)
    if isinstance(task.target, VectorTarget):
        return _vector(recording, task.target, features)
    column = channel_on(recording, task.target, features)
    if column is None:
        n = len(features.data)
        return np.full(n, np.nan), np.zeros(n, dtype=bool)
    return column, ~np.isnan(column)


def _as_numbers(found: Labels, name: str, recording: str) -> Labels:
    """Return labels as the numbers they say: a mapping's words are texts."""
    values, there = found
    numbers = np.full(len(values), np.nan)
    try:
        numbers[there] = values[there].astype(np.float64)
    except ValueError as error:
        raise DataError(
            f"In recording {recording!r}, a label {name!r} is no number: {error}.",
            hint="Ask for a class, or correct it in the mapping.",
        ) from error
    return numbers, there


def _vector(recording: Recording, target: VectorTarget, features: StreamData) -> Labels:
    missing = np.full(len(features.data), np.nan)
    found = [channel_on(recording, one, features) for one in target.components]
    vectors = np.column_stack([missing if one is None else one for one in found])
    return vectors, np.asarray(~np.isnan(vectors).any(axis=1))


def _label(meta: RecordingMeta, name: str, features: StreamData) -> Labels:
    n = len(features.data)
    if name in meta.labels:
        return np.full(n, meta.labels[name]), np.ones(n, dtype=bool)
    if name in features.annotations:
        column = features.annotations[name]
        return column, np.asarray(column != "") if column.dtype.kind == "U" else np.ones(n, dtype=bool)
    return np.full(n, ""), np.zeros(n, dtype=bool)


def _force(recording: Recording, task: TaskSpec, features: StreamData, y: npt.NDArray[Any]) -> FloatArray | None:
    """Return the reference force, in whatever unit: the target itself, or else the only force channel there is."""
    if isinstance(task.target, ChannelTarget) and task.target.kind == "force":
        return y
    found = channels_for(recording, ChannelTarget(kind="force"))
    return on_clock(recording, features, *found[0]) if len(found) == 1 else None


def _groups(meta: RecordingMeta, data: StreamData, task: TaskSpec) -> dict[str, npt.NDArray[np.str_]]:
    """Return labels by which rows can be kept together; the answer asked for is none of them."""
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
    # A number of a press counts within its session only.
    for name, column in data.annotations.items():
        own = column.dtype.kind in "iu"
        groups[name] = np.array([f"{meta.session}/{value}" if own else str(value) for value in column], dtype=np.str_)
    if not isinstance(task.target, SlipTarget | VectorTarget):
        groups.pop(task.target.name or "", None)
    return groups


def _same_features(read: Sequence[tuple[RecordingMeta, tuple[str, ...]]]) -> None:
    first, features = read[0]
    for meta, others in read:
        if others != features:
            raise DataError(
                f"The recordings {first.name!r} and {meta.name!r} have different channels.",
                hint="Evaluate them apart.",
            )


def _classes(read: Sequence[_Raw]) -> tuple[Any, ...]:
    found = {
        value.item() if hasattr(value, "item") else value for raw in read for value in np.unique(raw.y[raw.labelled])
    }
    return tuple(sorted(found, key=lambda value: (isinstance(value, str), value)))


def _table(meta: RecordingMeta, raw: _Raw, classes: tuple[Any, ...]) -> Table:
    y = raw.y
    if classes:
        index = {label: place for place, label in enumerate(classes)}
        y = np.array([index.get(value, -1) for value in raw.y.tolist()], dtype=np.int64)
    return Table(meta, raw.X, y, raw.labelled, raw.force, raw.time_s, raw.row, raw.groups, raw.readings, raw.reference)


def _target_name(task: TaskSpec) -> str:
    if isinstance(task.target, SlipTarget):
        return "slip of the reference"
    if isinstance(task.target, LabelTarget):
        return task.target.name
    if isinstance(task.target, VectorTarget):
        return f"{task.target.kind} samples called {' and '.join(map(repr, task.target.names))}"
    return f"{task.target.kind} sample" + (f" called {task.target.name!r}" if task.target.name else "")
