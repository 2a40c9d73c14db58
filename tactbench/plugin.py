"""The door: everything a plugin author imports.

A plugin is a module, named by an entry point of group ``tactbench``, that states ``TACTBENCH_API = 1`` and implements
one or more of the five hooks. See ``docs/plugins.md``.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import (
    DataError,
    MissingRecordingError,
    NotApplicable,
    PluginContractError,
    RigError,
    TactbenchError,
    UsageError,
)
from tactbench.core.plugins.checks import Check, Verdict
from tactbench.core.plugins.cost import CostJob, CostPoint, CostStudy
from tactbench.core.plugins.hookspecs import API_VERSION, hookimpl
from tactbench.core.plugins.interfaces import (
    Acquisition,
    Estimator,
    Explained,
    Reason,
    Rig,
    RigContext,
    Shelf,
    Transducer,
    TransducerFactory,
)
from tactbench.core.plugins.registry import load_object, load_registry
from tactbench.core.samples import Block, Quality, SkinGrid, SkinState
from tactbench.core.spec.drive import ForceLoop
from tactbench.core.spec.figure import RealFigure
from tactbench.core.spec.quantity import Quantity, Source, assumed, derived, measured, sourced
from tactbench.core.spec.recording import PlanEntry, Scalar
from tactbench.core.spec.rig import (
    EffectDescriptor,
    EstimatorDescriptor,
    RigDescriptor,
    SensorDescriptor,
    TaskDescriptor,
)
from tactbench.core.spec.scene import (
    Environment,
    ForceRamp,
    Indenter,
    Placement,
    Role,
    Scene,
    Simulation,
    Slide,
    Surface,
)
from tactbench.core.spec.sensor import (
    ChannelKind,
    ChannelSpec,
    Creep,
    DataSheet,
    Nuisances,
    PhysicalRange,
    Scenario,
    SensorSpec,
    Statement,
    StreamSpec,
)
from tactbench.core.spec.skin import BondedLayer, Dome, FluidBackedShell, FoamPad, SheetTable, Skin, SkinSheet
from tactbench.core.spec.task import ChannelTarget, LabelTarget, PlannedScene, Published, TaskSpec

if TYPE_CHECKING:
    from tactbench.core.recording.reader import Recording, open_recording
    from tactbench.core.samples import FloatArray

__all__ = [
    "API_VERSION",
    "Acquisition",
    "Block",
    "BondedLayer",
    "ChannelKind",
    "ChannelSpec",
    "ChannelTarget",
    "Check",
    "CostJob",
    "CostPoint",
    "CostStudy",
    "Creep",
    "DataError",
    "DataSheet",
    "Dome",
    "EffectDescriptor",
    "Environment",
    "Estimator",
    "EstimatorDescriptor",
    "Explained",
    "FloatArray",
    "FluidBackedShell",
    "FoamPad",
    "ForceLoop",
    "ForceRamp",
    "Indenter",
    "LabelTarget",
    "MissingRecordingError",
    "NotApplicable",
    "Nuisances",
    "PhysicalRange",
    "Placement",
    "PlanEntry",
    "PlannedScene",
    "PluginContractError",
    "Published",
    "Quality",
    "Quantity",
    "RealFigure",
    "Reason",
    "Recording",
    "Rig",
    "RigContext",
    "RigDescriptor",
    "RigError",
    "Role",
    "Scalar",
    "Scenario",
    "Scene",
    "SensorDescriptor",
    "SensorSpec",
    "SheetTable",
    "Shelf",
    "Simulation",
    "Skin",
    "SkinGrid",
    "SkinSheet",
    "SkinState",
    "Slide",
    "Source",
    "Statement",
    "StreamSpec",
    "Surface",
    "TactbenchError",
    "TaskDescriptor",
    "TaskSpec",
    "Transducer",
    "TransducerFactory",
    "UsageError",
    "Verdict",
    "assumed",
    "derived",
    "hookimpl",
    "load_object",
    "load_registry",
    "measured",
    "open_recording",
    "sourced",
]

_NEED_NUMPY = {
    "FloatArray": "tactbench.core.samples",
    "Recording": "tactbench.core.recording.reader",
    "open_recording": "tactbench.core.recording.reader",
}


def __getattr__(name: str) -> Any:
    """Import what stands on numpy when somebody asks for it: a plugin that is only listed need not."""
    if name not in _NEED_NUMPY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found = getattr(import_module(_NEED_NUMPY[name]), name)
    return found
