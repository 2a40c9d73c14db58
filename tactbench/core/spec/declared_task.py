"""A task that comes with recordings: declared in the mapping that imports them, data alone, no code."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, ValidationError, model_validator

from tactbench.core.errors import complaint
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.sensor import ChannelKind
from tactbench.core.spec.summary import Summary
from tactbench.core.spec.task import VECTOR_METRIC, ChannelTarget, LabelTarget, TaskSpec, VectorTarget

FILE = "tasks.yaml"
"""Beside the recordings: what their mapping declares."""

Metric = Literal[
    "rmse", "mae", "r2", "mean_euclidean_error", "macro_f1", "accuracy", "balanced_accuracy"
]  # fmt: skip
_METRICS: dict[str, tuple[Metric, ...]] = {
    "number": ("rmse", "mae", "r2"),
    "vector": (VECTOR_METRIC,),
    "class": ("macro_f1", "accuracy", "balanced_accuracy"),
}
"""Of each kind of answer, the default first."""
_ESTIMATORS = {"number": ("forest", "ridge"), "vector": ("forest-100", "ridge"), "class": ("forest", "logistic")}
_BASELINES = {"number": ("mean", "time-index"), "vector": ("mean", "time-index"), "class": ("majority", "chance")}


class DeclaredTask(Frozen):
    """What a mapping says of a task; whatever it leaves out follows from the target."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_-]*$")
    title: str = ""
    """Empty: the name."""
    question: str = ""
    """One sentence, for people."""
    target: Annotated[ChannelTarget | VectorTarget | LabelTarget, Field(discriminator="source")]
    answer: Literal["number", "class"] | None = None
    """Of a label: whether it is a number or, as it is read by default, a class."""
    metric: Metric | None = None
    """None: the first that fits the target."""
    splits: tuple[str, ...] = Field(min_length=1)
    """The default first: roles, session, in-session, few-shot-N, shuffled, or the name of a label."""
    features: tuple[ChannelKind, ...] = ("taxel",)
    optional_features: tuple[ChannelKind, ...] = ()
    """Further kinds, of sensors that have them."""
    answer_per: Literal["sample", "recording"] = "sample"
    summaries: tuple[Summary, ...] = ()
    vote: Literal["frames"] | None = None
    protocols: tuple[str, ...] = Field(default=("deployable",), min_length=1)
    estimators: tuple[str, ...] = ()
    """Empty: two that fit the target."""
    baselines: tuple[str, ...] = ()
    """Empty: the usual trivial ones."""
    equivalence: float | None = Field(default=None, ge=0)

    @property
    def _answer(self) -> str:
        if isinstance(self.target, LabelTarget):
            return self.answer or "class"
        return "vector" if isinstance(self.target, VectorTarget) else "number"

    @model_validator(mode="after")
    def _makes_a_task(self) -> DeclaredTask:
        if self.answer is not None and not isinstance(self.target, LabelTarget):
            raise ValueError("answer says how a label is read; a channel is a number")
        if self.metric is not None and self.metric not in _METRICS[self._answer]:
            raise ValueError(f"a {self._answer} is scored by {', '.join(_METRICS[self._answer])}, not by {self.metric}")
        try:
            self.spec  # noqa: B018  (what the task would refuse is refused here, in the file that declares it)
        except ValidationError as error:
            raise ValueError(complaint(error)) from error
        return self

    @property
    def spec(self) -> TaskSpec:
        """The task as any other."""
        answer, metric = self._answer, self.metric or _METRICS[self._answer][0]
        unit = self.target.unit if metric in ("rmse", "mae", VECTOR_METRIC) else "1"
        return TaskSpec(
            name=self.name, title=self.title or self.name, question=self.question or f"What is {self.name}?",
            kind="classification" if answer == "class" else "regression", features=self.features,
            optional_features=self.optional_features, target=self.target, answer_per=self.answer_per,
            summaries=self.summaries, vote=self.vote, metric=metric, unit=unit, equivalence=self.equivalence,
            protocols=self.protocols, splits=self.splits, estimators=self.estimators or _ESTIMATORS[answer],
            baselines=self.baselines or _BASELINES[answer],
        )  # fmt: skip


class TaskFile(Frozen):
    """What :data:`FILE` holds."""

    version: Literal[1] = 1
    tasks: tuple[DeclaredTask, ...] = ()
