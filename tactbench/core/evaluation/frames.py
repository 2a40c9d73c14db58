"""Frames: windows that end at regular times, each made of every stream's own samples in it, and of none after it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tactbench.core.errors import DataError, NotApplicable, PluginContractError
from tactbench.core.evaluation.dataset import Dataset, Table, require_computable
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.sets import dropped_s
from tactbench.core.evaluation.summaries import columns_of, in_band, measured, tared_readings
from tactbench.core.events.labels import GROSS, UNDECIDED
from tactbench.core.plugins.registry import load_object
from tactbench.core.samples import FloatArray, IntArray, StreamReadings
from tactbench.core.spec.events import SlipTarget, nanoseconds
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.task import TaskSpec

STATES = ("stick", "incipient", "gross")
EVENT_CLASSES = ("no event", "event")

Features = tuple[tuple[str, ...], FloatArray]
"""Names, and (frames, features) numbers; NaN where a stream has no sample in the window."""


def framed(data: Dataset, task: TaskSpec, rules: ProtocolSpec, estimator: EstimatorDescriptor) -> Dataset:
    """Return each recording as frames, with the features that `estimator` looks at."""
    if rules.three_sigma or rules.discard_samples or rules.first_row_only:
        raise NotApplicable(
            f"Protocol {rules.name!r} drops single samples; task {task.name!r} looks at windows of consecutive ones.",
            hint="Use protocol `deployable`.",
        )
    counts = Counter(data.counts)
    compute = frame_features(task, rules, estimator)
    tables, names = zip(*(_framed(table, task, rules, compute, counts) for table in data.tables), strict=True)
    classes = EVENT_CLASSES if task.kind == "events" else STATES
    return replace(data, tables=tables, features=names[0], classes=classes, counts=dict(counts))


def frame_features(
    task: TaskSpec, rules: ProtocolSpec, estimator: EstimatorDescriptor
) -> Callable[[Table, IntArray], Features]:
    """Return what makes the features of all frames of one recording; a detector's own code is imported here."""
    target = slip_target(task)
    own = load_object(estimator.frames_by) if estimator.frames_by else None
    summaries = estimator.summaries or task.summaries

    def compute(table: Table, ends_ns: IntArray) -> Features:
        ends_s = np.asarray(ends_ns * 1e-9, dtype=np.float64)
        if estimator.looks_at == "reference":
            share = table.slip.at(ends_ns, table.slip.force_share)
            return ("tangential over friction times normal force",), share[:, None]
        if estimator.looks_at != "features":
            return (), np.zeros((len(ends_s), 0))
        streams = clocked(table, rules)
        if own is not None:
            return _own_features(own, estimator, fastest(streams), ends_s, target.window_s)
        names: list[str] = []
        columns: list[FloatArray] = []
        for stream in streams:
            asked = [summary for summary in summaries if columns_of(stream, summary)]
            bands = dict.fromkeys(summary.band_hz for summary in asked)
            filtered = {band: in_band(stream, band, table.meta.name) for band in bands}
            for summary in asked:
                picked = columns_of(stream, summary)
                scale = 1.0 if summary.unit == "s" else target.window_s
                first, last = (
                    np.searchsorted(_time(stream), ends_s - target.window_s + edge, side="right")
                    for edge in (summary.start * scale, min(summary.end * scale, target.window_s))
                )
                columns.append(measured(filtered[summary.band_hz][:, picked], summary.measure, first, last))
                names += [f"{stream.channels[place]} {summary.name}" for place in picked]
        if not columns:
            raise NotApplicable(
                f"{estimator.name} looks at {', '.join(one.name for one in summaries)}; {table.meta.sensor.name} has "
                f"no such channel that task {task.name!r} looks at: {band_limit(streams)}.",
                hint="Choose another estimator.",
            )
        return tuple(names), np.hstack(columns)

    return compute


def band_limit(streams: Sequence[StreamReadings]) -> str:
    """Return what the fastest stream cannot show."""
    one = fastest(streams)
    return f"band not observable above {(one.rate_hz or 0.0) / 2:.4g} Hz, half the rate of {one.stream}"


def fastest(streams: Sequence[StreamReadings]) -> StreamReadings:
    """Return the stream of the highest rate."""
    return max(streams, key=lambda one: one.rate_hz or 0.0)


def clocked(table: Table, rules: ProtocolSpec) -> tuple[StreamReadings, ...]:
    """Return the streams of a recording, tared as the protocol has it; raises NotApplicable if one has no clock."""
    streams = tared_readings(table, rules)
    for stream in streams:
        if stream.time_s is None:
            raise NotApplicable(
                f"Frames end at times, and {stream.stream} of recording {table.meta.name!r} has no clock.",
                hint="State the clock or the rate in the mapping.",
            )
        if not len(stream.data):
            raise DataError(f"Recording {table.meta.name!r} has no sample of {stream.stream}.", hint="Leave it out.")
    return streams


def frame_times(table: Table, task: TaskSpec, rules: ProtocolSpec) -> IntArray:
    """Return (n,) when the frames of a recording end, ns since the first row of the sensor's clock.

    They are all that all streams fill, after the hold where it is dropped.
    """
    target = slip_target(task)
    streams = clocked(table, rules)
    begin_s = max(dropped_s(table.meta, rules), *(float(_time(stream)[0]) for stream in streams))
    end_s = min(float(_time(stream)[-1]) for stream in streams)
    first = nanoseconds(begin_s) + nanoseconds(target.window_s)
    ends_ns = np.arange(first, nanoseconds(end_s) + 1, nanoseconds(target.hop_s), dtype=np.int64)
    if not ends_ns.size:
        raise DataError(
            f"Recording {table.meta.name!r} is shorter than a frame of {target.window_s:g} s.", hint="Leave it out."
        )
    return ends_ns


def _framed(
    table: Table,
    task: TaskSpec,
    rules: ProtocolSpec,
    compute: Callable[[Table, IntArray], Features],
    counts: Counter[str],
) -> tuple[Table, tuple[str, ...]]:
    all_ends_ns = frame_times(table, task, rules)
    names, X = compute(table, all_ends_ns)
    answered = ~np.isnan(X).any(axis=1)
    if not answered.all():
        counts["frames without a sample of some stream"] += int((~answered).sum())
    require_computable(X[answered], "a feature", table.meta)
    ends_ns, row = all_ends_ns[answered], np.flatnonzero(answered)
    state = table.slip.state(ends_ns)
    events = task.kind == "events"
    made = replace(
        table,
        X=X[answered],
        y=(state == GROSS).astype(np.int64) if events else state,
        labelled=np.full(len(row), True) if events else state != UNDECIDED,
        force=table.slip.at(ends_ns, table.slip.normal_n),
        time_s=np.asarray(ends_ns * 1e-9, dtype=np.float64),
        row=row,
        groups={name: np.full(len(row), column[0]) for name, column in table.groups.items()},
    )
    return made, names


def slip_target(task: TaskSpec) -> SlipTarget:
    """Return the target of a task of frames."""
    assert isinstance(task.target, SlipTarget)
    return task.target


def _time(stream: StreamReadings) -> FloatArray:
    assert stream.time_s is not None
    return stream.time_s


def _own_features(
    own: Callable[..., object],
    estimator: EstimatorDescriptor,
    stream: StreamReadings,
    ends_s: FloatArray,
    window_s: float,
) -> Features:
    found = np.asarray(own(stream, ends_s, window_s), dtype=np.float64)
    if found.ndim != 2 or len(found) != len(ends_s) or np.isinf(found).any():
        raise PluginContractError(
            f"{estimator.frames_by} gave an array of shape {found.shape} for {len(ends_s)} frames.",
            hint="It must return (frames, features) finite numbers, or NaN where there is no answer.",
        )
    return tuple(f"{stream.channels[0]} {estimator.name} {place + 1}" for place in range(found.shape[1])), found
