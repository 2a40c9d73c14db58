"""What a task asks of recordings."""

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
from tactbench.core.spec.summary import Summary

METRICS: Final = (
    "rmse", "mae", "mean_euclidean_error", "r2", "accuracy", "balanced_accuracy", "macro_f1", "recall_area",
)  # fmt: skip
"""Names of metrics, as a task may ask for them."""

WHERE = r"^[A-Za-z_][\w.]*:[A-Za-z_]\w*$"
"""Of code: ``module:callable``."""


class PlannedScene(Frozen):
    """A scene and what the recording of it is for."""

    scene: Scene
    role: Role
    drawn_order: str = ""
    """Name of a group whose scenes follow each other in an order drawn with the seed; empty: as declared."""


def in_drawn_order(planned: Sequence[PlannedScene], seed: int) -> tuple[PlannedScene, ...]:
    """Return the scenes with those of each group of `drawn_order` in an order drawn with `seed`.

    The members of a group share out their own places in the sequence and their own starting times, so that what the
    scene is of and how warm the sensor is by then are independent. Members are ordered by a hash (BLAKE2) of seed,
    group and name: uniform over all orders, the same everywhere, and the same in every task that has the group.
    """
    found = list(planned)
    groups = dict.fromkeys(item.drawn_order for item in planned if item.drawn_order)
    for group in groups:
        places = [place for place, item in enumerate(planned) if item.drawn_order == group]
        times = sorted(planned[place].scene.starts_after_s for place in places)
        members = sorted((planned[place] for place in places), key=lambda item: _draw(seed, group, item.scene.name))
        for place, start, item in zip(places, times, members, strict=True):
            scene = item.scene.model_copy(update={"starts_after_s": start})
            found[place] = item.model_copy(update={"scene": scene})
    return tuple(found)


def _draw(seed: int, *names: str) -> bytes:
    return hashlib.blake2b("\x1f".join((str(seed), *names)).encode(), digest_size=16).digest()


class ChannelTarget(Frozen):
    """The number to predict is a channel of the reference, sample by sample."""

    source: Literal["channel"] = "channel"
    kind: ChannelKind = "force"
    name: str | None = None
    """Which one, if a recording has several of this kind; None takes the only one or the one called `normal`."""
    unit: str = "N"
    reduce: Literal["mean", "max"] | None = None
    """Of `answer_per: recording`: the number of a recording is this of all its samples."""


VECTOR_METRIC: Final = "mean_euclidean_error"
"""What a vector is scored by."""


class VectorTarget(Frozen):
    """The vector to predict is several channels of the reference, sample by sample; a row without one has no label."""

    source: Literal["vector"] = "vector"
    kind: ChannelKind = "position"
    """Of every component."""
    names: tuple[str, ...] = Field(min_length=1)
    """The channels, one a component."""
    unit: str
    """Of every component: the length of a difference is in it too."""

    @property
    def components(self) -> tuple[ChannelTarget, ...]:
        """Each component as a target of its own."""
        return tuple(ChannelTarget(kind=self.kind, name=name, unit=self.unit) for name in self.names)


class LabelTarget(Frozen):
    """The class to predict is a label: of the whole recording, or of each row (an annotation)."""

    source: Literal["label"] = "label"
    name: str
    unit: str = "1"


class Published(Frozen):
    """A figure somebody has published for this task. It stands beside rows it is comparable with, and no others."""

    score: float
    reference: str
    protocol: str
    """Only rows under this protocol stand beside it."""
    sensor: str | None = None
    """None: of any sensor."""
    estimator: str | None = None
    """None: by a model of their own that is none of ours; `remark` says which."""
    split: str | None = None
    """None: whichever split the protocol has."""
    title: str = ""
    """What it is, in a few words, for a reproduction table."""
    remark: str = ""
    """What must be known to compare with it."""


class TaskSpec(Frozen):
    """A question asked of recordings: pure data, the core carries it out."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_-]*$")
    title: str
    question: str
    """One sentence, for people."""
    kind: Literal["regression", "classification", "events"]
    """`events`: when something begins. Detectors give every frame a score, `alarms` turns scores into alarms."""
    features: tuple[ChannelKind, ...] = ("taxel",)
    """Kinds of channels an estimator may look at."""
    optional_features: tuple[ChannelKind, ...] = ()
    """Further kinds, of sensors that have them."""
    target: ChannelTarget | VectorTarget | LabelTarget | SlipTarget
    answer_per: Literal["sample", "recording", "frame"] = "sample"
    """`recording`: one class or number for each recording as a whole, made in one of the three ways that follow. The
    target is then a label that does not change within a recording. `frame`: one for each window of the target's length,
    from each channel's own samples in it."""
    summaries: tuple[Summary, ...] = ()
    """Features of a recording or of a frame: these numbers of each channel."""
    alarms: AlarmPolicy | None = None
    """Of events: how frames become alarms, and what an alarm is held against."""
    max_false_alarms_per_minute: float | None = Field(default=None, ge=0)
    """Of events: the threshold is that of largest recall on validation recordings with at most so many [1/min]."""
    features_by: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with one recording, a tuple of :class:`tactbench.plugin.StreamReadings`: features of
    the task's own, name to number, the same names for every recording. They stand behind `summaries`, or alone."""
    vote: Literal["frames"] | None = None
    """Every frame is answered, and the answers of a recording are combined: the commonest class, of equals the first;
    the mean of numbers."""
    metric: str
    """Name of the primary metric; see docs/glossary.md."""
    unit: str = "1"
    """Unit of the primary metric."""
    equivalence: float | None = Field(default=None, ge=0)
    """Region of practical equivalence, in the metric's unit: two scores that differ by no more are the same to whoever
    uses the sensor. None: nobody has said, and only chance makes scores alike."""
    scenes: tuple[PlannedScene, ...] = ()
    """What a rig should record; empty: only recordings made elsewhere can answer."""
    campaigns: dict[str, tuple[PlannedScene, ...]] = Field(default_factory=dict)
    """By name of a split: what a rig should record for it instead of `scenes`. Groups that such a split keeps apart are
    left out one by one. Scenes of one name are one scene, in every campaign."""
    protocols: tuple[str, ...]
    """Allowed protocols, the default first."""
    splits: tuple[str, ...] = ()
    """Splits that make sense for `deployable`, the default first: roles, session, in-session, few-shot-N, or a group's
    name."""
    estimators: tuple[str, ...]
    """What answers when nobody asks for another."""
    baselines: tuple[str, ...]
    """Trivial answers that stand in every table and are probed; the best of them is the bar."""
    published: tuple[Published, ...] = ()
    beside: tuple[str, ...] = ()
    """Tasks that are run whenever this one is asked for: the same question, to be read beside it."""
    replicates: int | None = Field(default=None, ge=1)
    """How often a simulated rig records and answers it anew where nobody says; None: as often as any task."""

    @model_validator(mode="after")
    def _has_a_metric_and_classes(self) -> TaskSpec:
        if self.metric not in METRICS:
            close = nearest(self.metric, METRICS) or METRICS
            raise ValueError(f"there is no metric {self.metric!r}; did you mean {' or '.join(close)}?")
        if self.kind == "classification" and isinstance(self.target, ChannelTarget):
            raise ValueError(
                f"a channel of kind {self.target.kind} is a number on a continuous scale: give classes or a threshold "
                "(a LabelTarget, or a SlipTarget of frames) to classify, or ask by kind: regression"
            )
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
    def _vectors_have_a_metric_of_their_own(self) -> TaskSpec:
        vector = isinstance(self.target, VectorTarget)
        if vector and self.kind != "regression":
            raise ValueError("a vector is predicted by kind: regression")
        if vector != (self.metric == VECTOR_METRIC):
            raise ValueError(f"metric {VECTOR_METRIC} and a target that is a vector belong together")
        return self

    @model_validator(mode="after")
    def _recordings_are_answered_in_one_way(self) -> TaskSpec:
        if self.answer_per == "frame":
            return self
        summarised = bool(self.summaries or self.features_by)
        reduced = isinstance(self.target, ChannelTarget) and self.target.reduce is not None
        if reduced and self.answer_per == "sample":
            raise ValueError("a channel is reduced to one number for answer_per: recording alone")
        if self.answer_per == "sample":
            if summarised or self.vote:
                raise ValueError("summaries, features_by and vote belong to answer_per: recording")
            return self
        if summarised == bool(self.vote):
            raise ValueError("answer_per: recording needs either summaries or features_by, or else vote: frames")
        if not isinstance(self.target, LabelTarget) and not reduced:
            raise ValueError("answer_per: recording asks for a label, or for a channel with `reduce`")
        if "in-session" in self.splits:
            raise ValueError("split in-session cuts recordings in time; answer_per: recording asks each as a whole")
        unseen = {kind for one in self.summaries for kind in one.kinds} - set(self.looks_at)
        if unseen:
            raise ValueError(f"summaries of {', '.join(sorted(unseen))}, which the task's features do not have")
        return self

    @property
    def looks_at(self) -> tuple[ChannelKind, ...]:
        """Kinds of channels an estimator may look at, of sensors that have them."""
        return (*self.features, *self.optional_features)

    @property
    def answer_from(self) -> str:
        """What an answer is made of, and of events what it is held against; empty where answers are of samples."""
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
        """Return the published figure that a result may stand beside, or None; the one for this sensor first."""
        fitting = [
            one
            for one in self.published
            if one.protocol == protocol
            and one.sensor in (None, sensor)
            and one.estimator in (None, estimator)
            and (one.split is None or split is None or one.split == split)
        ]
        return min(fitting, key=lambda one: (one.sensor is None, one.estimator is None), default=None)

    def scenes_for(self, split: str | None) -> tuple[PlannedScene, ...]:
        """Return what a rig should record to answer under `split`, as declared; None is the default split."""
        return self.scenes if split is None else self.campaigns.get(split, self.scenes)
