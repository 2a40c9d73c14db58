"""Shear force from taxels, from recordings whose load cell measured along the surface."""

from __future__ import annotations

from tactbench.plugin import ChannelTarget, Published, TaskDescriptor, TaskSpec, hookimpl

TACTBENCH_API = 1

SPEC = TaskSpec(
    name="shear-force",
    title="Shear force",
    question="How large is the force along the surface?",
    kind="regression",
    target=ChannelTarget(kind="force", name="shear", unit="N"),
    metric="rmse",
    unit="N",
    protocols=("deployable",),
    splits=("roles", "session", "press", "in-session", "shuffled"),
    estimators=("forest", "ridge"),
    baselines=("mean", "time-index"),
    published=(
        Published(
            score=0.12, protocol="deployable", sensor="eflesh-shear", split="in-session",
            title="shear force, RMSE, eFlesh", reference="Pattabiraman et al. 2025, arXiv 2506.09994",
            remark="a small network; the last fifth of one session's rows, as in the authors' published training code, "
            "which gives rows without a load-cell sample the nearest one and scales by all rows, tested ones too; "
            "which session the figure is of is not stated",
        ),
    ),
)  # fmt: skip


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Offer the task."""
    return [TaskDescriptor(spec=SPEC)]
