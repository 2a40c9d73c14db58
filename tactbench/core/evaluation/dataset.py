"""Recordings as tables: features, targets and groups of each on one clock."""

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
    channel_on,
    channels_for,
    feature_streams,
    never_meeting,
    numbers,
    on_clock,
    read_channel,
    require_forward,
)
from tactbench.core.evaluation.slip_reference import SlipReference, slip_reference
from tactbench.core.recording.completeness import INCOMPLETE
from tactbench.core.recording.health import Finding, marking
from tactbench.core.recording.reader import Recording, open_recording
from tactbench.core.samples import Answers, FloatArray, IntArray, Part, Quality, StreamData, StreamReadings
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.task import ChannelTarget, LabelTarget, TaskSpec, VectorTarget

Mask = npt.NDArray[np.bool_]
MUCH = 0.05
"""Share of the rows left out from which on it stands beside the score."""
MOST_NAMED = 4
"""Recordings left out that are named."""
_SPACES = re.compile(r"(?<!\d)\s+|\s+(?!\d)")
"""Spaces, but for those between digits: '1 12' and '11 2' are two."""
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
    rows: int
    """of its stream, left out or not"""
    groups: Mapping[str, npt.NDArray[np.str_]]
    """Labels by which rows can be kept together: name -> (n,)"""
    readings: tuple[StreamReadings, ...] = ()
    """Every stream on its own clock, times from the first row on; read for tasks of summaries or frames"""
    reference: SlipReference | None = None
    """Slip by the reference, on its own clock; read for tasks of slip"""
    apart: str = ""
    """Spans of the samples of features and target, if these never meet"""

    def taken(self, rows: slice | IntArray | Mask) -> Table:
        """Return some of its rows."""
        columns = {name: getattr(self, name) for name in ("X", "y", "labelled", "force", "time_s", "row")}
        kept: dict[str, Any] = {name: None if one is None else one[rows] for name, one in columns.items()}
        return replace(self, **kept, groups={name: one[rows] for name, one in self.groups.items()})

    @property
    def slip(self) -> SlipReference:
        """The reference of a task of slip."""
        assert self.reference is not None
        return self.reference


@dataclass(frozen=True)
class Dataset:
    """All recordings of a cell."""

    tables: tuple[Table, ...]
    features: tuple[str, ...]
    classes: tuple[Any, ...]
    """Class labels in order of their index; empty for regression"""
    counts: Mapping[str, int] = field(default_factory=dict)
    """Counts of what was left out, by reason"""
    findings: tuple[str, ...] = ()
    """Findings in the recordings that bear on a score, and data that take no part"""
    paths: tuple[Path, ...] = ()
    """The files of the tables"""
    whole: bool = False
    """Each recording has one answer: no split may cut it"""
    vote: bool = False
    """That answer is combined from those of the recording's rows"""

    @property
    def labelled(self) -> Mask:
        """(rows,) whether a row has a label, of all recordings one after the other."""
        return self.column(lambda table: table.labelled)

    @property
    def recording(self) -> IntArray:
        """(rows,) the recording of each row."""
        return np.repeat(np.arange(len(self.tables)), [len(table.row) for table in self.tables])

    def column(self, of: Callable[[Table], Any], rows: Mask | None = None) -> npt.NDArray[Any]:
        """Return (n, …) values of all rows, or of some: `of` gives one value for each recording, or for each row."""
        masks: Sequence[Any] = [...] * len(self.tables) if rows is None else self.parted(rows)
        found = []
        for table, mask in zip(self.tables, masks, strict=True):
            value = of(table)
            found.append(np.broadcast_to(value, (len(table.row), *np.shape(value)[1:]))[mask])
        return np.concatenate(found)

    def parted(self, column: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
        """Return values of all rows recording by recording."""
        return np.split(column, np.cumsum([len(table.row) for table in self.tables])[:-1])

    @property
    def metas(self) -> tuple[RecordingMeta, ...]:
        """The recordings' metadata, in order."""
        return tuple(table.meta for table in self.tables)


def at_rows(data: Dataset, column: npt.NDArray[Any], rows: Part | Answers) -> npt.NDArray[Any]:
    """Return (m, …) values at the rows of a set, of (n, …) values of all rows."""
    found, columns = np.empty((len(rows), *column.shape[1:]), dtype=column.dtype), data.parted(column)
    for place in np.unique(rows.recording):
        mine = rows.recording == place
        found[mine] = columns[place][np.searchsorted(data.tables[place].row, rows.row[mine])]
    return found


def thinned(data: Dataset, every: int) -> Dataset:
    """Return every `every`-th row of each recording from its first, as a sensor so many times slower gives them."""
    return replace(data, tables=tuple(table.taken(slice(None, None, every)) for table in data.tables))


def load_dataset(task: TaskSpec, recordings: Sequence[Path], *, include_incomplete: bool = False) -> Dataset:
    """Read `recordings` as `task` needs them.

    Parameters
    ----------
    include_incomplete
        Whether recordings take part that miss more than their rig file allows.

    Raises
    ------
    NotApplicable
        If the sensor has no channel of a kind the task needs, or no recording has the label it asks for.
    DataError
        If a channel has no sample at all, the recordings are of several sensors or disagree about their channels, one
        is given twice, or nothing is left.
    """
    counts: Counter[str] = Counter()
    seen: dict[str, dict[str, str]] = {}
    tables: list[Table] = []
    paths: list[Path] = []
    features: tuple[str, ...] = ()
    for path in recordings:
        with open_recording(path) as recording:
            excluded = recording.meta.excluded
            if excluded and not (include_incomplete and excluded.startswith(INCOMPLETE)):
                counts[f"recordings left out ({excluded})"] += 1
                continue
            names, table = _read(recording, task, counts)
            for one in _bearing(recording, task, names):
                seen.setdefault(one.check, {}).setdefault(recording.meta.name, one.message)
        meta, first = table.meta, (tables or [table])[0].meta
        if tables and (meta.sensor.name, names) != (first.sensor.name, features):
            raise DataError(
                f"The recordings {first.name!r} of {first.sensor.name} and {meta.name!r} of {meta.sensor.name} are not "
                "of one sensor with the same channels.",
                hint="Evaluate them apart.",
            )
        if any(one.meta.name == meta.name and np.array_equal(one.X, table.X, equal_nan=True) for one in tables):
            raise DataError(f"The recording {meta.name!r} is given twice: {path} holds it too.", hint="Leave one out.")
        features = names
        tables.append(table)
        paths.append(path)
    if not tables:
        why = ", ".join(f"{number} {what}" for what, number in counts.items())
        raise DataError(
            f"No recording is left to evaluate{f': {why}' if why else ''}.",
            hint="See what was left out with `tactbench inspect`; --include-incomplete takes incomplete ones.",
        )
    target, labelled = _target_name(task), np.concatenate([table.labelled for table in tables])
    if not labelled.any():
        apart = next((one for one in tables if one.apart), None)
        if apart is not None:
            raise DataError(
                f"No reading of any recording is near a {target} in time: in {apart.meta.name!r}, {apart.apart}.",
                hint="Put both on one clock: is one of them in another time zone, or does it count from another start?",
            )
        raise NotApplicable(
            f"No recording has any {target}, which task {task.name!r} asks for.",
            hint="State it in the mapping, or choose another task.",
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
    findings = (*_in_some(seen, len(tables)), *_left_out(tables, task, target), *alike("classes", classes))
    return Dataset(tuple(tables), features, classes, dict(counts), findings, tuple(paths), whole, bool(task.vote))


def _bearing(recording: Recording, task: TaskSpec, features: Sequence[str]) -> list[Finding]:
    """Return the findings in a recording, without those of streams and channels that `task` does not look at."""
    streams = {*feature_streams(recording, task), *(stream.name for stream in recording.meta.reference)}
    channels = {*features, *(channel.name for stream in recording.meta.reference for channel in stream.channels)}
    return [
        one
        for one in marking(recording)
        if (not one.channels or channels & set(one.channels))
        and (not one.stream or any(name in one.stream for name in streams))  # it may name several
    ]


def _in_some(seen: Mapping[str, Mapping[str, str]], n: int) -> Iterator[str]:
    """Yield the finding of each check, and in how many of `n` recordings; `seen` has messages by check, recording."""
    for by_name in seen.values():
        (name, message), *_ = by_name.items()
        such = f", such as {name}" if len(set(by_name.values())) > 1 else ""
        yield f"in {len(by_name)} of {n} recordings{such}: {message}"


def _left_out(tables: Sequence[Table], task: TaskSpec, target: str) -> Iterator[str]:
    """Yield the recordings without a usable row, and the share of unusable rows of the others.

    A missing label is no lost row: it was left out on purpose.
    """
    out = [table for table in tables if not table.labelled.any()]
    if out:
        names = ", ".join(one.meta.name for one in out[:MOST_NAMED]) + (", …" if len(out) > MOST_NAMED else "")
        apart = next((f" ({one.meta.name}: {one.apart})" for one in out if one.apart), "")
        yield f"{len(out)} of {len(tables)} recordings left out, without any {target}: {names}{apart}"
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
    """Yield labels that differ by case or spaces alone: they are probably one."""
    by_letters: dict[str, list[str]] = {}
    for label in labels:
        by_letters.setdefault(_SPACES.sub("", str(label).casefold()), []).append(repr(label))
    yield from (f"{what} {', '.join(some)} differ by case or spaces alone" for some in by_letters.values() if some[1:])


def _whole(table: Table, task: TaskSpec, target: str) -> Table:
    """Return a recording that no group cuts, its target, if that is a channel, reduced to one number.

    Where it is to have one answer, one whose answer changes is refused.
    """
    there = table.y[table.labelled]
    if task.answer_per == "recording" and isinstance(task.target, ChannelTarget) and len(there):
        number = there.max() if task.target.reduce == "max" else there.mean()
        table = replace(table, y=np.full(len(table.y), number), labelled=np.ones(len(table.y), dtype=bool))
    elif task.answer_per == "recording" and len(np.unique(there)) > 1:
        raise NotApplicable(
            f"Task {task.name!r} asks one answer of each recording, and {target} changes within {table.meta.name!r}.",
            hint="Cut the recordings where it changes (`recording` in the mapping), or ask a task of single samples.",
        )
    constant = {name: column for name, column in table.groups.items() if len(np.unique(column)) < 2}
    return replace(table, groups=constant)


def _read(recording: Recording, task: TaskSpec, counts: Counter[str]) -> tuple[tuple[str, ...], Table]:
    """Return the names of a recording's features, and its rows; of a classification `y` are the labels themselves."""
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
        _count_flags(stream, picked, counts)
        if task.summaries or task.features_by:
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
    targets = [] if labelled.any() else _channels_of(task)
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
    for name, column in columns.items():
        if np.isnan(column).any():
            counts[f"rows left out because {name} has no sample"] += int(np.isnan(column).sum())
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
        apart=next(filter(None, (never_meeting(recording, one, clock) for one in targets)), ""),
    )
    return tuple(columns), table.taken(whole)


def require_computable(values: FloatArray, name: str, meta: RecordingMeta) -> None:
    """Raise DataError for numbers of any shape whose squares cannot be summed; NaN is none."""
    largest = float(np.max(np.abs(values), initial=0.0, where=~np.isnan(values)))
    if largest > LARGEST:
        raise DataError(
            f"In recording {meta.name!r}, {name} reaches {largest:.3g}, which cannot be computed with.",
            hint="Is it a fill value? State it under `sentinels` in the mapping, or mark it as missing.",
        )


def _count_flags(stream: StreamData, picked: Sequence[int], counts: Counter[str]) -> None:
    """Count the samples and rows that are kept although they are flagged."""
    if stream.quality is None:
        return
    quality = stream.quality[:, picked]
    for flag in (Quality.SATURATED, Quality.SUSPECT):
        flagged = int(np.count_nonzero(quality & flag))
        if flagged:
            counts[f"{str(flag.name).lower()} samples kept"] += flagged
    after_gap = int(np.count_nonzero((quality & Quality.GAP).any(axis=1)))
    if after_gap:
        counts[f"rows of {stream.spec.name} kept, before which others were lost"] += after_gap


def _own_readings(
    stream: StreamData, clock: StreamData, picked: Sequence[int], values: FloatArray, counts: Counter[str]
) -> StreamReadings:
    """Return one stream's features on its own clock, in seconds since the first row of `clock`."""
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
"""Targets, and a mask of those that are there."""


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
    """Return the target channels of a task; none where its target is a label or slip."""
    if isinstance(task.target, VectorTarget):
        return task.target.components
    return (task.target,) if isinstance(task.target, ChannelTarget) else ()


def _as_numbers(found: Labels, name: str, recording: str) -> Labels:
    """Return labels, which a mapping gives as texts, as numbers."""
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


def _label(meta: RecordingMeta, name: str, features: StreamData) -> Labels:
    n = len(features.data)
    if name in meta.labels:
        return np.full(n, meta.labels[name]), np.ones(n, dtype=bool)
    if name in features.annotations:
        column = features.annotations[name]
        return column, np.asarray(column != "") if column.dtype.kind == "U" else np.ones(n, dtype=bool)
    return np.full(n, ""), np.zeros(n, dtype=bool)


def _groups(meta: RecordingMeta, data: StreamData, task: TaskSpec) -> dict[str, npt.NDArray[np.str_]]:
    """Return labels by which rows can be kept together; the target is none of them."""
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
    if isinstance(task.target, VectorTarget):
        return f"{task.target.kind} samples called {' and '.join(map(repr, task.target.names))}"
    return f"{task.target.kind} sample" + (f" called {task.target.name!r}" if task.target.name else "")
