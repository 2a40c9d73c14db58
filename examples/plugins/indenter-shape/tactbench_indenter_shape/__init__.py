"""A shape of indenter, a cone, and a task: with which of five shapes is the sensor touched?

Four of the shapes come with tactbench. Each is pressed in at three places and, where it has a direction, at three angles, held and
released, so that neither the place nor the force tells the shape.
"""

from tactbench.plugin import (  # noqa: I001
    Indenter, IndenterDescriptor, LabelTarget, Parameter, Placement, PlannedScene, Scene, TaskDescriptor, TaskSpec,
    assumed, hookimpl, staircase,
)  # fmt: skip

TACTBENCH_API = 2
WHY = "chosen for this task: blunt enough for the skins of the simulated sensors"
SHAPES = {
    "cap": {"radius": assumed(4, "mm", WHY)}, "cylinder": {"radius": assumed(4, "mm", WHY)},
    "edge": {"tip_radius": assumed(1, "mm", WHY)}, "pin": {"radius": assumed(2, "mm", WHY)}, "cone": {},
}  # fmt: skip
PLACES_MM = {"train": (-1.0, 0.0, 1.0), "validation": (-0.5, 0.5, 1.5), "test": (-1.5, -0.75, 0.75)}
ANGLES_DEG = (0, 45, 90)


def cone(x_mm, y_mm, *, slope):
    """Return the height of a cone above its tip."""
    return slope * (x_mm**2 + y_mm**2) ** 0.5


def planned(role: str, shape: str, number: int) -> PlannedScene:
    """Return one press with a shape."""
    angle = {} if shape == "cap" else {"angle": assumed(ANGLES_DEG[number], "deg", WHY)}
    scene = Scene(
        name=f"{shape}-{number}-{role}", indenter=Indenter(shape=shape, dimensions=SHAPES[shape], **angle),
        placement=Placement(x=assumed(PLACES_MM[role][number], "mm", WHY)), session=role, labels={"shape": shape},
        profile=staircase(peak=2, steps=1, rise=2, dwell=4, rate=20),
    )  # fmt: skip
    return PlannedScene(role=role, scene=scene, drawn_order=f"shapes-{role}")


SPEC = TaskSpec(
    name="indenter-shape", title="Shape of the indenter", question="With which of five shapes is the sensor touched?",
    kind="classification", target=LabelTarget(name="shape"), metric="macro_f1", unit="1",
    scenes=tuple(planned(role, shape, number) for role in PLACES_MM for shape in SHAPES for number in range(3)),
    protocols=("deployable",), splits=("roles",), estimators=("forest-100",), baselines=("majority", "chance"),
)  # fmt: skip


@hookimpl
def tactbench_indenters() -> list[IndenterDescriptor]:
    """Offer the cone."""
    slope = Parameter(default=0.4, unit="1", least=0.01, most=1, text="rise of its side over run")
    return [IndenterDescriptor(name="cone", title="Cone", where=f"{__name__}:cone", dimensions={"slope": slope})]


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Offer the task."""
    return [TaskDescriptor(spec=SPEC)]
