"""Turn a detector's scores of frames into alarms, match alarms with events, and compute the figures of a result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.summaries import slip_target
from tactbench.core.events.alarms import ScoredRecording, ThresholdCurve, alarms, score_events, threshold_curve
from tactbench.core.samples import Answers, FloatArray, Part
from tactbench.core.spec.events import AREA_PER_MINUTE, AlarmPolicy, nanoseconds
from tactbench.core.spec.task import TaskSpec


@dataclass(frozen=True)
class Scored(ScoredRecording):
    """A detector's scores of all frames of one recording of a data set."""

    place: int
    """Index of the recording in the data set."""
    threshold: float = np.inf
    """Threshold of the fold: frames with this score or a higher score are active."""


@dataclass(frozen=True)
class EventRules:
    """Rules that turn a detector's scores into alarms, and alarms into figures such as recall and latency."""

    policy: AlarmPolicy
    max_false_alarms_per_minute: float
    own_threshold: float | None
    hop_ns: int

    @classmethod
    def of(cls, task: TaskSpec, own_threshold: float | None) -> EventRules:
        """Return the rules of an event detection task; `own_threshold` is the detector's own threshold, or None."""
        assert task.alarms is not None
        assert task.max_false_alarms_per_minute is not None
        hop_ns = nanoseconds(slip_target(task).hop_s)
        return cls(task.alarms, task.max_false_alarms_per_minute, own_threshold, hop_ns)

    def scored(self, part: Part, score: FloatArray, data: Dataset) -> list[Scored]:
        """Return the scores of the frames of a set, divided by recording; NaN for a frame without an answer."""
        found = []
        for place in np.unique(part.recording).tolist():
            mine = part.recording == place
            row, table = part.row[mine], data.tables[place]
            n = int(table.row[-1]) + 1
            first = round(float(table.time_s[0]) * 1e9) - int(table.row[0]) * self.hop_ns
            whole = np.full(n, np.nan)
            whole[row] = score[mine]
            ends_ns = first + self.hop_ns * np.arange(n)
            found.append(Scored(ends_ns, whole, table.slip.truth(ends_ns), place))
        return found

    def choose(self, curve: ThresholdCurve | None) -> float:
        """Return a fold's threshold, from the curve of its validation recordings; or the detector's own threshold."""
        if self.own_threshold is not None:
            return self.own_threshold
        return (curve or threshold_curve([], self.policy)).operating_point(self.max_false_alarms_per_minute)

    def curve(self, several: Sequence[Scored]) -> ThresholdCurve:
        """Return scores over all thresholds; for a detector with a threshold of its own, at that threshold only."""
        own = self.own_threshold
        if own is not None:
            several = [replace(one, score=np.where(one.score >= own, 1.0, np.nan)) for one in several]
        return threshold_curve(several, self.policy)

    def items(self, several: Sequence[Scored], curve: ThresholdCurve, data: Dataset, fold: int) -> Answers:
        """Return one answer for each event: the share of false-alarm rates, up to a fixed limit, at which it is hit.

        The mean of these shares is the area under recall over rate. Before the events of a recording comes a line for
        the recording itself (true 0), to include it in the interval. Row: last frame before the onset; time: the onset.
        """
        ends = np.cumsum([len(one.truth.event_ns) for one in several])
        # A fold without an event has no part in the score.
        shares = np.split(curve.found_share(AREA_PER_MINUTE) if ends[-1] else np.zeros(0), ends[:-1])
        columns = []
        for one, share in zip(several, shares, strict=True):
            table, at_ns = data.tables[one.place], np.append(one.t_ns[:1], one.truth.event_ns[:, 0])
            last = np.searchsorted(np.rint(table.time_s * 1e9), at_ns, side="right") - 1
            rows = table.row[np.maximum(last, 0)]
            columns.append(
                (np.sign(np.arange(len(at_ns))), np.append(0.0, share), np.full(len(at_ns), one.place), rows, at_ns)
            )
        true, hits, place, row, at_ns = map(np.concatenate, zip(*columns, strict=True))
        none, number = np.full(len(true), np.nan), np.full(len(true), fold, dtype=np.int64)
        return Answers(true, hits, place, row, number, np.asarray(at_ns * 1e-9, dtype=np.float64), none)

    def figures(self, tested: Sequence[Scored], compute_s: float | None) -> dict[str, float]:
        """Return figures such as precision, misses and latency over all test recordings, except undefined figures.

        Parameters
        ----------
        compute_s
            Computing time [s] from a frame's end to its answer, added to latencies; None if it was not measured.
        """
        raised = [alarms(one.t_ns, one.score >= one.threshold, self.policy) for one in tested]
        scores = score_events([one.truth for one in tested], raised, self.policy)
        late_s = compute_s or 0.0
        found = {
            "area up to false alarms per minute": AREA_PER_MINUTE,
            "bound of false alarms per minute": self.max_false_alarms_per_minute,
            "events": float(scores.latency_s.shape[-1]),
            "alarms": float(scores.n_alarms),
            "precision": float(scores.precision),
            "F1": float(scores.f1),
            "misses": float(scores.n_misses),
            "recall": float(scores.recall),
            "false alarms per minute": float(scores.false_alarms_per_minute),
            "onset latency p50 ms": 1e3 * (scores.latency_percentile_s(50) + late_s),
            "onset latency p95 ms": 1e3 * (scores.latency_percentile_s(95) + late_s),
        }
        if compute_s is not None:
            found["compute s per s of signal"] = 1e9 * compute_s / self.hop_ns
        return {name: value for name, value in found.items() if np.isfinite(value)}
