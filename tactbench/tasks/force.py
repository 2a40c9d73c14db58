"""Normal force from taxels, pressed on a flat surface (Karl et al. 2016, section III-A)."""

from __future__ import annotations

from tactbench.plugin import ChannelTarget, Indenter, PlannedScene, Published, Scene, TaskDescriptor, TaskSpec, hookimpl
from tactbench.tasks import eflesh
from tactbench.tasks.surfaces import at_places, few_shots, on_units

TACTBENCH_API = 1

_PAPER = "Karl et al. 2016, section III-A"

# Three recordings "to acquire three distinct data sets for training, validation and testing". Each is its own
# session; the sensor stays on while they follow each other, a minute of recording and a minute of handling apart.
SCENES = tuple(
    PlannedScene(
        role=role,
        scene=Scene(name=f"flat-{role}", indenter=Indenter(), session=role, starts_after_s=120.0 * order),
    )
    for order, role in enumerate(("train", "validation", "test"))
)

_FLAT = (None,)

# Assumed to be nothing to whoever grips with the sensor: the least force that the iCub's fingertip is reported to
# detect (Jamali et al. 2015, A new design of a fingertip for the iCub hand).
SAME_N = 0.05

SPEC = TaskSpec(
    name="force",
    title="Normal force",
    question="How large is the normal force?",
    kind="regression",
    target=ChannelTarget(kind="force", unit="N"),
    metric="rmse",
    unit="N",
    equivalence=SAME_N,
    scenes=SCENES,
    campaigns={"placement": at_places(_FLAT), "unit": on_units(_FLAT), **few_shots(_FLAT)},
    protocols=("karl2016", "karl2016-training-scale", "deployable", "deployable-untared"),
    splits=(
        *("roles", "session", "press", "in-session", "placement", "unit"),
        *("few-shot-1", "few-shot-2", "few-shot-5", "few-shot-10", "shuffled"),
    ),
    estimators=("lasso",),
    baselines=("mean", "time-index"),
    published=(
        Published(
            score=0.7307, protocol="karl2016", sensor="biotac", estimator="lasso",
            title="force, RMSE, BioTac", reference=_PAPER,
        ),
        Published(
            score=0.7659, protocol="karl2016", sensor="icub", estimator="lasso",
            title="force, RMSE, iCub", reference=_PAPER,
        ),
        Published(
            score=0.6875, protocol="karl2016", estimator="time-index",
            title="force, RMSE of the time index", reference=_PAPER,
            remark="the paper does not say of which sensor's recordings; offered as a lower bound",
        ),
        eflesh.published(0.27, "eflesh", "normal force, RMSE, eFlesh"),
    ),
)  # fmt: skip


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Offer the task."""
    return [TaskDescriptor(spec=SPEC)]
