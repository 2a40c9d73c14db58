"""Features of whole recordings and of frames, from summaries such as the mean over a window.

Frames are windows that end at regular times; their features use each stream's own samples, and none after the end.
"""

from __future__ import annotations

import importlib
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tactbench.core.errors import DataError, NotApplicable, PluginContractError
from tactbench.core.evaluation.dataset import Dataset, Table, require_computable
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.sets import dropped_s, hold_s, less_rest
from tactbench.core.events.labels import GROSS, UNDECIDED, extremes, spread
from tactbench.core.plugins.registry import load_object
from tactbench.core.samples import FloatArray, IntArray, StreamReadings
from tactbench.core.spec.events import SlipTarget, nanoseconds
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.task import Summary, TaskSpec

STATES = ("stick", "incipient", "gross")
EVENT_CLASSES = ("no event", "event")

FrameFeatures = tuple[tuple[str, ...], FloatArray]
"""Names of features, and (frames, features) numbers; NaN where a stream has no sample in the frame."""
Features = Mapping[str, float]


def is_summarised(task: TaskSpec, rules: ProtocolSpec) -> bool:
    """Return True if each recording is reduced to one row of summaries, and not to its first row by the protocol."""
    return task.answer_per == "recording" and not rules.first_row_only


def summarised(data: Dataset, task: TaskSpec, rules: ProtocolSpec) -> Dataset:
    """Return a data set with one row of summaries per recording; `data` itself if the task does not summarise.

    The summaries are of the samples that the protocol keeps; the row is the recording's last, when all are known.
    """
    if not is_summarised(task, rules):
        return data
    compute = recording_features(task, rules)
    rows = [compute(table) for table in data.tables]
    tables = tuple(_one_row(table, row) for table, row in zip(data.tables, rows, strict=True))
    return replace(data, tables=tables, features=tuple(rows[0]))


def with_windows(estimator: EstimatorDescriptor, task: TaskSpec, rules: ProtocolSpec) -> EstimatorDescriptor:
    """Return `estimator` with the lengths of the mean filter among which to choose for this task and protocol.

    The only length is 0 if the task has summaries, or that of the protocol if stated; else the estimator's own apply.
    """
    windows = (0,) if task.summaries else estimator.window_grid if rules.k is None else (rules.k,)
    return estimator.model_copy(update={"window_grid": windows})


def recording_features(task: TaskSpec, rules: ProtocolSpec) -> Callable[[Table], Features]:
    """Return the function that computes the features of one recording."""

    def compute(table: Table) -> Features:
        streams = kept(table, rules)
        found: dict[str, float] = {}
        for summary in task.summaries:
            for stream in streams:
                columns = columns_of(stream, summary)
                if columns:
                    values = summary_of(stream, summary, table.meta.name)[columns]
                    names = [f"{stream.channels[place]} {summary.name}" for place in columns]
                    found |= dict(zip(names, values.tolist(), strict=True))
        for name, value in found.items():
            require_computable(np.array(value), name, table.meta)
        return found

    return compute


def columns_of(stream: StreamReadings, summary: Summary) -> list[int]:
    """Return indices of the columns of a stream whose kind of channel is summarised by `summary`."""
    return [place for place, kind in enumerate(stream.kinds) if not summary.kinds or kind in summary.kinds]


def kept(table: Table, rules: ProtocolSpec) -> tuple[StreamReadings, ...]:
    """Return the streams of a recording after the dropped start, tared if the protocol tares; times start there."""
    begin_s, found = dropped_s(table.meta, rules), []
    for stream in tared_readings(table, rules):
        data, time_s = stream.data, stream.time_s
        if time_s is not None:
            later = time_s >= begin_s
            data, time_s = data[later], time_s[later] - begin_s
        if not len(data):
            raise DataError(
                f"Recording {table.meta.name!r} has no sample of {stream.stream} that the protocol keeps.",
                hint="Record it again, or leave the recording out.",
            )
        found.append(replace(stream, data=data, time_s=time_s))
    return tuple(found)


def tared_readings(table: Table, rules: ProtocolSpec) -> tuple[StreamReadings, ...]:
    """Return the streams of a recording; those with a clock minus their means over the hold, if the protocol tares."""
    return tuple(
        one if one.time_s is None or not rules.tare
        else replace(one, data=less_rest(one.data, one.time_s < hold_s(table.meta)))
        for one in table.readings
    )  # fmt: skip


def summary_of(stream: StreamReadings, summary: Summary, recording: str) -> FloatArray:
    """Return the (channels,) values of a summary over its window; a band filter also uses earlier samples."""
    n = len(stream.data)
    first = min(math.floor(summary.start * n), n - 1)
    values = in_band(stream, summary.band_hz, recording)[first : max(math.ceil(summary.end * n), first + 1)]
    return np.asarray(measured(values, summary.measure, np.array([0]), np.array([len(values)]))[0])


def measured(values: FloatArray, measure: str, first: IntArray, last: IntArray) -> FloatArray:
    """Return the (windows, channels) `measure` of ``values[first:last]`` for each window; NaN for an empty window.

    Sums are differences of running sums from the first sample, so that no digit depends on later samples.
    """
    if measure == "range":
        found = spread(values, first, last)
    elif measure in ("minimum", "maximum"):
        found = extremes(values, first, last)[measure == "maximum"]
    elif measure == "change":
        found = values[np.maximum(last - 1, 0)] - values[np.minimum(first, len(values) - 1)]
    elif measure == "mean-step":
        steps = np.abs(np.diff(values, axis=0, prepend=values[:1]))
        found = _means(steps, np.minimum(first + 1, last), last)
    elif measure == "band-energy":
        found = _means(values**2, first, last)
    else:
        centre = values[0]
        mean = _means(values - centre, first, last)
        found = mean + centre
        if measure == "deviation":
            found = np.sqrt(np.maximum(_means((values - centre) ** 2, first, last) - mean**2, 0.0))
    return np.where((last > first)[:, None], found, np.nan)


def _means(values: FloatArray, first: IntArray, last: IntArray) -> FloatArray:
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    return np.asarray((total[last] - total[first]) / np.maximum(last - first, 1)[:, None])


def in_band(stream: StreamReadings, band_hz: tuple[float, float] | None, recording: str) -> FloatArray:
    """Return a stream's (n, channels) samples through a causal band-pass, whose output starts at 0; None: no filter."""
    if band_hz is None:
        return stream.data
    if stream.rate_hz is None:
        raise NotApplicable(
            f"A band in Hz needs a sampling rate, but recording {recording!r} states no rate of {stream.stream}.",
            hint="State the clock or the rate in the mapping, or choose a summary without a band.",
        )
    if band_hz[1] >= stream.rate_hz / 2:
        raise NotApplicable(
            f"The band {band_hz[0]:g}-{band_hz[1]:g} Hz cannot be observed: {stream.stream} of recording {recording!r} "
            f"is sampled at {stream.rate_hz:.4g} Hz, which shows nothing above {stream.rate_hz / 2:.4g} Hz.",
            hint="Choose a lower band, or limit the summary to the `kinds` of channels that are fast enough.",
        )
    signal = importlib.import_module("scipy.signal")
    sections = signal.butter(2, band_hz, "bandpass", fs=stream.rate_hz, output="sos")
    return np.asarray(signal.sosfilt(sections, stream.data - stream.data[0], axis=0))


def _one_row(table: Table, features: Features) -> Table:
    """Return a recording's last row with these features, and the first label of the recording."""
    last, labelled = table.taken(slice(-1, None)), np.flatnonzero(table.labelled)
    return replace(
        last, X=np.array([list(features.values())], dtype=np.float64), force=None, readings=(),
        y=table.y[labelled[:1]] if len(labelled) else last.y, labelled=np.array([len(labelled) > 0]),
    )  # fmt: skip


def framed(data: Dataset, task: TaskSpec, rules: ProtocolSpec, estimator: EstimatorDescriptor) -> Dataset:
    """Return a data set with one row for each frame, with the features that `estimator` uses."""
    counts = Counter(data.counts)
    compute = frame_features(task, rules, estimator)
    tables, names = zip(*(_framed(table, task, rules, compute, counts) for table in data.tables), strict=True)
    classes = EVENT_CLASSES if task.kind == "events" else STATES
    return replace(data, tables=tables, features=names[0], classes=classes, counts=dict(counts))


def frame_features(
    task: TaskSpec, rules: ProtocolSpec, estimator: EstimatorDescriptor
) -> Callable[[Table, IntArray], FrameFeatures]:
    """Return the function from a recording and ends of frames [ns] to features, and import a detector's own code."""
    target = slip_target(task)
    own = load_object(estimator.frames_by) if estimator.frames_by else None
    summaries = estimator.summaries or task.summaries

    def compute(table: Table, ends_ns: IntArray) -> FrameFeatures:
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
                first, last = (
                    np.searchsorted(_time(stream), ends_s - target.window_s + edge * target.window_s, side="right")
                    for edge in (summary.start, summary.end)
                )
                columns.append(measured(filtered[summary.band_hz][:, picked], summary.measure, first, last))
                names += [f"{stream.channels[place]} {summary.name}" for place in picked]
        if not columns:
            raise NotApplicable(
                f"{estimator.name} needs {', '.join(one.name for one in summaries)}, but {table.meta.sensor.name} has "
                f"no channel for these in task {task.name!r}: {band_limit(streams)}.",
                hint="Choose another estimator.",
            )
        return tuple(names), np.hstack(columns)

    return compute


def band_limit(streams: Sequence[StreamReadings]) -> str:
    """Return a text that states the highest observable frequency of the fastest stream."""
    one = fastest(streams)
    return f"band not observable above {(one.rate_hz or 0.0) / 2:.4g} Hz, half the rate of {one.stream}"


def fastest(streams: Sequence[StreamReadings]) -> StreamReadings:
    """Return the stream with the highest sampling rate."""
    return max(streams, key=lambda one: one.rate_hz or 0.0)


def clocked(table: Table, rules: ProtocolSpec) -> tuple[StreamReadings, ...]:
    """Return the streams of a recording, tared if the protocol tares; raise NotApplicable if a stream has no clock."""
    streams = tared_readings(table, rules)
    for stream in streams:
        if stream.time_s is None:
            raise NotApplicable(
                f"Frames need times, but {stream.stream} of recording {table.meta.name!r} has no clock.",
                hint="State the clock or the rate in the mapping.",
            )
        if not len(stream.data):
            raise DataError(f"Recording {table.meta.name!r} has no {stream.stream} sample.", hint="Omit the recording.")
    return streams


def frame_times(table: Table, task: TaskSpec, rules: ProtocolSpec) -> IntArray:
    """Return the (n,) end times of a recording's frames [ns], since the first row of the sensor's clock.

    Frames lie within the time span of every stream, and after the hold if the protocol drops it.
    """
    target = slip_target(task)
    streams = clocked(table, rules)
    begin_s = max(dropped_s(table.meta, rules), *(float(_time(stream)[0]) for stream in streams))
    end_s = min(float(_time(stream)[-1]) for stream in streams)
    first = nanoseconds(begin_s) + nanoseconds(target.window_s)
    ends_ns = np.arange(first, nanoseconds(end_s) + 1, nanoseconds(target.hop_s), dtype=np.int64)
    if not ends_ns.size:
        raise DataError(
            f"Recording {table.meta.name!r} is shorter than a frame, {target.window_s:g} s.", hint="Omit the recording."
        )
    return ends_ns


def _framed(
    table: Table,
    task: TaskSpec,
    rules: ProtocolSpec,
    compute: Callable[[Table, IntArray], FrameFeatures],
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
    """Return the target of a task on frames, which is always slip."""
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
) -> FrameFeatures:
    found = np.asarray(own(stream, ends_s, window_s), dtype=np.float64)
    if found.ndim != 2 or len(found) != len(ends_s) or np.isinf(found).any():
        raise PluginContractError(
            f"{estimator.frames_by} gave an array of shape {found.shape} for {len(ends_s)} frames.",
            hint="The function must return a (frames, features) array of finite numbers, or NaN for no answer.",
        )
    return tuple(f"{stream.channels[0]} {estimator.name} {place + 1}" for place in range(found.shape[1])), found
