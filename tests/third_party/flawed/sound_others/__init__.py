"""A task, an estimator, an effect, a shape of indenter and a force profile."""

from tactbench.plugin import (
    ChannelTarget,
    EstimatorDescriptor,
    IndenterDescriptor,
    LabelTarget,
    Parameter,
    Placement,
    PlannedScene,
    ProfileDescriptor,
    Scene,
    TaskDescriptor,
    TaskSpec,
    assumed,
    hookimpl,
)
from tactbench.plugin.simulation import EffectDescriptor

TACTBENCH_API = 2
WHY = "its maker"


def planned(role, side, mm):
    scene = Scene(name=f"{role}-{side}", placement=Placement(x=assumed(mm, "mm", WHY)), session=role,
                  labels={"side": side, "x_mm": mm}, observe=("taxel",))  # fmt: skip
    return PlannedScene(scene=scene, role=role)


SPEC = TaskSpec(
    name="sound-task", title="Side", question="Which half was pressed?", kind="classification",
    target=LabelTarget(name="side"),
    features=("taxel",), metric="macro_f1", unit="1",
    scenes=tuple(planned(role, *side) for role in ("train", "test") for side in (("left", -1.0), ("right", 1.0))),
    protocols=("deployable",), splits=("roles", "session"), estimators=("logistic",), baselines=("majority",),
)  # fmt: skip
FORCE = TaskSpec(
    name="sound-force", title="Force", question="How large is the force?", kind="regression", target=ChannelTarget(),
    metric="rmse", unit="N", scenes=SPEC.scenes, protocols=("deployable",), splits=("roles",), estimators=("ols",),
    baselines=("mean",),
)  # fmt: skip


@hookimpl
def tactbench_tasks():
    return [TaskDescriptor(spec=SPEC), TaskDescriptor(spec=FORCE)]


@hookimpl
def tactbench_estimators():
    return [EstimatorDescriptor(name="sound-estimator", title="Ridge", kinds=("regression",),
                                where="sound_others.code:build", params={"alpha": 1.0, "rows": 50, "solver": "lu"},
                                grid={"alpha": (0.1, 1.0), "rows": (40, 60), "solver": ("lu",)})]  # fmt: skip


@hookimpl
def tactbench_effects():
    return [EffectDescriptor(name="sound-effect", title="Ripple", where="sound_others.code:apply",
                             produces=("disturbance",), called_for="sound_others.code:called_for")]  # fmt: skip


@hookimpl
def tactbench_indenters():
    size = Parameter(default=20.0, unit="mm", least=1.0, text="radius of curvature at its tip")
    return [IndenterDescriptor(name="sound-shape", title="A shape", where="sound_others.code:height",
                               dimensions={"size": size})]  # fmt: skip


@hookimpl
def tactbench_profiles():
    peak = Parameter(default=2.0, unit="N", text="the largest force")
    return [ProfileDescriptor(name="sound-profile", title="A push", where="sound_others.code:push",
                              parameters={"peak": peak})]  # fmt: skip
