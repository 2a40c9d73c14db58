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
from tactbench.core.events.alarms import EventScores, GroundTruth, alarms, score_events
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.events import AlarmPolicy


@dataclass(frozen=True)
class ScoredRecording:
    """A detector's score over one recording, and the recording's events."""

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

    def at(self, threshold: float | FloatArray) -> EventScores:
        """Return the scores at any threshold, or several, above minus infinity."""
        return self.scores.row(np.searchsorted(self.threshold, threshold, side="left"))

    def operating_point(self, max_false_alarms_per_minute: float) -> float:
        """Return the threshold of largest recall among those with at most so many false alarms per minute.

        Of equal recalls the larger F1 decides, then the higher threshold. Infinity: no finite one keeps the bound and
        hits anything. It is chosen on validation recordings and applied to others with :meth:`at`.

        Notes
        -----
        The rate need not fall with the threshold (a score that is always active is one segment and one alarm), so all
        rows are looked at.
        """
        return float(self.threshold[self._allowed(max_false_alarms_per_minute)[0]])

    def found_share(self, max_false_alarms_per_minute: float) -> FloatArray:
        """Return (e,) at which share of the rates from 0 to the largest each event is hit.

        At a rate that is allowed the threshold is its operating point on these recordings. The mean over events is the
        area under recall against false alarms per minute up to that rate, over the rate.

        Notes
        -----
        A partial area under a curve, normalised (McClish 1989, Analyzing a portion of the ROC curve, Medical Decision
        Making 9, 190-195), over false alarms per time as in Bilen et al. 2020, A framework for the robust evaluation of
        sound event detection, ICASSP. The curve is a staircase that never falls: nothing is drawn between two points.
        """
        best = self._allowed(max_false_alarms_per_minute)
        rate = self.scores.false_alarms_per_minute[best]
        until = np.minimum.accumulate(np.append(max_false_alarms_per_minute, rate))[:-1]
        share = np.maximum(until - rate, 0.0) / max_false_alarms_per_minute
        return np.asarray(share @ np.isfinite(self.scores.latency_s[best]))

    def _allowed(self, max_false_alarms_per_minute: float) -> IntArray:
        """Return the rows of at most so many false alarms per minute, the best operating point first."""
        rate = self.scores.false_alarms_per_minute
        if np.any(np.isnan(rate)) or self.scores.latency_s.shape[-1] == 0:
            raise DataError(
                "No operating point can be chosen: there is no event, or no second to count false alarms on.",
                hint="Give recordings with both, or another time base of the policy.",
            )
        order = np.lexsort((self.threshold, self.scores.f1, self.scores.recall))[::-1]
        return np.asarray(order[rate[order] <= max_false_alarms_per_minute])


def threshold_curve(recordings: Sequence[ScoredRecording], policy: AlarmPolicy) -> ThresholdCurve:
    """Return the scores of all recordings together at every threshold, exactly."""
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
    """Return the curve of one recording: alarms change at values of its score alone, and not at each of them."""
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
