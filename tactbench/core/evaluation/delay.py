"""Parts of the delay from a change at the sensor's skin to the answer that includes it, and the duration of calls."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from tactbench.core.evaluation.dataset import Dataset, Table
from tactbench.core.evaluation.folds import TaskData
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.sets import FeatureScale, asked_for, causal_mean
from tactbench.core.evaluation.summaries import (
    frame_features,
    frame_times,
    is_summarised,
    kept,
    recording_features,
    slip_target,
)
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import FloatArray, StreamReadings
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.sensor import StreamSpec
from tactbench.core.spec.task import TaskSpec

T = TypeVar("T")
Clock = Callable[[], float]
"""Function that returns the time in seconds, which never decreases."""

RATE_TOLERANCE = 0.01
"""Relative difference of two rates above which a remark is made: rates are stated to two or three digits."""

SLOWEST_S = 1.0
"""Interval [s] above which rows are taken as single readings (one per press), without a sampling interval (assumed)."""
NO_LINK = "link delay unknown: an answer delay is without it"
NO_RATE = "answer delay unknown: the recordings state no sampling rate"
AT_LEAST, AT_MOST = 20, 200
BUDGET_S = 0.3
CALLS_OF_P95 = 200
"""Number of timed calls from which on a 95th percentile is stated: ten of 200 calls are beyond it."""
RECORDINGS_TIMED = 3
"""Number of recordings on which the features of frames are timed; each has hundreds of frames."""


def stated_delay_ms(data: TaskData, estimator: EstimatorDescriptor, k: int) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the parts of the answer delay that do not depend on the machine, in ms, and remarks on them.

    Parameters
    ----------
    k
        Number of earlier rows that the mean filter, or a window, includes.

    Returns
    -------
    dict, tuple
        ``sampling``: one sampling interval of the slowest stream used, the longest time from a change to the next
        sample. The interval is that of the sensor's own rate; if the sensor states no rate, or the recorded times show
        a slower one, that of the recordings. For frames, the step between frames if that is longer.
        ``link``: the link delay that the sensor's spec states.
        ``window``: the group delay of the mean filter at the rate of the recordings, `k` / 2 intervals (a mean of n
        samples has linear phase of slope (n - 1) / 2; Oppenheim and Schafer, Discrete-Time Signal Processing, section
        5.7). Samples that a protocol drops are not counted, nor the shorter windows at the start of a recording. For
        frames, half the frame's length, or 0 for an estimator that uses the reference's last sample. For a task with
        one answer per recording, the time span of the samples used.
        An unknown part is absent; for answers that use no reading the dict is empty.
    """
    task, rules, recorded = data.task, data.rules, data.recorded
    frames = task.answer_per == "frame"
    if estimator.looks_at != "features" and not (frames and estimator.looks_at == "reference"):
        return {}, ()
    parts, remarks = _reading_delay_ms(recorded, rules, 0 if frames else k)
    if frames:
        target = slip_target(task)
        rates = [
            stream.rate_hz
            for table in recorded.tables
            for stream in table.readings
            if any(feature.startswith(f"{channel} ") for channel in stream.channels for feature in data.feature_names)
        ]
        parts["sampling"] = 1e3 * max([target.hop_s, *(1.0 / rate for rate in rates if rate)])
        parts["window"] = 1e3 * target.window_s / 2 if estimator.looks_at == "features" else 0.0
    elif task.answer_per == "recording":
        spans = [0.0 if rules.first_row_only else _span_s(recorded, table, task, rules) for table in recorded.tables]
        parts.pop("window", None)
        if (longest := _largest(spans)) is not None:
            parts["window"] = 1e3 * longest
    return parts, remarks


def _reading_delay_ms(data: Dataset, rules: ProtocolSpec, k: int) -> tuple[dict[str, float], tuple[str, ...]]:
    parts: dict[str, float] = {}
    interval_s = _row_interval_s(data, rules)
    remarks: dict[str, None] = {}
    waits_ms: list[float | None] = []
    for meta in data.metas:
        for place, stream in enumerate(_used(meta, data)):
            stated_hz = stream.rate_hz and stream.rate_hz / rules.every
            sampled_hz = 1.0 / interval_s if place == 0 and interval_s else stated_hz
            own_hz = meta.own_rates_hz.get(stream.name, stream.rate_hz)
            own_hz = own_hz / rules.every if own_hz else sampled_hz
            # A rig may record a sensor below its own rate; unless the rig states that, the clock outweighs the spec.
            slower = sampled_hz and own_hz and sampled_hz < (1 - RATE_TOLERANCE) * own_hz
            waited_hz = sampled_hz if slower and stream.name not in meta.own_rates_hz else own_hz
            waits_ms.append(1e3 / waited_hz if waited_hz else None)
            if own_hz and sampled_hz and abs(sampled_hz - own_hz) > RATE_TOLERANCE * own_hz:
                remarks[f"{stream.name} sampled at {sampled_hz:.4g} Hz; its own rate is {own_hz:.4g} Hz"] = None
    if (wait_ms := _largest(waits_ms)) is not None:
        parts["sampling"] = wait_ms
    links = [meta.sensor.link_delay for meta in data.metas]
    if (link_ms := _largest([None if link is None else link.to("ms") for link in links])) is not None:
        parts["link"] = link_ms
    else:
        remarks[NO_LINK] = None
    if k == 0 or rules.first_row_only:
        parts["window"] = 0.0
    elif interval_s:
        parts["window"] = 1e3 * interval_s * k / 2
    if not {"sampling", "window"} <= parts.keys():
        remarks = {NO_RATE: None}
    return parts, tuple(remarks)


def answer_delay_ms(parts_ms: Mapping[str, float], looks_at: str) -> float | None:
    """Return the answer delay [ms], the sum of its parts; None if a part is unknown, other than ``link``.

    An answer that uses no reading needs the part ``prediction`` only. Without ``link`` the sum is a lower bound.
    """
    needed = ("prediction", *(("sampling", "window", "features") if looks_at == "features" else ()))
    return sum(parts_ms.values()) if all(name in parts_ms for name in needed) else None


def _used(meta: RecordingMeta, data: Dataset) -> list[StreamSpec]:
    """Return the streams with features in `data`; first the stream whose clock times the rows."""
    used = [one for one in meta.sensor.streams if any(channel.name in data.features for channel in one.channels)]
    return sorted(used, key=lambda one: all(channel.name != data.features[0] for channel in one.channels))


def _row_interval_s(data: Dataset, rules: ProtocolSpec) -> float | None:
    """Return the longest interval [s] between rows of a recording, taken as the median step of the clock.

    Without a clock, or where rows are single readings, the stream's stated rate gives the interval; None without both.
    """
    found: list[float | None] = []
    for table in data.tables:
        timed = table.meta.clock != "none" and len(table.time_s) > 1
        step_s = float(np.median(np.diff(table.time_s))) if timed else 0.0
        rate_hz = _used(table.meta, data)[0].rate_hz
        found.append(step_s if 0 < step_s <= SLOWEST_S else rules.every / rate_hz if rate_hz else None)
    return _largest(found)


def _largest(values: Sequence[float | None]) -> float | None:
    """Return the largest of `values`; None if the sequence is empty or contains None."""
    known = [value for value in values if value is not None]
    return max(known) if len(known) == len(values) else None


def _span_s(data: Dataset, table: Table, task: TaskSpec, rules: ProtocolSpec) -> float | None:
    if task.vote:
        times_s = table.time_s[asked_for(table, rules)]
        if table.meta.clock == "none":
            interval_s = _row_interval_s(data, rules)
            return None if interval_s is None else len(times_s) * interval_s
        return float(np.ptp(times_s)) if len(times_s) else 0.0
    length = _largest([_length_s(stream) for stream in kept(table, rules)])
    if length is None:
        return None
    windows = [(one.start, one.end) if one.unit == "s" else (one.start * length, one.end * length)
               for one in task.summaries]  # fmt: skip
    if task.features_by:
        windows.append((0.0, length))
    return max(end for _, end in windows) - min(start for start, _ in windows)


def _length_s(stream: StreamReadings) -> float | None:
    if stream.time_s is not None:
        return float(stream.time_s[-1])
    return None if stream.rate_hz is None else len(stream.data) / stream.rate_hz


def features_s(data: TaskData, estimator: EstimatorDescriptor, X: FloatArray, k: int, clock: Clock) -> float | None:
    """Return the median time [s] to compute the features of one answer; None for an answer that uses no reading.

    For frames, the time for all frames of a recording over their number; a detector in use needs more calls, one for
    each frame. For a row of `X`, the time to tare, scale and average `k` + 1 readings by the code for whole sets.
    """
    task, rules, tables = data.task, data.rules, data.recorded.tables
    if task.answer_per == "frame" and estimator.looks_at in ("features", "reference"):
        compute = frame_features(task, rules, estimator)
        spent_s = []
        for place in np.linspace(0, len(tables) - 1, RECORDINGS_TIMED).astype(int).tolist():
            frames = frame_times(tables[place], task, rules)
            began = clock()
            compute(tables[place], frames)
            spent_s.append((clock() - began) / len(frames))
        return float(np.median(spent_s))
    if estimator.looks_at != "features":
        return None
    if is_summarised(task, rules):
        work = recording_features(task, rules)
        return float(np.median(calls_s(len(tables), tables.__getitem__, work, clock, AT_LEAST)))
    rest, scale = np.zeros(X.shape[-1]), FeatureScale(np.zeros(X.shape[-1]), np.ones(X.shape[-1]))
    segment = np.zeros(k + 1, dtype=np.int64)

    def ready(readings: FloatArray) -> FloatArray:
        return causal_mean(scale(readings - rest if rules.tare else readings), k, segment[: len(readings)])[-1:]

    # Rows stand for raw readings: values change no time. A median needs no more calls than the fewest.
    return float(np.median(calls_s(len(X), lambda place: X[max(0, place - k) : place + 1], ready, clock, AT_LEAST)))


def single_row_latency_s(model: Estimator, X: FloatArray, clock: Clock) -> FloatArray:
    """Return the (calls,) durations [s] of calls of ``predict`` on one row each, whose features are ready.

    From 20 to 200 calls are made, and no further ones after 0.3 s; one call before is not counted. Rows are spread
    over `X`, because a model may answer some rows faster than others.
    """
    return calls_s(len(X), lambda place: X[place : place + 1], model.predict, clock)


def tail_ms(spent_s: FloatArray) -> tuple[float | None, float]:
    """Return the 95th percentile [ms] of durations [s], None for fewer than 200 calls, and the largest [ms]."""
    enough = len(spent_s) >= CALLS_OF_P95
    return float(1e3 * np.quantile(spent_s, 0.95)) if enough else None, float(1e3 * spent_s.max())


def calls_s(
    rows: int,
    given: Callable[[int], T],
    work: Callable[[T], object],
    clock: Clock,
    at_most: int = AT_MOST,
) -> FloatArray:
    """Return the (calls,) durations [s] of ``work(given(i))``, for row numbers i spread over `rows` rows."""
    places = np.linspace(0, rows - 1, at_most).astype(int)
    work(given(places[0]))  # the first call of a library takes longer
    spent: list[float] = []
    for place in np.random.default_rng(0).permutation(places):
        row = given(place)
        began = clock()
        work(row)
        spent.append(clock() - began)
        if len(spent) >= AT_LEAST and sum(spent) > BUDGET_S:
            break
    return np.array(spent)


def peak_rss_mb() -> float | None:
    """Return the largest resident memory of this process so far [MB]; None if the system does not report it."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak) / (2**20 if sys.platform == "darwin" else 2**10)
