"""Tasks with one flaw each."""

import math

from tactbench.plugin import (
    ChannelTarget,
    ForceRamp,
    Indenter,
    LabelTarget,
    PlannedScene,
    Published,
    Scene,
    Summary,
    TaskDescriptor,
    TaskSpec,
    assumed,
    hookimpl,
)

TACTBENCH_API = 2


def planned(role, shape, **changes):
    radius = {"flat": None, "round": assumed(10.0, "mm", "its maker")}[shape]
    scene = Scene(name=f"{role}-{shape}", indenter=Indenter(radius=radius), session=role, labels={"shape": shape})
    return PlannedScene(scene=scene.model_copy(update=changes), role=role)


SCENES = tuple(planned(role, shape) for role in ("train", "test") for shape in ("flat", "round"))
SHAPE = TaskSpec(
    name="sound-task",
    title="Flat or round",
    question="Is the indenter flat or round?",
    kind="classification",
    target=LabelTarget(name="shape"),
    metric="macro_f1",
    scenes=SCENES,
    protocols=("deployable",),
    splits=("roles", "session"),
    estimators=("logistic",),
    baselines=("majority",),
)


def features_of_nan(streams):
    return {"spread": math.nan}


def last(**changes):
    """Return the scenes with another last one."""
    return (*SCENES[:-1], PlannedScene(role="test", scene=SCENES[-1].scene.model_copy(update=changes)))


FORCE = {
    "kind": "regression", "target": ChannelTarget(), "metric": "rmse", "unit": "N", "estimators": ("ols",),
    "baselines": ("mean",),
}  # fmt: skip
NO_TIME = ForceRamp(duration=assumed(0.0, "s", "its maker"))
FLAWS = {
    "of-no-metric": {"metric": "f1_macro"},
    "of-a-metric-of-classes": {"metric": "rmse"},
    "in-another-unit": {"unit": "N"},
    "of-no-protocol": {"protocols": ("deployed",)},
    "of-no-split": {"splits": ("roles", "sesion")},
    "with-a-campaign-for-nothing": {"campaigns": {"placement": SCENES}},
    "of-no-estimator": {"estimators": ("logistics",)},
    "with-a-baseline-that-learns": {"baselines": ("majority", "forest")},
    "of-no-label": {"target": LabelTarget(name="form")},
    "with-an-untaught-class": {"scenes": last(labels={"shape": "edge"})},
    "without-a-test": {"scenes": SCENES[:2]},
    "with-a-scene-twice": {"scenes": (*SCENES, SCENES[-1])},
    "that-looks-elsewhere": {"scenes": last(observe=("ac_pressure",))},
    "that-sees-its-answer": {**FORCE, "features": ("taxel", "force")},
    "of-a-shear-that-nobody-records": {**FORCE, "target": ChannelTarget(name="shear")},
    "of-a-force-in-metres": {**FORCE, "target": ChannelTarget(unit="mm"), "unit": "mm"},
    "in-kilonewtons": {**FORCE, "unit": "kN"},
    "with-features-of-nan": {
        "answer_per": "recording", "summaries": (Summary(measure="mean"),),
        "features_by": "flawed_tactile.tasks:features_of_nan",
    },
    "compared-with-nothing": {"published": (Published(score=0.9, reference="a paper", protocol="karl2016"),)},
    "that-presses-nothing": {"scenes": last(profile=NO_TIME)},
    "that-asks-nothing": {"question": "Flat, round"},
}  # fmt: skip


@hookimpl
def tactbench_tasks():
    flawed = (SHAPE.model_copy(update={"name": f"task-{name}", **changes}) for name, changes in FLAWS.items())
    return [TaskDescriptor(spec=spec) for spec in (SHAPE, *flawed)]
