"""Task: decide which of five spherical caps touches the sensor (Karl et al. 2016, section III-B)."""

from __future__ import annotations

from tactbench.plugin import LabelTarget, Published, TaskDescriptor, TaskSpec, hookimpl
from tactbench.tasks.surfaces import RADII_MM, at_places, few_shots, on_units, papers_caps

TACTBENCH_API = 2

_PAPER = "Karl et al. 2016"
# Assumed: two answers in a hundred. The paper's own difference of the two sensors is 0.19.
SAME_F1 = 0.02

SPEC = TaskSpec(
    name="curvature",
    title="Curvature of the surface",
    question="Which of five spherical caps touches the sensor?",
    kind="classification",
    target=LabelTarget(name="cap_radius_mm", unit="mm"),
    metric="macro_f1",
    equivalence=SAME_F1,
    scenes=papers_caps(),
    campaigns={"placement": at_places(RADII_MM), "unit": on_units(RADII_MM), **few_shots(RADII_MM)},
    protocols=("karl2016", "karl2016-training-scale", "deployable", "deployable-untared"),
    splits=(
        *("roles", "session", "placement", "unit"),
        *("few-shot-1", "few-shot-2", "few-shot-5", "few-shot-10", "shuffled"),
    ),
    estimators=("forest",),
    baselines=("chance", "majority"),
    published=(
        Published(
            score=0.60488, protocol="karl2016", sensor="biotac", estimator="forest",
            title="curvature, macro F1, BioTac", reference=f"{_PAPER}, section III-B",
        ),
        Published(
            score=0.79512, protocol="karl2016", sensor="icub", estimator="forest",
            title="curvature, macro F1, iCub", reference=f"{_PAPER}, section III-B",
        ),
    ),
)  # fmt: skip


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptor of the curvature task."""
    return [TaskDescriptor(spec=SPEC)]
