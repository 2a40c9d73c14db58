"""Scores of a detector at all thresholds, and the choice of a threshold on validation recordings.

The method is that of sed_scores_eval (Ebbers, Haeb-Umbach and Serizel 2022, Threshold independent evaluation of sound
event detection scores, ICASSP): alarms change only at certain thresholds, so that a curve over these thresholds is
exact, unlike one over a grid.
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
        """Return the threshold with the largest recall, within this bound of false alarms per minute.

        Ties are broken by the larger F1, then by the higher threshold. Infinity is returned if no finite threshold
        within the bound is better. Choose it on validation recordings, and apply it to others with :meth:`at`.

        Notes
        -----
        A higher threshold need not lower the rate of false alarms (if all frames are active, they are one segment with
        one alarm), so all thresholds are compared.
        """
        return float(self.threshold[self._allowed(max_false_alarms_per_minute)[0]])

    def found_share(self, max_false_alarms_per_minute: float) -> FloatArray:
        """Return, for each event, the share of bounds from 0 to this maximum of false alarms at which it is hit, (e,).

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
        """Return the indices of thresholds within this bound of false alarms per minute, best first."""
        rate = self.scores.false_alarms_per_minute
        if np.any(np.isnan(rate)) or self.scores.latency_s.shape[-1] == 0:
            raise DataError(
                "No operating point can be chosen: there is no event, or no time in which to count false alarms.",
                hint="Add recordings with events and of disturbances, or change `false_alarm_time` of the policy.",
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
    """Return the curve of one recording, at those values of its score at which alarms change."""
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
