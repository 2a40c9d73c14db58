"""Public interface for authors of plugins: sensors, tasks, estimators, rigs and more.

A plugin is a module, named by an entry point of group ``tactbench``, that states ``TACTBENCH_API = 2`` and implements
one or more of the hooks; ``docs/plugins.md`` shows how. Names for simulated sensors are in
:mod:`tactbench.plugin.simulation`; names for drivers, emulators and links are in :mod:`tactbench.plugin.devices`.
"""

from tactbench.core.errors import (
    DataError,
    MissingRecordingError,
    NotApplicable,
    PluginContractError,
    RigError,
    TactbenchError,
    UsageError,
)
from tactbench.core.plugins.hookspecs import API_VERSION, hookimpl
from tactbench.core.plugins.interfaces import Acquisition, Estimator, ReplayRig, Rig, RigContext
from tactbench.core.plugins.registry import load_object, load_registry
from tactbench.core.samples import Block, FloatArray, Quality, StreamReadings
from tactbench.core.spec.events import AlarmPolicy, SlipTarget
from tactbench.core.spec.profile import ForcePath, ForceRamp, sine, staircase
from tactbench.core.spec.quantity import Quantity, Source, assumed, derived, measured, sourced
from tactbench.core.spec.recording import PlanEntry, Scalar
from tactbench.core.spec.rig import (
    EstimatorDescriptor,
    IndenterDescriptor,
    ManualFrame,
    Parameter,
    ProfileDescriptor,
    RigDescriptor,
    SensorDescriptor,
    TaskDescriptor,
)
from tactbench.core.spec.scene import Indenter, Placement, Role, Scene
from tactbench.core.spec.sensor import (
    ChannelKind,
    ChannelSpec,
    DataSheet,
    PhysicalRange,
    SensorSpec,
    Statement,
    StreamSpec,
)
from tactbench.core.spec.task import (
    ChannelTarget,
    LabelTarget,
    PlannedScene,
    Published,
    Summary,
    TaskSpec,
    VectorTarget,
)

__all__ = [
    "API_VERSION",
    "Acquisition",
    "AlarmPolicy",
    "Block",
    "ChannelKind",
    "ChannelSpec",
    "ChannelTarget",
    "DataError",
    "DataSheet",
    "Estimator",
    "EstimatorDescriptor",
    "FloatArray",
    "ForcePath",
    "ForceRamp",
    "Indenter",
    "IndenterDescriptor",
    "LabelTarget",
    "ManualFrame",
    "MissingRecordingError",
    "NotApplicable",
    "Parameter",
    "PhysicalRange",
    "Placement",
    "PlanEntry",
    "PlannedScene",
    "PluginContractError",
    "ProfileDescriptor",
    "Published",
    "Quality",
    "Quantity",
    "ReplayRig",
    "Rig",
    "RigContext",
    "RigDescriptor",
    "RigError",
    "Role",
    "Scalar",
    "Scene",
    "SensorDescriptor",
    "SensorSpec",
    "SlipTarget",
    "Source",
    "Statement",
    "StreamReadings",
    "StreamSpec",
    "Summary",
    "TactbenchError",
    "TaskDescriptor",
    "TaskSpec",
    "UsageError",
    "VectorTarget",
    "assumed",
    "derived",
    "hookimpl",
    "load_object",
    "load_registry",
    "measured",
    "sine",
    "sourced",
    "staircase",
]
