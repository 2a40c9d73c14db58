"""Tasks of estimating forces: normal under a flat surface (Karl et al. 2016, III-A), shear, or all three axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import signature
from typing import Any

from tactbench.plugin import (
    ChannelTarget,
    ForcePath,
    Indenter,
    Parameter,
    PlannedScene,
    ProfileDescriptor,
    Published,
    Scene,
    TaskDescriptor,
    TaskSpec,
    VectorTarget,
    hookimpl,
    sine,
    staircase,
)
from tactbench.tasks.surfaces import at_places, few_shots, on_units

TACTBENCH_API = 2

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

# Assumed to be negligible for grasping: the least force that the iCub's fingertip is reported to
# detect (Jamali et al. 2015, A new design of a fingertip for the iCub hand).
SAME_N = 0.05


def _of_eflesh(score_n: float, sensor: str, title: str) -> Published:
    """Return a published error [N] of eFlesh, with remarks on the conditions of its measurement."""
    return Published(
        score=score_n,
        protocol="deployable",
        sensor=sensor,
        split="in-session",
        title=title,
        reference="Pattabiraman et al. 2025, arXiv 2506.09994",
        remark="a small network; the last fifth of one session's rows, as in the authors' published training code, "
        "which gives rows without a load-cell sample the nearest one and scales by all rows, tested ones too; "
        "which session the figure is of is not stated",
    )


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
        _of_eflesh(0.27, "eflesh", "normal force, RMSE, eFlesh"),
    ),
)  # fmt: skip

SHEAR = TaskSpec(
    name="shear-force",
    title="Shear force",
    question="How large is the force along the surface?",
    kind="regression",
    target=ChannelTarget(kind="force", name="shear", unit="N"),
    metric="rmse",
    unit="N",
    equivalence=0.02,  # assumed: a sixth of the published error beside it
    protocols=("deployable",),
    splits=("roles", "session", "press", "in-session", "shuffled"),
    estimators=("forest", "ridge"),
    baselines=("mean", "time-index"),
    published=(_of_eflesh(0.12, "eflesh-shear", "shear force, RMSE, eFlesh"),),
)

# No simulated scenes: electrodes and taxels of the twin's sensors do not respond to shear, and their score would be
# that of the normal force alone.
THREE_AXIS = TaskSpec(
    name="three-axis-force",
    title="Three-axis force",
    question="How large are the normal force and both tangential ones?",
    kind="regression",
    target=VectorTarget(kind="force", names=("fx", "fy", "fz"), unit="N"),
    metric="mean_euclidean_error",
    unit="N",
    equivalence=0.05,  # assumed: as for the normal force
    protocols=("deployable", "deployable-untared"),
    splits=("roles", "session", "press", "in-session", "shuffled"),
    estimators=("forest-100", "ridge"),
    baselines=("mean", "time-index"),
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptors of the force tasks."""
    return [TaskDescriptor(spec=one) for one in (SPEC, SHEAR, THREE_AXIS)]


@hookimpl
def tactbench_profiles() -> list[ProfileDescriptor]:
    """Return descriptors of the force profiles in the plugin interface, so that scenes can name them."""
    above_0 = 1e-3
    peak = {"unit": "N", "text": "the largest force"}
    hold = {"unit": "s", "text": "how long nothing presses before"}
    rate = {"unit": "Hz", "least": 1.0, "text": "samples a second of the reference clock"}
    return [
        _profile(
            staircase, "staircase", "Equal steps up to a force and down again, each level held",
            peak=peak,
            steps={"unit": "1", "least": 1, "text": "levels above zero, a whole number"},
            dwell={"unit": "s", "least": above_0, "text": "how long each level is held"},
            rise={"unit": "s", "least": above_0, "text": "how long each step takes"},
            hold=hold, rate=rate,
        ),
        _profile(
            sine, "sine", "A force that swings about a mean",
            mean={"unit": "N", "text": "about which it swings"},
            amplitude={"unit": "N", "text": "by how much, at most the mean"},
            frequency={"unit": "Hz", "least": 1e-3, "most": 1e3, "text": "periods a second"},
            periods={"unit": "1", "least": 1, "text": "how many, a whole number"},
            rise={"unit": "s", "least": above_0, "text": "how long the way up to the first force takes"},
            hold=hold, rate=rate,
        ),
    ]  # fmt: skip


def _profile(
    function: Callable[..., ForcePath], name: str, title: str, **parameters: Mapping[str, Any]
) -> ProfileDescriptor:
    """Return the descriptor of a profile function in the plugin interface, with the function's own defaults."""
    own = signature(function).parameters
    return ProfileDescriptor(
        name=name,
        title=title,
        where=f"tactbench.plugin:{function.__name__}",
        parameters={one: Parameter(default=own[one].default, **fields) for one, fields in parameters.items()},
    )
