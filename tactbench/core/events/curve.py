"""All thresholds of a score at once, and the one chosen on validation.

The idea is that of sed_scores_eval (Ebbers, Haeb-Umbach and Serizel 2022, Threshold independent evaluation of sound
event detection scores, ICASSP): between two neighbouring thresholds at which an alarm appears, moves or goes, nothing
changes, so that a curve over those thresholds has no error of a grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tactbench.core.errors import DataError
from tactbench.core.events.alarms import check_times, kept
from tactbench.core.events.metrics import EventScores, GroundTruth, TimeBase, latency_s
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.events import AlarmPolicy, nanoseconds


@dataclass(frozen=True)
class ScoredRecording:
    """A detector's score over one recording, and what happened in it."""

    t_ns: IntArray
    """(n,) when each score is known, the detector's compute time included [ns]."""
    score: FloatArray
    """(n,) a frame is active where ``score >= threshold``; NaN: no answer yet, never active."""
    truth: GroundTruth


@dataclass(frozen=True)
class ThresholdCurve:
    """Scores at every threshold at which they change."""

    threshold: FloatArray
    """(k,) rising; the last is infinity, where there is no alarm. Row i holds for all thresholds above the one before,
    up to its own."""
    scores: EventScores
    """Of shape (k,)."""

    def at(self, threshold: float) -> EventScores:
        """Return the scores at any threshold; raises DataError for NaN or minus infinity."""
        if np.isnan(threshold) or threshold == -np.inf:
            raise DataError(f"{threshold} is no threshold.", hint="Give a number, or infinity for no alarm.")
        return self.scores.row(int(np.searchsorted(self.threshold, threshold, side="left")))

    def operating_point(self, max_false_alarms_per_minute: float) -> float:
        """Return the threshold of largest recall among those with at most so many false alarms per minute.

        Of equal recalls the larger F1 decides, then the higher threshold. Infinity: no finite one keeps the bound and
        hits anything. It is chosen on validation recordings and applied to others with :meth:`at`.

        Notes
        -----
        The rate need not fall with the threshold (a score that is always active is one segment and one alarm), so all
        rows are looked at.
        """
        rate = self.scores.false_alarms_per_minute
        if np.any(np.isnan(rate)) or self.scores.latency_s.shape[-1] == 0:
            raise DataError(
                "No operating point can be chosen: there is no event, or no second to count false alarms on.",
                hint="Give validation recordings with both, or another time base of the policy.",
            )
        f1 = self.scores.f1
        order = np.lexsort((self.threshold, f1, self.scores.recall))
        return float(self.threshold[order[rate[order] <= max_false_alarms_per_minute][-1]])


def threshold_curve(recordings: Sequence[ScoredRecording], policy: AlarmPolicy) -> ThresholdCurve:
    """Return the scores of all recordings together at every threshold, exactly.

    Notes
    -----
    Every frame raises an alarm, refractory time aside, for the thresholds of one interval (:func:`alarm_levels`), found
    for all frames together. Only refractory time and matching are done threshold by threshold, over alarms instead of
    frames.
    """
    pieces = [_of_one(recording, policy) for recording in recordings]
    threshold = np.unique(np.concatenate([[np.inf], *(piece.threshold for piece in pieces)]))
    rows = [np.searchsorted(piece.threshold, threshold, side="left") for piece in pieces]
    n_alarms, n_false = np.zeros(threshold.size, dtype=np.int64), np.zeros(threshold.size, dtype=np.int64)
    latencies = [np.zeros((threshold.size, 0))]
    for piece, row in zip(pieces, rows, strict=True):
        n_alarms += piece.scores.n_alarms[row]
        n_false += piece.scores.n_false_alarms[row]
        latencies.append(piece.scores.latency_s[row])
    base_s = sum(TimeBase.of(recording.truth, policy).length_ns for recording in recordings) / 1e9
    return ThresholdCurve(threshold, EventScores(n_alarms, n_false, base_s, np.concatenate(latencies, axis=1)))


def _of_one(recording: ScoredRecording, policy: AlarmPolicy) -> ThresholdCurve:
    low, high = alarm_levels(recording.t_ns, recording.score, policy)
    raises = low < high
    t, low, high = recording.t_ns[raises], low[raises], high[raises]
    levels = np.concatenate([low, high, [np.inf]])
    threshold = np.unique(levels[levels > -np.inf])
    onset, base = recording.truth.event_ns[:, 0], TimeBase.of(recording.truth, policy)
    counted, refractory = base.holds(t), nanoseconds(policy.refractory_s)
    n_alarms, n_false = np.zeros(threshold.size, dtype=np.int64), np.zeros(threshold.size, dtype=np.int64)
    latency = np.full((threshold.size, onset.size), np.nan)
    for row, level in enumerate(threshold):
        raised = np.flatnonzero((low < level) & (level <= high))
        left = raised[kept(t[raised], refractory)]
        n_alarms[row] = left.size
        n_false[row] = counted[left].sum()
        latency[row] = latency_s(onset, t[left], policy)
    return ThresholdCurve(threshold, EventScores(n_alarms, n_false, base.length_ns / 1e9, latency))


def alarm_levels(t_ns: IntArray, score: FloatArray, policy: AlarmPolicy) -> tuple[FloatArray, FloatArray]:
    """Return (n,) lower (excluded) and upper (included) thresholds between which each frame raises an alarm.

    Without refractory time, frame i raises an alarm at exactly the thresholds in ``(low[i], high[i]]``.

    Notes
    -----
    Let a frame *qualify* at a threshold if it is active and its segment began at least the minimum length before. It
    does so up to ``high``: the least of its own score and of the levels up to which each interval between frames, back
    to that length ago, lies within a segment. It raises the alarm unless an active frame directly before it in its
    segment qualifies too: ``low`` is the largest ``high`` among the frame before and those within the merging gap.
    Takes O(n d) for d frames within the longer of merging gap and minimum length.
    """
    check_times(t_ns, score.shape)
    if np.any(np.isinf(score)):
        raise DataError("A score is infinite.", hint="Give finite scores, or NaN where there is no answer yet.")
    n = score.size
    score = np.where(np.isnan(score), -np.inf, score)
    gap, length = nanoseconds(policy.merge_gap_s), nanoseconds(policy.minimum_length_s)
    place = np.arange(n)
    within = np.minimum(np.searchsorted(t_ns, t_ns - gap, side="left"), place - 1)  # the first that joins directly
    since = np.searchsorted(t_ns, t_ns - length, side="right") - 1  # the last at least the length ago
    bridge = _bridges(t_ns, score, gap, int(np.max(place - within, initial=0)))
    high = np.where(since < 0, -np.inf, np.minimum(score, -_range_max(-bridge, np.maximum(since, 0), place)))
    low = _range_max(high, np.maximum(within, 0), place)
    return low, np.asarray(high)


def _bridges(t_ns: IntArray, score: FloatArray, gap_ns: int, reach: int) -> FloatArray:
    """Return (n - 1,) up to which threshold each interval between frames lies within a segment.

    That is the largest ``min(score[i], score[j])`` over all pairs around it that join: neighbours, or within the gap.
    """
    if score.size < 2:
        return np.zeros(0)
    best = np.full(score.size - reach - 1, -np.inf)  # of pairs (i, i + lag), and wider ones around them
    for lag in range(reach, 0, -1):
        wider, best = best, np.minimum(score[:-lag], score[lag:])
        if lag > 1:
            best[t_ns[lag:] - t_ns[:-lag] > gap_ns] = -np.inf
        best[:-1] = np.maximum(best[:-1], wider)
        best[1:] = np.maximum(best[1:], wider)
    return np.asarray(best)


def _range_max(values: FloatArray, first: IntArray, end: IntArray) -> FloatArray:
    """Return (n,) the largest of ``values[first:end]``; minus infinity where that is empty."""
    if first.size == 0:
        return np.zeros(0)
    padded = np.concatenate([values, [-np.inf, -np.inf]])  # reduceat wants every place to exist
    found = np.maximum.reduceat(padded, np.column_stack([first, end]).ravel())[::2]
    return np.asarray(np.where(first < end, found, -np.inf))
