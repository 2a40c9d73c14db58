"""Specification of a task: target, features, metric, protocols and scenes."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Final, Literal

from pydantic import Field, model_validator

from tactbench.core.errors import nearest
from tactbench.core.spec.events import AREA_PER_MINUTE, AlarmPolicy, SlipTarget
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.sensor import ChannelKind

METRICS: Final = (
    "rmse", "mae", "mean_euclidean_error", "r2", "accuracy", "balanced_accuracy", "macro_f1", "recall_area",
)  # fmt: skip
"""Names of the metrics that a task may have."""

WHERE = r"^[A-Za-z_][\w.]*:[A-Za-z_]\w*$"
"""Pattern of a place of code, ``module:callable``."""


class PlannedScene(Frozen):
    """A scene, and the role of its recording."""

    scene: Scene
    role: Role
    drawn_order: str = ""
    """Name of a group whose scenes follow each other in an order drawn with the seed; empty: as declared."""


def in_drawn_order(planned: Sequence[PlannedScene], seed: int) -> tuple[PlannedScene, ...]:
    """Return the scenes with those of each group of `drawn_order` in an order drawn with `seed`.

    The members of a group exchange their places in the sequence and their starting times, so that a scene is
    independent of how warm the sensor is. They are ordered by a hash (BLAKE2) of seed, group and name: uniform over all
    orders, and the same on every machine and in every task that has the group.
    """

    def draw(item: PlannedScene) -> bytes:
        text = "\x1f".join((str(seed), item.drawn_order, item.scene.name))
        return hashlib.blake2b(text.encode(), digest_size=16).digest()

    found = list(planned)
    for group in dict.fromkeys(item.drawn_order for item in planned if item.drawn_order):
        places = [place for place, item in enumerate(planned) if item.drawn_order == group]
        times = sorted(planned[place].scene.starts_after_s for place in places)
        members = sorted((planned[place] for place in places), key=draw)
        for place, start, item in zip(places, times, members, strict=True):
            scene = item.scene.model_copy(update={"starts_after_s": start})
            found[place] = item.model_copy(update={"scene": scene})
    return tuple(found)


class ChannelTarget(Frozen):
    """A target that is a channel of the reference, sample by sample."""

    source: Literal["channel"] = "channel"
    kind: ChannelKind = "force"
    name: str | None = None
    """Name of the channel, where a recording has several of this kind; None: the only one, or the one called
    `normal`."""
    unit: str = "N"
    reduce: Literal["mean", "max"] | None = None
    """Reduction of the samples of a recording to its number, for `answer_per: recording`."""


VECTOR_METRIC: Final = "mean_euclidean_error"
"""Metric of vectors."""


class VectorTarget(Frozen):
    """A target that is several channels of the reference; a row without a value of one of them has no label."""

    source: Literal["vector"] = "vector"
    kind: ChannelKind = "position"
    """Kind of every component."""
    names: tuple[str, ...] = Field(min_length=1)
    """Names of the channels, one for each component."""
    unit: str
    """Unit of every component, and so of the length of a difference."""

    @property
    def components(self) -> tuple[ChannelTarget, ...]:
        """The components, each as a target of its own."""
        return tuple(ChannelTarget(kind=self.kind, name=name, unit=self.unit) for name in self.names)


class LabelTarget(Frozen):
    """A target that is a label of the recording, or of each row (an annotation)."""

    source: Literal["label"] = "label"
    name: str
    unit: str = "1"


class Published(Frozen):
    """A published figure for a task, which is shown beside the rows that it is comparable with."""

    score: float
    reference: str
    protocol: str
    """Protocol of the rows beside which it is shown."""
    sensor: str | None = None
    """Name of the sensor; None: any."""
    estimator: str | None = None
    """Name of the estimator; None: another model than ours, which `remark` describes."""
    split: str | None = None
    """Name of the split; None: any."""
    title: str = ""
    """Title in a few words, for a table of reproductions."""
    remark: str = ""
    """Differences to our evaluation that a reader must know."""


class Summary(Frozen):
    """A number for each channel over a window, from the channel's own samples up to the window's end.

    Nothing is resampled: each stream is summarised on its own clock.
    """

    measure: Literal["mean", "deviation", "minimum", "maximum", "range", "change", "mean-step", "band-energy"]
    """``mean``; ``deviation``: standard deviation; ``range``: maximum less minimum; ``change``: last less first;
    ``mean-step``: mean absolute difference of neighbouring samples; ``band-energy``: mean square of what a causal
    band-pass (Butterworth, two poles at either end) leaves, in the channel's unit squared."""
    start: float = Field(default=0.0, ge=0)
    end: float = Field(default=1.0, gt=0)
    unit: Literal["recording", "s"] = "recording"
    """Unit of `start` and `end`: shares of each stream's samples, or seconds. Both count from the first sample that the
    protocol keeps; in a frame, they are shares of its length or seconds from its beginning."""
    band_hz: tuple[float, float] | None = None
    """Ends of the band of ``band-energy`` [Hz]; None for other measures."""
    kinds: tuple[ChannelKind, ...] = ()
    """Kinds of channels; empty: all that the task uses."""

    @model_validator(mode="after")
    def _one_window_one_band(self) -> Summary:
        if not self.start < self.end:
            raise ValueError("a window ends after it starts")
        if self.unit == "recording" and self.end > 1:
            raise ValueError("a window in shares of a recording ends at 1 at the latest; set unit: s for seconds")
        if (self.measure == "band-energy") != (self.band_hz is not None):
            raise ValueError("band_hz belongs to band-energy, which needs it")
        if self.band_hz and not 0 < self.band_hz[0] < self.band_hz[1]:
            raise ValueError("a band's lower end is above 0 Hz and below its upper end")
        return self

    @property
    def name(self) -> str:
        """Name in features and rows."""
        band = "" if self.band_hz is None else f" {self.band_hz[0]:g}-{self.band_hz[1]:g} Hz"
        whole = self.unit == "recording" and (self.start, self.end) == (0.0, 1.0)
        unit = "s" if self.unit == "s" else "of the recording"
        kinds = f" of {', '.join(self.kinds)}" if self.kinds else ""
        return f"{self.measure}{band}{'' if whole else f' {self.start:g}-{self.end:g} {unit}'}{kinds}"


class TaskFields(Frozen):
    """Fields of tasks of plugins and of those that mappings declare."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_-]*$")
    title: str = ""
    question: str = ""
    """The question in one sentence."""
    features: tuple[ChannelKind, ...] = ("taxel",)
    """Kinds of channels that an estimator may use."""
    optional_features: tuple[ChannelKind, ...] = ()
    """Further kinds, used where a sensor has them."""
    summaries: tuple[Summary, ...] = ()
    """Numbers of each channel that are the features of a recording or of a frame."""
    vote: Literal["frames"] | None = None
    """Combination of frames to the answer for a recording: the commonest class, the first of equals, or the mean."""


class TaskSpec(TaskFields):
    """A task as data, which the core carries out."""

    title: str
    question: str
    kind: Literal["regression", "classification", "events"]
    """Kind of answer. For `events`, it is when something begins: detectors score frames, `alarms` makes alarms."""
    target: ChannelTarget | VectorTarget | LabelTarget | SlipTarget
    answer_per: Literal["sample", "recording", "frame"] = "sample"
    """Unit of an answer. `recording`: one class or number for each, by `summaries` and `features_by` or by `vote`;
    its label does not change within a recording. `frame`: one for each window of the target's length."""
    alarms: AlarmPolicy | None = None
    """Rules of alarms, for events."""
    max_false_alarms_per_minute: float | None = Field(default=None, ge=0)
    """Largest rate of false alarms on validation recordings [1/min], below which the threshold of largest recall is
    chosen."""
    features_by: str | None = Field(default=None, pattern=WHERE)
    """``module:callable`` for features of the task's own beside `summaries`, called with a recording as a tuple of
    :class:`tactbench.plugin.StreamReadings`: numbers by name, with the same names for every recording."""
    metric: str
    """Name of the primary metric; see docs/glossary.md."""
    unit: str = "1"
    """Unit of the primary metric."""
    equivalence: float | None = Field(default=None, ge=0)
    """Largest difference of scores that are the same in practical use, in the metric's unit; None: not stated."""
    scenes: tuple[PlannedScene, ...] = ()
    """Scenes that a rig records; empty: only recordings made elsewhere can answer."""
    campaigns: dict[str, tuple[PlannedScene, ...]] = Field(default_factory=dict)
    """Scenes that a rig records for a split instead of `scenes`, by its name; such a split leaves its groups out one by
    one. Scenes of one name are the same in every campaign."""
    protocols: tuple[str, ...]
    """Names of the allowed protocols, the default first."""
    splits: tuple[str, ...] = ()
    """Splits for the protocol `deployable`, the default first: roles, session, in-session, few-shot-N, or a group's
    name."""
    estimators: tuple[str, ...]
    """Names of the default estimators."""
    baselines: tuple[str, ...]
    """Names of the trivial estimators, which stand in every table; others are measured by the best of them."""
    published: tuple[Published, ...] = ()
    beside: tuple[str, ...] = ()
    """Names of tasks that are run whenever this one is, to be read beside it."""
    replicates: int | None = Field(default=None, ge=1)
    """Default number of replicates on a simulated rig; None: that of any task."""

    @model_validator(mode="after")
    def _has_a_metric_that_fits(self) -> TaskSpec:
        if self.metric not in METRICS:
            close = nearest(self.metric, METRICS) or METRICS
            raise ValueError(f"there is no metric {self.metric!r}; did you mean {' or '.join(close)}?")
        if self.kind == "classification" and isinstance(self.target, ChannelTarget):
            raise ValueError(
                f"a channel of kind {self.target.kind} is a number: give classes or a threshold (a LabelTarget or a "
                "SlipTarget), or kind: regression"
            )
        vector = isinstance(self.target, VectorTarget)
        if vector and self.kind != "regression":
            raise ValueError("a vector is predicted by kind: regression")
        if vector != (self.metric == VECTOR_METRIC):
            raise ValueError(f"metric {VECTOR_METRIC} and a target that is a vector belong together")
        return self

    @model_validator(mode="after")
    def _frames_are_answered_in_one_way(self) -> TaskSpec:
        framed = isinstance(self.target, SlipTarget)
        if framed != (self.answer_per == "frame"):
            raise ValueError("answer_per: frame and a target of frames belong together")
        if framed and (not self.summaries or self.features_by or self.vote):
            raise ValueError("answer_per: frame needs summaries, and neither features_by nor vote")
        if framed and "in-session" in self.splits:
            raise ValueError("split in-session cuts recordings in time; frames look back across a cut")
        if (self.kind == "events") != (self.alarms is not None and self.max_false_alarms_per_minute is not None):
            raise ValueError("kind: events needs alarms and max_false_alarms_per_minute, which belong to it")
        if self.kind == "events" and not framed:
            raise ValueError("kind: events needs a target of frames")
        return self

    @model_validator(mode="after")
    def _recordings_are_answered_in_one_way(self) -> TaskSpec:
        if self.answer_per == "frame":
            return self
        summarised = bool(self.summaries or self.features_by)
        reduced = isinstance(self.target, ChannelTarget) and self.target.reduce is not None
        if self.answer_per == "sample":
            if summarised or self.vote or reduced:
                raise ValueError("summaries, features_by, vote and a channel's reduce belong to answer_per: recording")
            return self
        if summarised == bool(self.vote):
            raise ValueError("answer_per: recording needs either summaries or features_by, or else vote: frames")
        if not isinstance(self.target, LabelTarget) and not reduced:
            raise ValueError("answer_per: recording needs a label, or a channel with `reduce`")
        if "in-session" in self.splits:
            raise ValueError("split in-session cuts recordings in time; answer_per: recording takes each as a whole")
        if unseen := {kind for one in self.summaries for kind in one.kinds} - set(self.looks_at):
            raise ValueError(f"summaries of {', '.join(sorted(unseen))}, which the task's features do not have")
        return self

    @property
    def looks_at(self) -> tuple[ChannelKind, ...]:
        """Kinds of channels that an estimator may use where a sensor has them."""
        return (*self.features, *self.optional_features)

    @property
    def answer_from(self) -> str:
        """Description of what an answer is made of, with the rules of events; empty where answers are of samples."""
        if self.alarms is not None:
            return (
                f"{self.target}; {self.alarms}; recall area up to {AREA_PER_MINUTE:g} false alarms a "
                f"minute; threshold by validation: at most {self.max_false_alarms_per_minute:g} a minute"
            )
        if isinstance(self.target, SlipTarget):
            return str(self.target)
        if self.vote:
            return f"the {'commonest' if self.kind == 'classification' else 'mean'} answer of its frames"
        own = [f"features by {self.features_by}"] if self.features_by else []
        return ", ".join([one.name for one in self.summaries] + own)

    def published_for(self, sensor: str, protocol: str, estimator: str, split: str | None) -> Published | None:
        """Return the published figure for a result, one for this sensor first; None: none is comparable."""
        fitting = (
            one for one in self.published if one.protocol == protocol and one.sensor in (None, sensor)
            and one.estimator in (None, estimator) and (split is None or one.split in (None, split))
        )  # fmt: skip
        return min(fitting, key=lambda one: (one.sensor is None, one.estimator is None), default=None)

    def scenes_for(self, split: str | None) -> tuple[PlannedScene, ...]:
        """Return the scenes that a rig records for `split`, as declared; None is the default split."""
        return self.scenes if split is None else self.campaigns.get(split, self.scenes)
