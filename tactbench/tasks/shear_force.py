"""Task: estimate the shear force from taxels, for recordings whose load cell measured forces along the surface."""

from __future__ import annotations

from tactbench.plugin import ChannelTarget, TaskDescriptor, TaskSpec, hookimpl
from tactbench.tasks import eflesh

TACTBENCH_API = 2

SPEC = TaskSpec(
    name="shear-force",
    title="Shear force",
    question="How large is the force along the surface?",
    kind="regression",
    target=ChannelTarget(kind="force", name="shear", unit="N"),
    metric="rmse",
    unit="N",
    equivalence=0.02,  # assumed: a sixth of the published error beside it
    protocols=("deployable",),
    splits=("roles", "session", "press", "in-session", "shuffled"),
    estimators=("forest", "ridge"),
    baselines=("mean", "time-index"),
    published=(eflesh.published(0.12, "eflesh-shear", "shear force, RMSE, eFlesh"),),
)  # fmt: skip


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptor of the shear force task."""
    return [TaskDescriptor(spec=SPEC)]
