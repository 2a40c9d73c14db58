"""Task: estimate the curvature of the surface as a number, also for radii absent from training.

Karl et al. 2016 classify five caps and hope to "linearly interpolate unseen curvature radii". Here the curvature 1/R
itself is predicted, a flat surface being 0, and each radius is left out in turn. The smallest and the largest curvature
can only be extrapolated to.
"""

from __future__ import annotations

from tactbench.plugin import Indenter, LabelTarget, PlannedScene, Scene, TaskDescriptor, TaskSpec, hookimpl
from tactbench.tasks.surfaces import RADII_MM, SLOT_S, at_places, few_shots, in_sessions, labels, on_units, papers_caps

TACTBENCH_API = 2

# Assumed: a tenth of the least step between two of the surfaces, from flat to a radius of 40 mm.
SAME_PER_M = 2.5

ROLES = ("train", "validation", "test")

# The paper's caps as they are, so that their recordings are shared; then flat, once a role, in a fourth round.
FLATS = tuple(
    PlannedScene(
        role=role,
        scene=Scene(
            name=f"flat-surface-{role}",
            indenter=Indenter(),
            session=role,
            starts_after_s=SLOT_S * (len(ROLES) * len(RADII_MM) + order),
            labels=labels(None),
        ),
    )
    for order, role in enumerate(ROLES)
)

SPEC = TaskSpec(
    name="inverse-radius",
    title="Curvature as a number",
    question="How large is the curvature 1/R of the surface?",
    kind="regression",
    target=LabelTarget(name="inverse_radius_per_m", unit="1/m"),
    metric="rmse",
    unit="1/m",
    equivalence=SAME_PER_M,
    scenes=(*papers_caps(), *FLATS),
    campaigns={"cap_radius_mm": in_sessions(5), "placement": at_places(), "unit": on_units(), **few_shots()},
    protocols=("deployable", "deployable-untared", "karl2016", "karl2016-training-scale"),
    splits=(
        *("roles", "session", "cap_radius_mm", "placement", "unit"),
        *("few-shot-1", "few-shot-2", "few-shot-5", "few-shot-10", "shuffled"),
    ),
    estimators=("ridge",),
    baselines=("mean", "time-index"),
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptor of the task `inverse-radius`."""
    return [TaskDescriptor(spec=SPEC)]
