"""Parts of the delay from a change at the sensor's skin to the answer that includes it, and the duration of calls."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from tactbench.core.evaluation.dataset import Table
from tactbench.core.evaluation.folds import TaskData
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.sets import FeatureScale, causal_mean
from tactbench.core.evaluation.summaries import (
    frame_features,
    frame_times,
    is_summarised,
    kept,
    recording_features,
    slip_target,
)
from tactbench.core.samples import FloatArray, StreamReadings
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.sensor import StreamSpec
from tactbench.core.spec.task import TaskSpec

Clock = Callable[[], float]
"""Function that returns the time in seconds, which never decreases."""

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


def stated_delay_ms(data: TaskData, estimator: EstimatorDescriptor, k: int) -> tuple[dict[str, float], str]:
    """Return the parts of the answer delay that do not depend on the machine, in ms, and a remark on unknown parts.

    Parameters
    ----------
    k
        Number of earlier rows that the mean filter, or a window, includes.

    Returns
    -------
    dict, str
        ``sampling``: one sampling interval of the slowest stream used, the longest time from a change to the next
        sample. The interval is that of the sensor's own rate if the rig states one, else the longer one of the stated
        rate and the recorded times. For frames, the step between frames if the step is longer.
        ``link``: the link delay that the sensor's spec states.
        ``window``: the group delay of the mean filter at the rate of the recordings, `k` / 2 intervals (a mean of n
        samples has linear phase of slope (n - 1) / 2; Oppenheim and Schafer, Discrete-Time Signal Processing, section
        5.7). Samples that a protocol drops are not counted, nor the shorter windows at the start of a recording. For
        frames, half the frame's length, or 0 for an estimator that uses the reference's last sample. For a task with
        one answer per recording, the time span of the samples used.
        An unknown part is absent; for answers that use no reading the dict is empty.
    """
    task, rules, features = data.task, data.rules, data.recorded.features
    frames = task.answer_per == "frame"
    if estimator.looks_at != "features" and not (frames and estimator.looks_at == "reference"):
        return {}, ""
    sampling: list[float | None] = []
    links: list[float | None] = []
    windows: list[float | None] = []
    for table in data.recorded.tables:
        wait_s, rate_hz = _wait_s(table, features, rules), _used(table.meta, features)[0].rate_hz
        row_s = _step_s(table) or (rules.every / rate_hz if rate_hz else None)
        link = table.meta.sensor.link_delay
        links.append(None if link is None else link.to("s"))
        sampling.append(max(wait_s, slip_target(task).hop_s) if frames and wait_s else wait_s)
        if frames:
            windows.append(slip_target(task).window_s / 2 if estimator.looks_at == "features" else 0.0)
        elif rules.first_row_only or (k == 0 and task.answer_per == "sample"):
            windows.append(0.0)
        elif task.answer_per == "recording":
            windows.append(_span_s(table, task, rules))
        else:
            windows.append(None if row_s is None else row_s * k / 2)
    longest = {"sampling": _largest(sampling), "link": _largest(links), "window": _largest(windows)}
    parts = {name: 1e3 * seconds for name, seconds in longest.items() if seconds is not None}
    unknown = NO_LINK if "link" not in parts else ""
    return parts, unknown if {"sampling", "window"} <= parts.keys() else NO_RATE


def _wait_s(table: Table, features: Sequence[str], rules: ProtocolSpec) -> float | None:
    """Return the longest sampling interval [s] of the streams with features; None if an interval is unknown."""
    by_clock = {one.stream: 1.0 / one.rate_hz for one in table.readings if one.rate_hz}
    waits = []
    for place, stream in enumerate(_used(table.meta, features)):
        own_hz = table.meta.own_rates_hz.get(stream.name)
        stated_hz = own_hz or stream.rate_hz
        # A rig may record a sensor below its own rate; unless the rig states that, the clock outweighs the spec.
        recorded_s = 0.0 if own_hz else by_clock.get(stream.name, 0.0 if place else _step_s(table))
        waits.append(max(rules.every / stated_hz if stated_hz else 0.0, recorded_s) or None)
    return _largest(waits)


def _step_s(table: Table) -> float:
    """Return the median interval [s] between rows; 0 without a clock, or if the interval exceeds `SLOWEST_S`."""
    timed = table.meta.clock != "none" and len(table.time_s) > 1
    step_s = float(np.median(np.diff(table.time_s))) if timed else 0.0
    return step_s if step_s <= SLOWEST_S else 0.0


def answer_delay_ms(parts_ms: Mapping[str, float], looks_at: str) -> float | None:
    """Return the answer delay [ms], the sum of its parts; None if a part is unknown, other than ``link``.

    An answer that uses no reading needs the part ``prediction`` only. Without ``link`` the sum is a lower bound.
    """
    needed = ("prediction", *(("sampling", "window", "features") if looks_at == "features" else ()))
    return sum(parts_ms.values()) if all(name in parts_ms for name in needed) else None


def _used(meta: RecordingMeta, features: Sequence[str]) -> list[StreamSpec]:
    """Return the streams with features; first the stream whose clock times the rows."""
    used = [one for one in meta.sensor.streams if any(channel.name in features for channel in one.channels)]
    return sorted(used, key=lambda one: all(channel.name != features[0] for channel in one.channels))


def _largest(values: Sequence[float | None]) -> float | None:
    """Return the largest of `values`; None if the sequence contains None."""
    known = [value for value in values if value is not None]
    return max(known) if len(known) == len(values) else None


def _span_s(table: Table, task: TaskSpec, rules: ProtocolSpec) -> float | None:
    """Return the time span [s] of the windows of a recording's summaries; None if it is unknown."""
    length = _largest([_length_s(stream) for stream in kept(table, rules)])
    if length is None:
        return None
    return length * (max(one.end for one in task.summaries) - min(one.start for one in task.summaries))


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
        return float(np.median(calls_s(tables, work, clock, AT_LEAST)))
    rest, scale = np.zeros(X.shape[-1]), FeatureScale(np.zeros(X.shape[-1]), np.ones(X.shape[-1]))
    readings, segment = np.resize(X, (k + 1, *X.shape[1:])), np.zeros(k + 1, dtype=np.int64)

    def ready(readings: FloatArray) -> FloatArray:
        return causal_mean(scale(readings - rest if rules.tare else readings), k, segment)[-1:]

    # Rows stand for raw readings: values change no time. A median needs no more calls than the fewest.
    return float(np.median(calls_s([readings], ready, clock, AT_LEAST)))


def calls_s(
    given: Sequence[Any] | FloatArray, work: Callable[[Any], object], clock: Clock, at_most: int = AT_MOST
) -> FloatArray:
    """Return the (calls,) durations [s] of ``work`` called with items of a sequence.

    20 calls are made, and more, up to `at_most`, while they take under 0.3 s; a first call is not counted. Items are
    spread over the sequence because a model may answer some rows faster than others.
    """
    places = np.linspace(0, len(given) - 1, at_most).astype(int)
    work(given[places[0]])  # the first call of a library takes longer
    spent: list[float] = []
    for place in np.random.default_rng(0).permutation(places):
        row = given[place]
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
