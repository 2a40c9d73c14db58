"""A task: how far along the sensor something touches it, as a number.

One coordinate of the contact's place, asked of scenes whose indenter is put there: no sensor is named, so that it is asked of
all of them.
"""

from tactbench.plugin import (  # noqa: I001
    ForceRamp, Indenter, LabelTarget, Placement, PlannedScene, Scene, TaskDescriptor, TaskSpec, assumed, hookimpl,
)  # fmt: skip

TACTBENCH_API = 2
WHY = "chosen for this task: within 3 mm of the contact point all sensors have taxels"
PLACES_MM = (-3.0, -1.5, 0.0, 1.5, 3.0)
SHORT = ForceRamp(end=assumed(2, "N", WHY), hold=assumed(2, "s", WHY), duration=assumed(10, "s", WHY), samples=250)

SCENES = tuple(
    PlannedScene(
        role=role,
        drawn_order=f"places-{role}",  # so that a place is not told by how warm the sensor is
        scene=Scene(
            name=f"place-{order}-{role}", indenter=Indenter(radius=assumed(5, "mm", WHY)), profile=SHORT,
            placement=Placement(x=assumed(x_mm, "mm", WHY)), session=role, starts_after_s=60.0 * order,
            labels={"contact_x_mm": x_mm},
        ),
    )
    for role in ("train", "validation", "test")
    for order, x_mm in enumerate(PLACES_MM)
)  # fmt: skip
SPEC = TaskSpec(
    name="contact-x",
    title="Place of contact along the sensor",
    question="How far along the sensor, from its nominal contact point, does something touch it?",
    kind="regression",
    target=LabelTarget(name="contact_x_mm", unit="mm"),
    metric="rmse",
    unit="mm",
    equivalence=0.1,  # assumed: the repeatability of putting the indenter there
    scenes=SCENES,
    protocols=("deployable",),
    splits=("roles", "session", "contact_x_mm"),
    estimators=("ridge",),
    baselines=("mean", "time-index"),
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Offer the task."""
    return [TaskDescriptor(spec=SPEC)]
