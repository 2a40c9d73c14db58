"""From a detector's score a frame to alarms, to what they hit, and to the figures of a row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactbench.core.errors import DataError
from tactbench.core.evaluation.dataset import Dataset, Table
from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.evaluation.slip_reference import SCALES, SlipReference
from tactbench.core.events.alarms import alarms
from tactbench.core.events.curve import ScoredRecording, threshold_curve
from tactbench.core.events.labels import GROSS, UNDECIDED
from tactbench.core.events.matching import match
from tactbench.core.events.metrics import GroundTruth, displacement_at_detection, score_events
from tactbench.core.samples import Answers, FloatArray, IntArray, Part
from tactbench.core.spec.events import AlarmPolicy, SlipTarget, nanoseconds
from tactbench.core.spec.task import TaskSpec

BOUNDS_PER_MINUTE = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""False alarms a minute on validation recordings, at each of which a threshold is chosen to show what latency costs."""


class Scored(NamedTuple):
    """A detector's score of every frame of one recording."""

    place: int
    """which recording of the dataset"""
    t_ns: IntArray
    """(n,) ends of all frames, those without an answer too"""
    score: FloatArray
    """(n,) NaN: no answer"""
    reference: SlipReference

    def truth(self, scale: float = 1.0) -> GroundTruth:
        """Return what happened, under thresholds of labels times `scale`; no event before the first frame counts."""
        span = int(self.t_ns[0]), int(self.t_ns[-1]) + 1
        events = self.reference.labels[scale].gross_ns
        events = events[(events[:, 0] >= span[0]) & (events[:, 0] < span[1])]
        disturbance = np.array([span] if self.reference.disturbance else [], dtype=np.int64).reshape(-1, 2)
        return GroundTruth(events, disturbance, span)


class Items(NamedTuple):
    """What F1 is counted on: events, alarms that hit none, and a line a recording.

    An event is true, and answered if an alarm hit it; an alarm that hit none is answered and not true; the line of a
    recording is neither, so that each recording has a part in the interval. F1 of what is true is the F1 of events.
    """

    y_true: IntArray
    y_pred: IntArray
    recording: IntArray
    row: IntArray
    """the last frame before"""
    time_s: FloatArray
    """of the alarm, or of an onset that was missed"""


class Detected(NamedTuple):
    """What became of one test recording."""

    scored: Scored
    threshold: float
    alarm_ns: IntArray
    at_bounds: tuple[IntArray, ...]
    """Alarms at the thresholds of `BOUNDS_PER_MINUTE`; empty where the detector has a threshold of its own"""


@dataclass(frozen=True)
class EventRules:
    """How a detector's scores become alarms, and what is counted of these."""

    policy: AlarmPolicy
    max_false_alarms_per_minute: float
    own_threshold: float | None
    hop_ns: int

    @classmethod
    def of(cls, task: TaskSpec, own_threshold: float | None) -> EventRules:
        """Return the rules of a task of events."""
        if task.alarms is None or task.max_false_alarms_per_minute is None or not isinstance(task.target, SlipTarget):
            raise DataError(f"Task {task.name!r} asks for no events.", hint="Report this.")
        return cls(task.alarms, task.max_false_alarms_per_minute, own_threshold, nanoseconds(task.target.hop_s))

    def scored(self, part: Part, score: FloatArray, data: Dataset) -> list[Scored]:
        """Return the scores of a set, recording by recording."""
        found = []
        for place in np.unique(part.recording).tolist():
            mine = part.recording == place
            row, table = part.row[mine], data.tables[place]
            n = int(table.row[-1]) + 1
            first = round(float(table.time_s[0]) * 1e9) - int(table.row[0]) * self.hop_ns
            whole = np.full(n, np.nan)
            whole[row] = score[mine]
            found.append(Scored(place, first + self.hop_ns * np.arange(n), whole, _reference(table)))
        return found

    def choose(self, validated: Sequence[Scored]) -> tuple[float, tuple[float, ...]]:
        """Return the threshold of a fold, and those of all bounds; none of a detector with a threshold of its own."""
        if self.own_threshold is not None:
            return self.own_threshold, ()
        curve = threshold_curve([ScoredRecording(one.t_ns, one.score, one.truth()) for one in validated], self.policy)
        try:
            chosen, *bounds = (
                curve.operating_point(bound) for bound in (self.max_false_alarms_per_minute, *BOUNDS_PER_MINUTE)
            )
        except DataError as error:
            raise DataError(
                "No threshold can be chosen: the validation recordings have no slip, or no disturbance to count false "
                "alarms on.",
                hint="Give validation recordings of both (label `event: disturbance`), or another --split.",
            ) from error
        return chosen, tuple(bounds)

    def detect(self, scored: Scored, threshold: float, bounds: Sequence[float]) -> Detected:
        """Return what becomes of a test recording."""
        at_bounds = tuple(self.alarms(scored, each) for each in bounds)
        return Detected(scored, threshold, self.alarms(scored, threshold), at_bounds)

    def alarms(self, one: Scored, threshold: float) -> IntArray:
        """Return when a recording's alarms are known, without the time that computing takes."""
        return alarms(one.t_ns, np.asarray(one.score >= threshold), self.policy)

    def items(self, found: Sequence[tuple[Scored, IntArray]], data: Dataset) -> Items:
        """Return what is counted of some recordings."""
        lines: list[tuple[int, int, int, int, int]] = []
        for one, alarm_ns in found:
            onset = one.truth().event_ns[:, 0]
            hit, by = match(onset, alarm_ns, self.policy)
            lines.append((one.place, int(one.t_ns[0]), 0, 0, 0))
            own = [(int(alarm_ns[alarm]), 1, 1) for alarm in by]
            own += [(int(onset[place]), 1, 0) for place in np.setdiff1d(np.arange(onset.size), hit)]
            own += [(int(alarm_ns[place]), 0, 1) for place in np.setdiff1d(np.arange(alarm_ns.size), by)]
            lines += [(one.place, at, 1, true, answered) for at, true, answered in sorted(own)]
        table = np.array(lines, dtype=np.int64)
        place, at_ns, _, truth, answered = table.T
        row = np.zeros(len(table), dtype=np.int64)
        for number, frames in enumerate(data.tables):
            mine = place == number
            if mine.any():
                t_ns = np.rint(frames.time_s * 1e9).astype(np.int64)
                last = np.searchsorted(t_ns, at_ns[mine], side="right") - 1
                row[mine] = frames.row[np.maximum(last, 0)]
        return Items(truth, answered, place, row, at_ns * 1e-9)

    def figures(self, tested: Sequence[Detected], compute_s: float | None) -> dict[str, float]:
        """Return what is said of the events of all test recordings; what cannot be said is not there.

        Parameters
        ----------
        compute_s
            Seconds from the end of a frame's window to its answer; None: not measured, latencies are without it.
        """
        truths = [one.scored.truth() for one in tested]
        scores = score_events(truths, [one.alarm_ns for one in tested], self.policy)
        late_s = compute_s or 0.0
        moved, start = [], 0
        for one, truth in zip(tested, truths, strict=True):
            n = len(truth.event_ns)
            reference = one.scored.reference
            moved.append(
                displacement_at_detection(
                    truth.event_ns[:, 0], scores.latency_s[start : start + n] + late_s, reference.t_ns,
                    reference.displacement_m,
                )
            )  # fmt: skip
            start += n
        displacement = np.concatenate(moved) if moved else np.zeros(0)
        displacement = displacement[np.isfinite(displacement)]
        found = {
            "events": float(scores.latency_s.shape[-1]),
            "alarms": float(scores.n_alarms),
            "precision": float(scores.precision),
            "recall": float(scores.recall),
            "misses": float(scores.n_misses),
            "onset latency p50 ms": 1e3 * (float(scores.latency_percentile_s(50)) + late_s),
            "onset latency p95 ms": 1e3 * (float(scores.latency_percentile_s(95)) + late_s),
            "false alarms per minute": float(scores.false_alarms_per_minute),
            "minutes of disturbances": scores.base_s / 60,
            "displacement at detection p50 mm": 1e3 * float(np.median(displacement)) if displacement.size else np.nan,
            **_frame_scores(tested),
            **self._other_labels(tested),
        }
        if compute_s is not None:
            found |= {"compute ms a frame": 1e3 * compute_s, "compute s per s of signal": 1e9 * compute_s / self.hop_ns}
        return {name: value for name, value in found.items() if np.isfinite(value)}

    def _other_labels(self, tested: Sequence[Detected]) -> dict[str, float]:
        """Return F1 of the same alarms against labels of halved and doubled thresholds."""
        names = {0.5: "F1 with label thresholds halved", 2.0: "F1 with label thresholds doubled"}
        found = {}
        for scale in SCALES[1:]:
            if all(scale in one.scored.reference.labels for one in tested):
                truths = [one.scored.truth(scale) for one in tested]
                found[names[scale]] = float(score_events(truths, [one.alarm_ns for one in tested], self.policy).f1)
        return found

    def operating_points(self, tested: Sequence[Detected], compute_s: float | None) -> tuple[Mapping[str, float], ...]:
        """Return what test recordings say at thresholds that validation chose for several bounds of false alarms."""
        if self.own_threshold is not None:
            return ()
        truths = [one.scored.truth() for one in tested]
        found = []
        for number, bound in enumerate(BOUNDS_PER_MINUTE):
            scores = score_events(truths, [one.at_bounds[number] for one in tested], self.policy)
            point = {
                "bound": bound,
                "f1": float(scores.f1),
                "recall": float(scores.recall),
                "false alarms per minute": float(scores.false_alarms_per_minute),
                "onset latency p50 ms": 1e3 * (float(scores.latency_percentile_s(50)) + (compute_s or 0.0)),
            }
            found.append({name: value for name, value in point.items() if np.isfinite(value)})
        return tuple(found)


def _frame_scores(tested: Sequence[Detected]) -> dict[str, float]:
    """Return frame scores of gross slip against the rest, over frames that have a label and an answer."""
    truth, given = [], []
    for one in tested:
        state = one.scored.reference.state(one.scored.t_ns, 1.0)
        known = (state != UNDECIDED) & ~np.isnan(one.scored.score)
        truth.append(state[known] == GROSS)
        given.append(one.scored.score[known] >= one.threshold)
    y, predicted = (np.concatenate(each).astype(np.int64) for each in (truth, given))
    if not y.size:
        return {}
    names = {"balanced_accuracy": "frame balanced accuracy", "macro_f1": "frame macro F1"}
    return {text: METRICS[metric].of(y, predicted, 2) for metric, text in names.items()}


def state_figures(tested: Answers, data: Dataset) -> dict[str, float]:
    """Return the scores of the same answers against states of halved and doubled thresholds of labels."""
    found: dict[str, float] = {}
    for scale, text in ((0.5, "halved"), (2.0, "doubled")):
        truth, given = [], []
        for place in np.unique(tested.recording).tolist():
            reference = _reference(data.tables[place])
            if scale not in reference.labels:
                return found
            mine = tested.recording == place
            state = reference.state(np.rint(tested.time_s[mine] * 1e9).astype(np.int64), scale)
            truth.append(state[state != UNDECIDED])
            given.append(tested.y_pred[mine][state != UNDECIDED])
        y, predicted = np.concatenate(truth), np.concatenate(given)
        for name, words in (("macro_f1", "macro F1"), ("balanced_accuracy", "balanced accuracy")):
            if y.size:
                found[f"{words} with label thresholds {text}"] = METRICS[name].of(y, predicted, len(data.classes))
    return found


def _reference(table: Table) -> SlipReference:
    if table.reference is None:
        raise DataError(f"Recording {table.meta.name!r} was read without its reference.", hint="Report this.")
    return table.reference
