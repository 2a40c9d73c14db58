"""An effect that every scene calls for and an indenter, in a package that changes NumPy when it is imported."""

import numpy as np

from tactbench.plugin import (
    ChannelTarget,
    Indenter,
    IndenterDescriptor,
    PlannedScene,
    Scene,
    TaskDescriptor,
    TaskSpec,
    hookimpl,
    staircase,
)  # fmt: skip
from tactbench.plugin.simulation import EffectDescriptor, Reason

TACTBENCH_API = 2

np.round = np.floor

NAMING = {
    "indenter": {"indenter": Indenter(shape="patching-bowl")},
    "effect": {"simulation": {"effects": ("patching",)}},
}


@hookimpl
def tactbench_effects():
    code = {"where": "patching_tactile:apply", "called_for": "patching_tactile:always"}
    return [EffectDescriptor(name="patching", title="Nothing", produces=("disturbance",), **code)]


@hookimpl
def tactbench_indenters():
    return [IndenterDescriptor(name="patching-bowl", title="A bowl", where="patching_tactile:bowl")]


@hookimpl
def tactbench_tasks():
    profile = staircase(peak=2, steps=1, rise=1, dwell=1, rate=20)
    for what, naming in NAMING.items():
        scenes = tuple(
            PlannedScene(role=role, scene=Scene(name=f"{what}-{role}", session=role, profile=profile, **naming))
            for role in ("train", "test")
        )
        yield TaskDescriptor(spec=TaskSpec(
            name=f"patching-{what}", title="Nothing", question="How large is the force?", kind="regression", unit="N",
            target=ChannelTarget(kind="force", unit="N"), scenes=scenes, metric="rmse", protocols=("deployable",),
            splits=("roles",), estimators=(), baselines=("mean",),
        ))  # fmt: skip


def bowl(x_mm, y_mm):
    """Return the height of a blunt body."""
    return (x_mm**2 + y_mm**2) / 20


def always(scene, sensor):
    return Reason(True, "every scene")


def apply(run):
    """Change nothing."""
