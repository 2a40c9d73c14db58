"""A task of places, and recordings of presses."""

from tactbench.plugin import (
    ForceRamp,
    Indenter,
    LabelTarget,
    Placement,
    PlannedScene,
    Scene,
    TaskDescriptor,
    TaskSpec,
    assumed,
    hookimpl,
)

TACTBENCH_API = 2
WHY = "its maker"
PRESS = ForceRamp(hold=assumed(1, "s", WHY), duration=assumed(4, "s", WHY), end=assumed(2, "N", WHY), samples=200)


def planned(role, number, mm):
    scene = Scene(
        name=f"{role}-{number}", placement=Placement(x=assumed(mm, "mm", WHY)), session=f"session-{role}",
        indenter=Indenter(radius=assumed(8, "mm", WHY)), profile=PRESS, starts_after_s=30.0 * number,
        labels={"offset_mm": mm}, observe=("taxel",),
    )  # fmt: skip
    return PlannedScene(scene=scene, role=role)


PLACES = {"train": (-1.5, -0.5, 0.5, 1.5), "validation": (-1.1, 0.9), "test": (-1.2, -0.2, 0.8, 1.2)}
SPEC = TaskSpec(
    name="sound-trial", title="Place", question="Where along the finger does it touch?", kind="regression",
    target=LabelTarget(name="offset_mm", unit="mm"), features=("taxel",), metric="rmse", unit="mm",
    scenes=tuple(planned(role, *one) for role, places in PLACES.items() for one in enumerate(places)),
    protocols=("deployable",), splits=("roles", "session"), estimators=("lasso",), baselines=("mean",),
)  # fmt: skip


@hookimpl
def tactbench_tasks():
    return [TaskDescriptor(spec=SPEC)]
