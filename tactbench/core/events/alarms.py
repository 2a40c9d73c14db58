"""Alarms: raised from frames, matched with events, and scored by hits, latency and false alarms over stated seconds.

Frames have their metrics in :mod:`tactbench.core.evaluation.metrics` (``balanced_accuracy``, ``macro_f1``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.events import AlarmPolicy, nanoseconds


def alarms(t_ns: IntArray, active: npt.NDArray[np.bool_], policy: AlarmPolicy) -> IntArray:
    """Return when alarms are known [ns], in order of time.

    Parameters
    ----------
    t_ns
        (n,) when each frame's answer is known, strictly rising: the end of its window. What the detector needs to
        compute it is added by the caller. Where samples are lost, the caller cuts: neighbours are taken as neighbours.
    active
        (n,) whether the frame says "event", such as ``score >= threshold``.
    policy
        Merging, minimum length and refractory time.

    Notes
    -----
    An alarm at t depends on frames up to t alone. Active frames belong to one segment if they are neighbours or at
    most `merge_gap_s` apart. A segment raises one alarm, at its first active frame at least `minimum_length_s` after
    its first frame; within a gap it is unknown whether it will be bridged. An alarm less than `refractory_s` after the
    last one that was kept is dropped.
    """
    on = np.flatnonzero(active)
    if on.size == 0:
        return np.zeros(0, dtype=np.int64)
    t = t_ns[on]
    apart = (np.diff(on) > 1) & (np.diff(t) > nanoseconds(policy.merge_gap_s))
    segment = np.concatenate([[0], np.cumsum(apart)])
    first = t[np.concatenate([[True], apart])][segment]
    long_enough = t - first >= nanoseconds(policy.minimum_length_s)
    raised = t[long_enough][np.flatnonzero(np.diff(segment[long_enough], prepend=-1))]
    return np.asarray(raised[_kept(raised, nanoseconds(policy.refractory_s))])


def _kept(raised_ns: IntArray, refractory_ns: int) -> IntArray:
    """Return the places of the alarms that the refractory time leaves, of alarms in order of time."""
    following = np.searchsorted(raised_ns, raised_ns + max(refractory_ns, 1)).tolist()
    places, place = [], 0
    while place < len(following):
        places.append(place)
        place = following[place]
    return np.asarray(places, dtype=np.int64)


def match(onset_ns: IntArray, alarm_ns: IntArray, policy: AlarmPolicy) -> tuple[IntArray, IntArray]:
    """Return the places of matched onsets and those of their alarms, as many pairs as there can be.

    Parameters
    ----------
    onset_ns, alarm_ns
        (n,) and (m,) times [ns], in any order.
    policy
        Its window: an alarm may hit an onset from `window_before_s` before to `window_after_s` after it, both ends
        included.

    Notes
    -----
    In order of time each event takes the earliest alarm that is left in its window. All windows are equally long, so
    that their beginnings and ends come in the same order: an alarm passed over is too early for all later events, and
    to take the earliest leaves every later event at least as much choice. The number of pairs is therefore the largest
    possible [1]_ (a convex bipartite graph whose intervals do not nest). It takes O(n log n + m log m).

    Of all largest matchings this is the one of first alarms: an event that is announced twice within its window has the
    latency of the first announcement, and the second is a false positive.

    References
    ----------
    .. [1] Glover 1967, Maximum matching in a convex bipartite graph, Naval Research Logistics Quarterly 14, 313-316.
    """
    before, after = nanoseconds(policy.window_before_s), nanoseconds(policy.window_after_s)
    event_order, alarm_order = np.argsort(onset_ns, kind="stable"), np.argsort(alarm_ns, kind="stable")
    raised = alarm_ns[alarm_order].tolist()
    events, hits, place = [], [], 0
    for event, onset in enumerate(onset_ns[event_order].tolist()):
        while place < len(raised) and raised[place] < onset - before:
            place += 1
        if place == len(raised):
            break
        if raised[place] <= onset + after:
            events.append(event)
            hits.append(place)
            place += 1
    return event_order[events].astype(np.int64), alarm_order[hits].astype(np.int64)


@dataclass(frozen=True)
class GroundTruth:
    """The events of one recording."""

    event_ns: IntArray
    """(e, 2) onset and end of each event [ns]."""
    disturbance: bool
    """Whether the recording as a whole is a disturbance: a press, a tap, a motor that starts."""
    span_ns: tuple[int, int]
    """From when until when (excluded) the detector could raise alarms [ns]."""


@dataclass(frozen=True)
class EventScores:
    """Counts and latencies over all events of some recordings, and the scores that follow from them.

    The shape (...) is () for one set of alarms and (k,) for k thresholds. NaN is undefined: precision without an
    alarm, recall without an event, a rate without seconds, a latency without a hit.
    """

    n_alarms: IntArray
    """(...) alarms, those outside the time base of false alarms included."""
    n_false_alarms: IntArray
    """(...) alarms within that time base."""
    base_ns: int
    """Length of that time base [ns]."""
    latency_s: FloatArray
    """(..., e) alarm minus onset of each event [s], negative is early; NaN is a miss."""

    @property
    def n_hits(self) -> IntArray:
        """Return (...) how many events were hit."""
        return np.asarray(np.isfinite(self.latency_s).sum(axis=-1), dtype=np.int64)

    @property
    def n_misses(self) -> IntArray:
        """Return (...) how many were not."""
        return np.asarray(self.latency_s.shape[-1] - self.n_hits)

    @property
    def recall(self) -> FloatArray:
        """Return (...) hits of events."""
        return _ratio(self.n_hits, self.latency_s.shape[-1])

    @property
    def precision(self) -> FloatArray:
        """Return (...) hits of alarms; a second alarm on one event is no hit."""
        return _ratio(self.n_hits, self.n_alarms)

    @property
    def f1(self) -> FloatArray:
        """Return (...) twice the hits of alarms and events together."""
        return _ratio(2 * self.n_hits, self.n_alarms + self.latency_s.shape[-1])

    @property
    def false_alarms_per_minute(self) -> FloatArray:
        """Return (...) false alarms per minute of the time base [1/min]."""
        return _ratio(self.n_false_alarms, self.base_ns / 1e9 / 60.0)

    def latency_percentile_s(self, percent: float) -> float:
        """Return a percentile of the latency over hits of one set of alarms, linear between order statistics [s].

        Never to be shown without :attr:`n_misses`: a detector that hits only the easy events looks quick.
        """
        hits = self.latency_s[np.isfinite(self.latency_s)]
        return float(np.percentile(hits, percent)) if hits.size else np.nan

    def row(self, place: Any) -> EventScores:
        """Return the scores at one threshold, or at several."""
        return EventScores(self.n_alarms[place], self.n_false_alarms[place], self.base_ns, self.latency_s[place])


def score_events(truths: Sequence[GroundTruth], alarms_ns: Sequence[IntArray], policy: AlarmPolicy) -> EventScores:
    """Score the alarms [ns] of each recording; nothing is matched across recordings.

    Notes
    -----
    Precision, recall and F1 are those of onset detection [1]_: matched pairs of all alarms and of all events. The
    latency is the signed offset of [2]_; unlike there, further alarms within one window are false positives. Alarms
    outside the time base (a second one in a window, one late in an event) lower the precision, not the rate of false
    alarms.

    References
    ----------
    .. [1] Raffel et al. 2014, mir_eval: a transparent implementation of common MIR metrics, ISMIR.
    .. [2] sktime, detection metrics: EventTPR, FalseAlarmRate, MeanDetectionOffset.
    """
    latencies, n_alarms, n_false, base_ns = [], 0, 0, 0
    for truth, alarm_ns in zip(truths, alarms_ns, strict=True):
        counted, length_ns = time_base(truth, policy, alarm_ns)
        latencies.append(latency_s(truth.event_ns[:, 0], alarm_ns, policy))
        n_alarms += alarm_ns.size
        n_false += int(counted.sum())
        base_ns += length_ns
    return EventScores(np.asarray(n_alarms), np.asarray(n_false), base_ns, np.concatenate([[], *latencies]))


def latency_s(onset_ns: IntArray, alarm_ns: IntArray, policy: AlarmPolicy) -> FloatArray:
    """Return (e,) the matched alarm minus the onset of each event [s]; NaN is a miss."""
    latency = np.full(onset_ns.size, np.nan)
    event, alarm = match(onset_ns, alarm_ns, policy)
    latency[event] = (alarm_ns[alarm] - onset_ns[event]) / 1e9
    return latency


def displacement_at_detection(
    onset_ns: IntArray, latency_s: FloatArray, t_ns: IntArray, displacement_m: FloatArray
) -> FloatArray:
    """Return (e,) how far the surface moved from each onset to its alarm [m].

    Parameters
    ----------
    onset_ns, latency_s
        (e,) as of the truth and the scores.
    t_ns, displacement_m
        (n,) relative displacement over time, of the reference; straight between its samples.

    Notes
    -----
    Zero or the other sign where the alarm came before the onset. NaN for a miss, and where onset or alarm lies outside
    the stream: nothing is extrapolated.
    """
    start = t_ns[0]
    clock, onset = (t_ns - start) / 1e9, (onset_ns - start) / 1e9
    moved = [np.interp(at, clock, displacement_m, left=np.nan, right=np.nan) for at in (onset, onset + latency_s)]
    return np.asarray(moved[1] - moved[0])


def time_base(truth: GroundTruth, policy: AlarmPolicy, t_ns: IntArray) -> tuple[IntArray, int]:
    """Return (n,) which times lie where false alarms are counted, 0 or 1, and how long that is in all [ns].

    It is the time that the policy names, without every event and its window: half-open stretches between edges.
    """
    named = truth.disturbance or policy.false_alarm_time == "non-events"
    begin, close = truth.span_ns
    onset, end = truth.event_ns.T
    until = np.maximum(onset + nanoseconds(policy.window_after_s), end) + 1  # the window holds its own end
    since = onset - nanoseconds(policy.window_before_s)
    edge = np.unique(np.concatenate([[begin, close], since, until]))
    of_event = (edge[:, None] >= since) & (edge[:, None] < until)
    counted = np.append(0, named & (edge >= begin) & (edge < close) & ~of_event.any(axis=1))
    length_ns = int((np.diff(edge) * counted[1:-1]).sum())
    return np.asarray(counted[np.searchsorted(edge, t_ns, side="right")]), length_ns


def _ratio(part: IntArray, whole: IntArray | float) -> FloatArray:
    """Return part of whole; NaN where the whole is nothing."""
    nothing = np.full(np.shape(part), np.nan)
    return np.asarray(np.divide(part, whole, out=nothing, where=np.asarray(whole) > 0))
