"""Specification of a task: target, features, metric, protocols and scenes; tasks that a mapping declares as data."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Annotated, Any, Final, Literal

from pydantic import Field, ValidationError, model_validator

from tactbench.core.errors import complaint, nearest
from tactbench.core.spec.events import AREA_PER_MINUTE, AlarmPolicy, SlipTarget
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.sensor import ChannelKind

METRICS: Final = (
    "rmse", "mae", "mean_euclidean_error", "r2", "accuracy", "balanced_accuracy", "macro_f1", "recall_area",
)  # fmt: skip
"""Names of all metrics from which a task may choose."""

WHERE = r"^[A-Za-z_][\w.]*:[A-Za-z_]\w*$"
"""Regular expression of an import path, ``module:callable``."""


class PlannedScene(Frozen):
    """A scene of a task, with the role of its recording as training or test data."""

    scene: Scene
    role: Role
    drawn_order: str = ""
    """Name of a group of scenes, whose order is drawn with the seed; empty: the scene keeps its declared place."""


def in_drawn_order(planned: Sequence[PlannedScene], seed: int) -> tuple[PlannedScene, ...]:
    """Return the scenes, where the scenes of each group of `drawn_order` are in an order drawn with `seed`.

    The scenes of a group exchange their places in the sequence and their starting times, so that a scene is
    independent of how warm the sensor is. The order is by a hash (BLAKE2) of seed, group and name: uniform over all
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
    """Name of the channel, if a recording has several of this kind; None: the only channel, or the channel named
    `normal`."""
    unit: str = "N"


VECTOR_METRIC: Final = "mean_euclidean_error"
"""Name of the metric for targets that are vectors."""


class VectorTarget(Frozen):
    """A target made of several reference channels; a row that lacks the value of a channel has no label."""

    source: Literal["vector"] = "vector"
    kind: ChannelKind = "position"
    """Kind of the channels that are the components."""
    names: tuple[str, ...] = Field(min_length=1)
    """Names of the channels that are the components, in order."""
    unit: str
    """Unit of every component, and hence of the length of the error vector."""

    @property
    def components(self) -> tuple[ChannelTarget, ...]:
        """The components, each as a target of one channel."""
        return tuple(ChannelTarget(kind=self.kind, name=name, unit=self.unit) for name in self.names)


class LabelTarget(Frozen):
    """A target that is a label of the whole recording, or of each of its rows (an annotation)."""

    source: Literal["label"] = "label"
    name: str
    unit: str = "1"


class Published(Frozen):
    """A published score for a task, shown beside the rows with which it is comparable."""

    score: float
    reference: str
    protocol: str
    """Name of the protocol of the rows with which the figure is comparable."""
    sensor: str | None = None
    """Name of the sensor with whose rows the figure is comparable; None: any sensor."""
    estimator: str | None = None
    """Name of the estimator; None: a model that tactbench does not have, described by `remark`."""
    split: str | None = None
    """Name of the split of the rows with which the figure is comparable; None: any split."""
    title: str = ""
    """Title of the figure in a few words, for a table of reproductions."""
    remark: str = ""
    """Differences from the evaluation in tactbench that a reader needs for the comparison."""


class Summary(Frozen):
    """A summary: one number for each channel, computed from the channel's own samples in a window.

    No stream is resampled: each is summarised on its own clock.
    """

    measure: Literal["mean", "deviation", "minimum", "maximum", "range", "change", "mean-step", "band-energy"]
    """``mean``; ``deviation``: standard deviation; ``range``: maximum minus minimum; ``change``: last minus first
    sample; ``mean-step``: mean absolute difference of neighbouring samples; ``band-energy``: mean square after a causal
    band-pass (Butterworth, two poles at each end), in the channel's unit squared."""
    start: float = Field(default=0.0, ge=0)
    end: float = Field(default=1.0, gt=0, le=1)
    """End of the window; like `start`, a share of the samples that the protocol keeps, or of the length of a frame."""
    band_hz: tuple[float, float] | None = None
    """Lower and upper end of the band of ``band-energy`` [Hz]; None for other measures."""
    kinds: tuple[ChannelKind, ...] = ()
    """Kinds of channels to summarise; empty: all that the task uses."""

    @model_validator(mode="after")
    def _one_window_one_band(self) -> Summary:
        if not self.start < self.end:
            raise ValueError("the end of a window must be greater than its start")
        if (self.measure == "band-energy") != (self.band_hz is not None):
            raise ValueError("band_hz is required by the measure band-energy, and invalid for other measures")
        if self.band_hz and not 0 < self.band_hz[0] < self.band_hz[1]:
            raise ValueError("the lower end of band_hz must be above 0 Hz and below the upper end")
        return self

    @property
    def name(self) -> str:
        """Name of the summary in features and rows."""
        band = "" if self.band_hz is None else f" {self.band_hz[0]:g}-{self.band_hz[1]:g} Hz"
        window = "" if (self.start, self.end) == (0.0, 1.0) else f" {self.start:g}-{self.end:g} of the recording"
        kinds = f" of {', '.join(self.kinds)}" if self.kinds else ""
        return f"{self.measure}{band}{window}{kinds}"


class TaskFields(Frozen):
    """Fields that tasks of plugins and tasks declared by mappings have in common."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_-]*$")
    title: str = ""
    question: str = ""
    """The question that the task poses, in one sentence."""
    features: tuple[ChannelKind, ...] = ("taxel",)
    """Kinds of channels that an estimator may use as features."""
    optional_features: tuple[ChannelKind, ...] = ()
    """Further kinds of channels, used as features if a sensor has them."""
    summaries: tuple[Summary, ...] = ()
    """Summaries of each channel that are the features of a recording or of a frame."""


class TaskSpec(TaskFields):
    """Specification of a task as data, evaluated without code of its own."""

    title: str
    question: str
    kind: Literal["regression", "classification", "events"]
    """Kind of answer. For `events`, it is a time of onset: detectors score frames, and `alarms` makes alarms."""
    target: ChannelTarget | VectorTarget | LabelTarget | SlipTarget
    answer_per: Literal["sample", "recording", "frame"] = "sample"
    """Unit of an answer. `recording`: one class or number for each recording, by `summaries`; its
    label is constant within a recording. `frame`: one answer for each window of the target's length."""
    alarms: AlarmPolicy | None = None
    """Rules by which scores of frames become alarms, for events."""
    max_false_alarms_per_minute: float | None = Field(default=None, ge=0)
    """Largest rate of false alarms on validation recordings [1/min], subject to which the threshold with the largest
    recall is chosen."""
    metric: str
    """Name of the primary metric; docs/glossary.md describes the metrics."""
    unit: str = "1"
    """Unit of the primary metric, 1 for a pure number."""
    equivalence: float | None = Field(default=None, ge=0)
    """Largest difference of scores that is irrelevant in practice, in the metric's unit; None: not stated."""
    scenes: tuple[PlannedScene, ...] = ()
    """Scenes to be recorded by a rig; empty: the task needs recordings made elsewhere."""
    campaigns: dict[str, tuple[PlannedScene, ...]] = Field(default_factory=dict)
    """Scenes that a rig records for a split instead of `scenes`, by name of the split; such a split leaves its groups
    out in turn. Scenes of equal name are the same in every campaign."""
    protocols: tuple[str, ...]
    """Names of the allowed protocols; the first is the default."""
    splits: tuple[str, ...] = ()
    """Names of the splits for the protocol `deployable`, the first by default: roles, session, in-session, few-shot-N,
    or a group's name."""
    estimators: tuple[str, ...]
    """Names of the estimators that are evaluated by default."""
    baselines: tuple[str, ...]
    """Names of the trivial estimators, which are in every table; others are compared with the best of them."""
    published: tuple[Published, ...] = ()
    beside: tuple[str, ...] = ()
    """Names of related tasks that are always run together with this task."""
    replicates: int | None = Field(default=None, ge=1)
    """Default number of replicates on a simulated rig; None: the same number as for other tasks."""

    @model_validator(mode="after")
    def _has_a_metric_that_fits(self) -> TaskSpec:
        if self.metric not in METRICS:
            close = nearest(self.metric, METRICS) or METRICS
            raise ValueError(f"no metric is called {self.metric!r}; did you mean {' or '.join(close)}?")
        if self.kind == "classification" and isinstance(self.target, ChannelTarget):
            raise ValueError(
                f"a channel of kind {self.target.kind} is a number: give a target with classes (a LabelTarget or a "
                "SlipTarget), or kind: regression"
            )
        vector = isinstance(self.target, VectorTarget)
        if vector and self.kind != "regression":
            raise ValueError("a target that is a vector needs kind: regression")
        if vector != (self.metric == VECTOR_METRIC):
            raise ValueError(f"metric {VECTOR_METRIC} and a target that is a vector require each other")
        return self

    @model_validator(mode="after")
    def _frames_are_answered_in_one_way(self) -> TaskSpec:
        framed = isinstance(self.target, SlipTarget)
        if framed != (self.answer_per == "frame"):
            raise ValueError("answer_per: frame and a target of frames require each other")
        if framed and not self.summaries:
            raise ValueError("answer_per: frame also needs the field summaries")
        if framed and "in-session" in self.splits:
            raise ValueError("split in-session cuts recordings in time, and a frame would extend across a cut")
        if (self.kind == "events") != (self.alarms is not None and self.max_false_alarms_per_minute is not None):
            raise ValueError("kind: events needs alarms and max_false_alarms_per_minute; other kinds take neither")
        if self.kind == "events" and not framed:
            raise ValueError("kind: events needs a target of frames")
        return self

    @model_validator(mode="after")
    def _recordings_are_answered_in_one_way(self) -> TaskSpec:
        if self.answer_per == "frame":
            return self
        if self.answer_per == "sample":
            if self.summaries:
                raise ValueError("summaries need answer_per: recording")
            return self
        if not self.summaries or not isinstance(self.target, LabelTarget):
            raise ValueError("answer_per: recording also needs the field summaries, and a label as target")
        if "in-session" in self.splits:
            raise ValueError("split in-session cuts recordings in time; answer_per: recording does not allow cuts")
        if unseen := {kind for one in self.summaries for kind in one.kinds} - set(self.looks_at):
            raise ValueError(f"summaries: {', '.join(sorted(unseen))} must be among the task's features")
        return self

    @property
    def looks_at(self) -> tuple[ChannelKind, ...]:
        """Kinds of channels that an estimator may use, if a sensor has them: features and optional features."""
        return (*self.features, *self.optional_features)

    @property
    def answer_from(self) -> str:
        """Description of the data behind one answer, with the rules for events; empty if each sample has an answer."""
        if self.alarms is not None:
            return (
                f"{self.target}; {self.alarms}; recall area up to {AREA_PER_MINUTE:g} false alarms a "
                f"minute; threshold by validation: at most {self.max_false_alarms_per_minute:g} a minute"
            )
        if isinstance(self.target, SlipTarget):
            return str(self.target)
        return ", ".join(one.name for one in self.summaries)

    def published_for(self, sensor: str, protocol: str, estimator: str, split: str | None) -> Published | None:
        """Return the published figure comparable with a result, preferably of this sensor; None: there is none."""
        fitting = (
            one for one in self.published if one.protocol == protocol and one.sensor in (None, sensor)
            and one.estimator in (None, estimator) and (split is None or one.split in (None, split))
        )  # fmt: skip
        return min(fitting, key=lambda one: (one.sensor is None, one.estimator is None), default=None)

    def scenes_for(self, split: str | None) -> tuple[PlannedScene, ...]:
        """Return the scenes, as declared, that a rig records for `split`; None stands for the default split."""
        return self.scenes if split is None else self.campaigns.get(split, self.scenes)


TASKS_FILE = "tasks.yaml"
"""Name of the file beside recordings in which a mapping declares tasks, without code."""

_METRICS = {
    "number": ("rmse", "mae", "r2"), "vector": (VECTOR_METRIC,), "class": ("macro_f1", "accuracy", "balanced_accuracy"),
}  # fmt: skip
"""Metrics by kind of answer; the first of each kind is the default."""
_ESTIMATORS = {"number": ("forest", "ridge"), "vector": ("forest-100", "ridge"), "class": ("forest", "logistic")}
_BASELINES = {"number": ("mean", "time-index"), "vector": ("mean", "time-index"), "class": ("majority", "chance")}


class DeclaredTask(TaskFields):
    """A task as a mapping file declares it; omitted fields follow from the target and the name."""

    target: Annotated[ChannelTarget | VectorTarget | LabelTarget, Field(discriminator="source")]
    answer: Literal["number", "class"] | None = None
    """Type of a label's values: a class (default) or a number; None if the target is a channel."""
    metric: str | None = None
    """Name of the metric; None: the first metric that fits the target."""
    splits: tuple[str, ...] = Field(min_length=1)
    """Splits, the default first: roles, session, in-session, few-shot-N, shuffled, or the name of a label."""
    answer_per: Literal["sample", "recording"] = "sample"
    protocols: tuple[str, ...] = Field(default=("deployable",), min_length=1)
    estimators: tuple[str, ...] = ()
    """Names of estimators; empty: two estimators that fit the target."""
    baselines: tuple[str, ...] = ()
    """Names of trivial estimators; empty: the usual trivial estimators for the target."""
    equivalence: float | None = Field(default=None, ge=0)

    @property
    def _answer(self) -> str:
        if isinstance(self.target, LabelTarget):
            return self.answer or "class"
        return "vector" if isinstance(self.target, VectorTarget) else "number"

    @model_validator(mode="after")
    def _makes_a_task(self) -> DeclaredTask:
        if self.answer is not None and not isinstance(self.target, LabelTarget):
            raise ValueError("answer: give class or number for a label only; a channel is always a number")
        if self.metric is not None and self.metric not in _METRICS[self._answer]:
            raise ValueError(f"metrics of a {self._answer} are {', '.join(_METRICS[self._answer])}, not {self.metric}")
        try:
            self.spec  # noqa: B018  (a task that is not valid is refused in the file that declares it)
        except ValidationError as error:
            raise ValueError(complaint(error)) from error
        return self

    @property
    def spec(self) -> TaskSpec:
        """Return the task as the specification that a plugin would declare."""
        answer, metric = self._answer, self.metric or _METRICS[self._answer][0]
        unit = self.target.unit if metric in ("rmse", "mae", VECTOR_METRIC) else "1"
        more: dict[str, Any] = {
            "title": self.title or self.name, "question": self.question or f"What is {self.name}?", "unit": unit,
            "kind": "classification" if answer == "class" else "regression", "metric": metric,
            "estimators": self.estimators or _ESTIMATORS[answer], "baselines": self.baselines or _BASELINES[answer],
        }  # fmt: skip
        return TaskSpec.model_validate({**{key: value for key, value in self if key != "answer"}, **more})


class TaskFile(Frozen):
    """Content of a file of declared tasks, :data:`TASKS_FILE`."""

    version: Literal[1] = 1
    tasks: tuple[DeclaredTask, ...] = ()
