"""Normal and tangential force from taxels, from recordings with a three-axis reference.

It has no scenes: electrodes and taxels of the twin's own sensors do not answer to shear, and a score from them would be
that of the normal force alone.
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
    """Offer the task."""
    return [TaskDescriptor(spec=SPEC)]
