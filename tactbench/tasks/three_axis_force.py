"""Task: estimate normal and tangential force from taxels, for recordings with a three-axis force reference.

The task has no simulated scenes: electrodes and taxels of the twin's sensors do not respond to shear, and their score
would be that of the normal force alone.
"""

from __future__ import annotations

from tactbench.plugin import TaskDescriptor, TaskSpec, VectorTarget, hookimpl

TACTBENCH_API = 2

SPEC = TaskSpec(
    name="three-axis-force",
    title="Three-axis force",
    question="How large are the normal force and both tangential ones?",
    kind="regression",
    target=VectorTarget(kind="force", names=("fx", "fy", "fz"), unit="N"),
    metric="mean_euclidean_error",
    unit="N",
    equivalence=0.05,  # assumed: as for the normal force
    protocols=("deployable", "deployable-untared"),
    splits=("roles", "session", "press", "in-session", "shuffled"),
    estimators=("forest-100", "ridge"),
    baselines=("mean", "time-index"),
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptor of the three-axis force task."""
    return [TaskDescriptor(spec=SPEC)]
