"""Which of five caps touches the sensor (Karl et al. 2016, section III-B)."""

from __future__ import annotations

from tactbench.plugin import (
    Indenter,
    LabelTarget,
    PlannedScene,
    Published,
    Scene,
    TaskDescriptor,
    TaskSpec,
    hookimpl,
    sourced,
)

TACTBENCH_API = 1

_PAPER = "Karl et al. 2016"
RADII_MM = (5.0, 7.5, 10.0, 20.0, 40.0)
"""Radii of the caps; source: the paper's figure of curved objects."""

# Every cap once in each of the three sessions, the caps one after the other: a minute of recording and a minute to
# exchange the cap.
SCENES = tuple(
    PlannedScene(
        role=role,
        scene=Scene(
            name=f"cap-{radius:g}mm-{role}",
            indenter=Indenter(radius=sourced(radius, "mm", f"{_PAPER}, figure of curved objects")),
            session=role,
            starts_after_s=120.0 * (len(RADII_MM) * session + place),
            labels={"cap_radius_mm": radius},
        ),
    )
    for session, role in enumerate(("train", "validation", "test"))
    for place, radius in enumerate(RADII_MM)
)

SPEC = TaskSpec(
    name="curvature",
    title="Curvature of the surface",
    question="Which of five spherical caps touches the sensor?",
    kind="classification",
    target=LabelTarget(name="cap_radius_mm", unit="mm"),
    metric="macro_f1",
    scenes=SCENES,
    protocols=("karl2016", "deployable"),
    splits=("roles", "session", "shuffled"),
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
    """Offer the task."""
    return [TaskDescriptor(spec=SPEC)]
