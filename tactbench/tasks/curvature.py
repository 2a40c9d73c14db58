"""Tasks: which of five spherical caps touches (Karl et al. 2016, section III-B), and its curvature as a number.

The paper classifies the caps and hopes to "linearly interpolate unseen curvature radii". In the second task the
curvature 1/R itself is predicted, a flat surface being 0, and each radius is left out in turn. The smallest and the
largest curvature can only be extrapolated to.
"""

from __future__ import annotations

from tactbench.plugin import Indenter, LabelTarget, PlannedScene, Published, Scene, TaskDescriptor, TaskSpec, hookimpl
from tactbench.tasks.surfaces import RADII_MM, SLOT_S, at_places, few_shots, in_sessions, labels, on_units, papers_caps

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

INVERSE_RADIUS = TaskSpec(
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
    """Return the descriptors of the curvature tasks."""
    return [TaskDescriptor(spec=SPEC), TaskDescriptor(spec=INVERSE_RADIUS)]
