"""Tasks that a mapping of recordings declares as data, without code."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from tactbench.core.errors import complaint
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.task import VECTOR_METRIC, ChannelTarget, LabelTarget, TaskFields, TaskSpec, VectorTarget

FILE = "tasks.yaml"
"""Name of the file beside recordings in which such tasks are declared."""

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
    """Content of a file of declared tasks, :data:`FILE`."""

    version: Literal[1] = 1
    tasks: tuple[DeclaredTask, ...] = ()
