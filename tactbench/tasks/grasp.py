"""Tasks on grasped objects: coming slip from a static reading before the lift, and the object's identity by frame."""

from __future__ import annotations

from tactbench.plugin import LabelTarget, TaskDescriptor, TaskSpec, hookimpl

TACTBENCH_API = 2

STABILITY = TaskSpec(
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

IDENTITY = TaskSpec(
    name="object-identity",
    title="Identity of the object",
    question="Which object has the hand closed on?",
    kind="classification",
    target=LabelTarget(name="object"),
    metric="accuracy",
    equivalence=0.01,  # assumed: one answer in a hundred
    protocols=("deployable",),
    # Frames of one grasp are near copies: grasps are kept whole. By `trial`, the n-th grasp of every object is held out
    # at once, so that every fold tests every object, and what the objects' n-th grasps shared is on one side only. By
    # `recording`, each grasp for itself: for recordings whose grasps are not numbered.
    splits=("trial", "recording", "shuffled"),
    estimators=("forest",),
    baselines=("majority", "chance"),
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptors of the tasks on grasped objects."""
    return [TaskDescriptor(spec=STABILITY), TaskDescriptor(spec=IDENTITY)]
