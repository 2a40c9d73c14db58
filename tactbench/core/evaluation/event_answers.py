"""Turn a detector's scores of frames into alarms, match alarms with events, and compute the figures of a result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactbench.core.errors import DataError
from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.evaluation.slip_reference import SlipReference
from tactbench.core.evaluation.summaries import slip_target
from tactbench.core.events.alarms import (
    EventScores,
    GroundTruth,
    alarms,
    displacement_at_detection,
    latency_s,
    score_events,
)
from tactbench.core.events.curve import ScoredRecording, ThresholdCurve, threshold_curve
from tactbench.core.events.labels import GROSS, UNDECIDED
from tactbench.core.samples import Answers, FloatArray, IntArray, Part
from tactbench.core.spec.events import AREA_PER_MINUTE, AlarmPolicy, nanoseconds
from tactbench.core.spec.task import TaskSpec

OTHER_SCALES = {0.5: "halved", 2.0: "doubled"}
"""Further factors on the thresholds of the slip labels, and the word for each factor in reports."""
BOUNDS_PER_MINUTE = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Upper bounds of false alarms per minute on validation recordings; for each bound, a threshold is chosen."""


class Scored(NamedTuple):
    """A detector's scores of all frames of one recording, with the slip reference of that recording."""

    place: int
    """Index of the recording in the data set."""
    t_ns: IntArray
    """(n,) end of each frame [ns], including frames without an answer."""
    score: FloatArray
    """(n,) score of each frame; NaN for a frame without an answer."""
    reference: SlipReference
    thresholds: tuple[float, ...] = ()
    """The fold's threshold, then one for each of `BOUNDS_PER_MINUTE` unless the detector has its own; else ()."""

    def truth(self, scale: float = 1.0) -> GroundTruth:
        """Return the events from the first frame on, labelled by slip thresholds multiplied by `scale`."""
        span = int(self.t_ns[0]), int(self.t_ns[-1]) + 1
        events = self.reference.labels[scale].gross_ns
        events = events[(events[:, 0] >= span[0]) & (events[:, 0] < span[1])]
        return GroundTruth(events, self.reference.disturbance, span)


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
        """Return the scores of the frames of a set, divided by recording."""
        found = []
        for place in np.unique(part.recording).tolist():
            mine = part.recording == place
            row, table = part.row[mine], data.tables[place]
            n = int(table.row[-1]) + 1
            first = round(float(table.time_s[0]) * 1e9) - int(table.row[0]) * self.hop_ns
            whole = np.full(n, np.nan)
            whole[row] = score[mine]
            found.append(Scored(place, first + self.hop_ns * np.arange(n), whole, table.slip))
        return found

    def choose(self, curve: ThresholdCurve | None) -> tuple[float, ...]:
        """Return a fold's threshold, then one for each of `BOUNDS_PER_MINUTE`; or only the detector's own threshold."""
        if self.own_threshold is not None:
            return (self.own_threshold,)
        curve, bounds = (
            curve or threshold_curve([], self.policy),
            (self.max_false_alarms_per_minute, *BOUNDS_PER_MINUTE),
        )
        try:
            return tuple(curve.operating_point(bound) for bound in bounds)
        except DataError as error:
            raise DataError(
                "No threshold can be chosen: the validation recordings have no slip, or no disturbance to count false "
                "alarms on.",
                hint="Add validation recordings with slip and with `event: disturbance`, or choose another split.",
            ) from error

    def alarms(self, one: Scored, number: int = 0) -> IntArray:
        """Return the (m,) times [ns] of alarms at threshold `number` of a recording, without the computing time."""
        return alarms(one.t_ns, one.score >= one.thresholds[number], self.policy)

    def curve(self, several: Sequence[Scored]) -> ThresholdCurve:
        """Return scores over all thresholds; for a detector with a threshold of its own, at that threshold only."""
        own = self.own_threshold
        scores = [one.score if own is None else np.where(one.score >= own, 1.0, np.nan) for one in several]
        return threshold_curve(
            [ScoredRecording(one.t_ns, score, one.truth()) for one, score in zip(several, scores, strict=True)],
            self.policy,
        )

    def items(self, several: Sequence[Scored], curve: ThresholdCurve, data: Dataset, fold: int) -> Answers:
        """Return one answer for each event: the share of false-alarm rates, up to a fixed limit, at which it is hit.

        The mean of these shares is the area under recall over rate. Before the events of a recording comes a line for
        the recording itself (true 0), to include it in the interval. Row: last frame before the onset; time: the onset.
        """
        onsets = [one.truth().event_ns[:, 0] for one in several]
        if not sum(map(len, onsets)):
            found = np.zeros(0)  # a fold without an event has no part in the score
        else:
            try:
                found = curve.found_share(AREA_PER_MINUTE)
            except DataError as error:
                raise DataError(
                    "The area under recall over false alarms is undefined: no disturbance to count false alarms in.",
                    hint="Give every fold test recordings of disturbances (label `event: disturbance`).",
                ) from error
        shares = np.split(found, np.cumsum([len(one) for one in onsets])[:-1])
        columns = []
        for one, onset, share in zip(several, onsets, shares, strict=True):
            table, at_ns = data.tables[one.place], np.append(one.t_ns[:1], onset)
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
        late_s = compute_s or 0.0
        moved = []
        for one in tested:
            onset = one.truth().event_ns[:, 0]
            late = latency_s(onset, self.alarms(one), self.policy) + late_s
            moved.append(displacement_at_detection(onset, late, one.reference.t_ns, one.reference.displacement_m))
        displacement = np.concatenate(moved)
        displacement = displacement[np.isfinite(displacement)]
        scores = self._scores(tested)
        found = {
            "area up to false alarms per minute": AREA_PER_MINUTE,
            "bound of false alarms per minute": self.max_false_alarms_per_minute,
            "events": float(scores.latency_s.shape[-1]),
            "alarms": float(scores.n_alarms),
            "precision": float(scores.precision),
            "F1": float(scores.f1),
            "misses": float(scores.n_misses),
            "onset latency p95 ms": 1e3 * (scores.latency_percentile_s(95) + late_s),
            "displacement at detection p50 mm": 1e3 * float(np.median(displacement)) if displacement.size else np.nan,
            **_hits(scores, late_s),
            **_frame_scores(tested),
        }
        for scale, text in OTHER_SCALES.items():
            if all(scale in one.reference.labels for one in tested):
                found[f"F1 with label thresholds {text}"] = float(self._scores(tested, scale=scale).f1)
        if compute_s is not None:
            found["compute s per s of signal"] = 1e9 * compute_s / self.hop_ns
        return {name: value for name, value in found.items() if np.isfinite(value)}

    def operating_points(self, tested: Sequence[Scored], compute_s: float | None) -> list[dict[str, float]]:
        """Return F1, recall, false alarms and latency on test recordings at the threshold for each bound."""
        found = []
        for number, bound in enumerate(BOUNDS_PER_MINUTE if self.own_threshold is None else (), 1):
            scores = self._scores(tested, number)
            point = {"bound": bound, "f1": float(scores.f1), **_hits(scores, compute_s or 0.0)}
            found.append({name: value for name, value in point.items() if np.isfinite(value)})
        return found

    def _scores(self, tested: Sequence[Scored], number: int = 0, scale: float = 1.0) -> EventScores:
        alarms_ns = [self.alarms(one, number) for one in tested]
        return score_events([one.truth(scale) for one in tested], alarms_ns, self.policy)


def _hits(scores: EventScores, late_s: float) -> dict[str, float]:
    return {
        "recall": float(scores.recall),
        "false alarms per minute": float(scores.false_alarms_per_minute),
        "onset latency p50 ms": 1e3 * (scores.latency_percentile_s(50) + late_s),
    }


def _frame_scores(tested: Sequence[Scored]) -> dict[str, float]:
    """Return macro F1 and balanced accuracy of gross slip, over frames with a label and an answer."""
    pairs = []
    for one in tested:
        state = one.reference.state(one.t_ns)
        known = (state != UNDECIDED) & ~np.isnan(one.score)
        pairs.append((state[known] == GROSS, one.score[known] >= one.thresholds[0]))
    return _scores_of(pairs, 2, "frame {}")


def state_figures(tested: Answers, data: Dataset) -> dict[str, float]:
    """Return the scores of answers against slip states labelled by halved and by doubled thresholds."""
    found: dict[str, float] = {}
    for scale, text in OTHER_SCALES.items():
        pairs = []
        for place in np.unique(tested.recording).tolist():
            reference = data.tables[place].slip
            if scale not in reference.labels:
                return found
            mine = tested.recording == place
            state = reference.state(np.rint(tested.time_s[mine] * 1e9).astype(np.int64), scale)
            pairs.append((state[state != UNDECIDED], tested.y_pred[mine][state != UNDECIDED]))
        found |= _scores_of(pairs, len(data.classes), f"{{}} with label thresholds {text}")
    return found


def _scores_of(pairs: Sequence[tuple[IntArray, IntArray]], n_classes: int, text: str) -> dict[str, float]:
    """Return macro F1 and balanced accuracy over (states, answers) of recordings; empty without a frame."""
    y, predicted = (np.concatenate(each) for each in zip(*pairs, strict=True))
    names = {"macro_f1": "macro F1", "balanced_accuracy": "balanced accuracy"} if y.size else {}
    return {text.format(words): METRICS[name].of(y, predicted, n_classes) for name, words in names.items()}
