"""Task: predict, from one static reading before the lift, if a grasped object will slip."""

from __future__ import annotations

from tactbench.plugin import LabelTarget, TaskDescriptor, TaskSpec, hookimpl

TACTBENCH_API = 2

SPEC = TaskSpec(
    name="grasp-stability",
    title="Grasp stability",
    question="Will the object slip when it is lifted?",
    kind="classification",
    target=LabelTarget(name="slipped"),
    metric="accuracy",
    equivalence=0.01,  # assumed: one answer in a hundred
    protocols=("deployable",),
    splits=("object", "session", "roles", "shuffled"),
    estimators=("forest",),
    baselines=("majority", "chance"),
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptor of the grasp stability task."""
    return [TaskDescriptor(spec=SPEC)]
