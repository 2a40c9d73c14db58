"""Raise alarms from frames, match alarms with true events, and compute hits, latency and false alarms per minute.

The curve over all thresholds follows sed_scores_eval (Ebbers, Haeb-Umbach and Serizel 2022, Threshold independent
evaluation of sound event detection scores, ICASSP): alarms change only at certain thresholds, so that it is exact.
Metrics of single frames are in :mod:`tactbench.core.evaluation.metrics` (``balanced_accuracy``, ``macro_f1``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.events import AlarmPolicy, nanoseconds


def alarms(t_ns: IntArray, active: npt.NDArray[np.bool_], policy: AlarmPolicy) -> IntArray:
    """Return the (m,) times of alarms [ns], in rising order.

    Parameters
    ----------
    t_ns
        (n,) end of each frame [ns], strictly rising. The caller adds the detector's computing time, if wanted. Adjacent
        frames are taken as consecutive, so that the caller must divide the data where samples are lost.
    active
        (n,) True for frames classified as event, for example ``score >= threshold``.
    policy
        Largest gap to merge, minimum length and refractory time.

    Notes
    -----
    An alarm at time t depends on frames up to t alone. Active frames belong to one segment if they are adjacent or at
    most `merge_gap_s` apart. A segment raises one alarm, at its first active frame at least `minimum_length_s` after
    its first frame, and never within a gap, which may not be bridged. An alarm less than `refractory_s` after the
    previous alarm kept is dropped.
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
    """Return the indices of the alarms kept under the refractory time [ns]; the given times [ns] must be rising."""
    following = np.searchsorted(raised_ns, raised_ns + max(refractory_ns, 1)).tolist()
    places, place = [], 0
    while place < len(following):
        places.append(place)
        place = following[place]
    return np.asarray(places, dtype=np.int64)


def match(onset_ns: IntArray, alarm_ns: IntArray, policy: AlarmPolicy) -> tuple[IntArray, IntArray]:
    """Match onsets of events with alarms; return the indices of matched onsets and, in pairs, of their alarms.

    Parameters
    ----------
    onset_ns, alarm_ns
        (n,) and (m,) rising times [ns].
    policy
        Policy whose window limits pairs: an alarm matches an onset from `window_before_s` before the onset to
        `window_after_s` after it, both ends included.

    Notes
    -----
    In order of time, each event is paired with the earliest unpaired alarm in its window. All windows are equally long,
    so that their starts and ends are in the same order: a skipped alarm is too early for all later events, and taking
    the earliest alarm leaves later events at least as many alarms. The number of pairs is therefore the largest
    possible [1]_ (a convex bipartite graph whose intervals do not nest).

    Of all largest matchings, the matching with the earliest alarms is returned: if two alarms are in the window of one
    event, the first gives the latency, and the second is a false positive.

    References
    ----------
    .. [1] Glover 1967, Maximum matching in a convex bipartite graph, Naval Research Logistics Quarterly 14, 313-316.
    """
    before, after = nanoseconds(policy.window_before_s), nanoseconds(policy.window_after_s)
    pairs, place = [], 0
    for event, onset in enumerate(onset_ns.tolist()):
        place += int(np.searchsorted(alarm_ns[place:], onset - before))
        if place < len(alarm_ns) and alarm_ns[place] <= onset + after:
            pairs.append((event, place))
            place += 1
    events, hits = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    return events, hits


@dataclass(frozen=True)
class GroundTruth:
    """The true events of one recording, and the time in which alarms are possible."""

    event_ns: IntArray
    """(e, 2) onset and end of each event [ns]."""
    disturbance: bool
    """True if the whole recording is a disturbance without event: a press, a tap, a motor that starts."""
    span_ns: tuple[int, int]
    """Start and end (excluded) of the time in which the detector could raise alarms [ns]."""


@dataclass(frozen=True)
class EventScores:
    """Counts of alarms and latencies of events over several recordings, and scores such as recall and precision.

    The shape (...) is () for one set of alarms and (k,) for k thresholds. Undefined scores are NaN: precision without
    an alarm, recall without an event, a rate over zero seconds, a latency without a hit.
    """

    n_alarms: IntArray
    """(...) numbers of all alarms, including alarms at times in which false alarms are not counted."""
    n_false_alarms: IntArray
    """(...) numbers of alarms within the time base, the time in which every alarm counts as false."""
    base_ns: int
    """Length of the time base of false alarms [ns], over all recordings."""
    latency_s: FloatArray
    """(..., e) time of the alarm minus onset, for each event [s]; negative for an early alarm, NaN for a miss."""

    @property
    def n_hits(self) -> IntArray:
        """Return the numbers of events for which an alarm came, an array of shape (...)."""
        return np.asarray(np.isfinite(self.latency_s).sum(axis=-1), dtype=np.int64)

    @property
    def n_misses(self) -> IntArray:
        """Return the (...) numbers of events that no alarm hit."""
        return np.asarray(self.latency_s.shape[-1] - self.n_hits)

    @property
    def recall(self) -> FloatArray:
        """Return the (...) recall: hits over events."""
        return _ratio(self.n_hits, self.latency_s.shape[-1])

    @property
    def precision(self) -> FloatArray:
        """Return the (...) precision: hits over alarms; a second alarm for the same event is not a hit."""
        return _ratio(self.n_hits, self.n_alarms)

    @property
    def f1(self) -> FloatArray:
        """Return the (...) F1 scores: twice the hits over the sum of alarms and events."""
        return _ratio(2 * self.n_hits, self.n_alarms + self.latency_s.shape[-1])

    @property
    def false_alarms_per_minute(self) -> FloatArray:
        """Return the (...) rates of false alarms: their number per minute of the time base [1/min]."""
        return _ratio(self.n_false_alarms, self.base_ns / 1e9 / 60.0)

    def latency_percentile_s(self, percent: float) -> float:
        """Return a percentile [s] of the latency over the events hit, for one set of alarms; NaN without a hit.

        Always show it with :attr:`n_misses`: a detector that hits only the easy events has low latencies.
        """
        hits = self.latency_s[np.isfinite(self.latency_s)]
        return float(np.percentile(hits, percent)) if hits.size else np.nan

    def row(self, place: Any) -> EventScores:
        """Return the scores at one threshold, or at several, selected by index."""
        return EventScores(self.n_alarms[place], self.n_false_alarms[place], self.base_ns, self.latency_s[place])


def score_events(truths: Sequence[GroundTruth], alarms_ns: Sequence[IntArray], policy: AlarmPolicy) -> EventScores:
    """Score the alarm times [ns] against the true events, recording by recording, and add up the counts.

    Notes
    -----
    Precision, recall and F1 are those of onset detection [1]_: matched pairs over all alarms, or over all events. The
    latency is the signed offset of [2]_; unlike there, further alarms within one window are false positives. Alarms
    outside the time base (a second alarm in a window, an alarm late in an event) lower the precision, but do not
    raise the rate of false alarms.

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
    """Return the (e,) latencies [s], time of the matched alarm minus onset of each event; NaN for a miss."""
    latency = np.full(onset_ns.size, np.nan)
    event, alarm = match(onset_ns, alarm_ns, policy)
    latency[event] = (alarm_ns[alarm] - onset_ns[event]) / 1e9
    return latency


def time_base(truth: GroundTruth, policy: AlarmPolicy, t_ns: IntArray) -> tuple[IntArray, int]:
    """Return (n,) 1 for times within the time base of false alarms, else 0, and the length of the time base [ns].

    The time base is the time that the policy names, as half-open intervals, without all events and their windows.
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
    """Return `part` divided by `whole`; NaN where the latter is zero."""
    nothing = np.full(np.shape(part), np.nan)
    return np.asarray(np.divide(part, whole, out=nothing, where=np.asarray(whole) > 0))


@dataclass(frozen=True)
class ScoredRecording:
    """A detector's scores of the frames of one recording, and the recording's true events."""

    t_ns: IntArray
    """(n,) time at which the score of each frame is available [ns]."""
    score: FloatArray
    """(n,) scores; a frame is active if ``score >= threshold``, and never if its score is NaN (no answer)."""
    truth: GroundTruth


@dataclass(frozen=True)
class ThresholdCurve:
    """Event scores at every threshold at which alarms change."""

    threshold: FloatArray
    """(k,) rising thresholds; the last is infinity, without alarms. Row i of `scores` holds for thresholds above
    ``threshold[i - 1]`` and up to ``threshold[i]``."""
    scores: EventScores
    """Scores of shape (k,), one row for each threshold."""

    def at(self, threshold: float | FloatArray) -> EventScores:
        """Return the scores at one finite or infinite threshold above minus infinity, or at an array of thresholds."""
        return self.scores.row(np.searchsorted(self.threshold, threshold, side="left"))

    def operating_point(self, max_false_alarms_per_minute: float) -> float:
        """Return the threshold with the largest recall, within a given bound of false alarms per minute.

        Ties are broken by the larger F1, then by the higher threshold. Infinity is returned if no finite threshold
        within the bound is better. Choose it on validation recordings, and apply it to others with :meth:`at`.

        Notes
        -----
        A higher threshold need not lower the rate of false alarms (if all frames are active, they are one segment with
        one alarm), so all thresholds are compared.
        """
        return float(self.threshold[self._allowed(max_false_alarms_per_minute)[0]])

    def found_share(self, max_false_alarms_per_minute: float) -> FloatArray:
        """Return (e,) shares of the bounds of false alarms, from 0 to this maximum, at which each event is hit.

        For each bound, the threshold is the operating point on these recordings. The mean over events is the area
        under recall over false alarms per minute up to the maximum, divided by the maximum.

        Notes
        -----
        A partial area under a curve, normalised (McClish 1989, Analyzing a portion of the ROC curve, Medical Decision
        Making 9, 190-195), over false alarms per time as in Bilen et al. 2020, A framework for the robust evaluation of
        sound event detection, ICASSP. The curve is a rising step function, without interpolation between points.
        """
        best = self._allowed(max_false_alarms_per_minute)
        rate = self.scores.false_alarms_per_minute[best]
        until = np.minimum.accumulate(np.append(max_false_alarms_per_minute, rate))[:-1]
        share = np.maximum(until - rate, 0.0) / max_false_alarms_per_minute
        return np.asarray(share @ np.isfinite(self.scores.latency_s[best]))

    def _allowed(self, max_false_alarms_per_minute: float) -> IntArray:
        """Return the indices of thresholds within a given bound of false alarms per minute, best first."""
        rate = self.scores.false_alarms_per_minute
        if np.any(np.isnan(rate)) or self.scores.latency_s.shape[-1] == 0:
            raise DataError(
                "No threshold can be chosen: the recordings have no event, or no disturbance to count false alarms in.",
                hint="Give validation and every fold's test recordings with events and of disturbances (label "
                "`event: disturbance`), choose another split, or change `false_alarm_time` of the policy.",
            )
        order = np.lexsort((self.threshold, self.scores.f1, self.scores.recall))[::-1]
        return np.asarray(order[rate[order] <= max_false_alarms_per_minute])


def threshold_curve(recordings: Sequence[ScoredRecording], policy: AlarmPolicy) -> ThresholdCurve:
    """Return the scores over all recordings together, at every threshold at which an alarm changes."""
    pieces = [_of_one(recording, policy) for recording in recordings]
    threshold = np.unique(np.concatenate([[np.inf], *(piece.threshold for piece in pieces)]))
    rows = [piece.at(threshold) for piece in pieces]
    none = np.zeros(threshold.size, dtype=np.int64)
    scores = EventScores(
        n_alarms=sum((row.n_alarms for row in rows), none),
        n_false_alarms=sum((row.n_false_alarms for row in rows), none),
        base_ns=sum(row.base_ns for row in rows),
        latency_s=np.concatenate([np.zeros((threshold.size, 0)), *(row.latency_s for row in rows)], axis=1),
    )
    return ThresholdCurve(threshold, scores)


def _of_one(recording: ScoredRecording, policy: AlarmPolicy) -> ThresholdCurve:
    """Return the curve of one recording, at the values of its scores at which alarms change."""
    found = [(np.inf, np.zeros(0, dtype=np.int64))]
    for threshold in np.unique(recording.score[~np.isnan(recording.score)])[::-1]:
        raised = alarms(recording.t_ns, recording.score >= threshold, policy)
        if not np.array_equal(raised, found[-1][1]):
            found.append((float(threshold), raised))
    found.reverse()
    each = [score_events([recording.truth], [raised], policy) for _, raised in found]
    scores = EventScores(
        np.array([one.n_alarms for one in each]),
        np.array([one.n_false_alarms for one in each]),
        each[0].base_ns,
        np.array([one.latency_s for one in each]),
    )
    return ThresholdCurve(np.array([threshold for threshold, _ in found]), scores)
