"""Public interface for authors of plugins: sensors, tasks, estimators, rigs and more.

A plugin is a module, named by an entry point of group ``tactbench``, that states ``TACTBENCH_API = 2`` and implements
one or more of the hooks; ``docs/plugins.md`` shows how. Names for simulated sensors are in
:mod:`tactbench.plugin.simulation`; names for drivers, emulators and links are in :mod:`tactbench.plugin.devices`.
"""

from tactbench.core.errors import (
    DataError as DataError,
    MissingRecordingError as MissingRecordingError,
    NotApplicable as NotApplicable,
    PluginContractError as PluginContractError,
    RigError as RigError,
    TactbenchError as TactbenchError,
    UsageError as UsageError,
)
from tactbench.core.on_demand import public_names
from tactbench.core.plugins.hookspecs import API_VERSION as API_VERSION, hookimpl as hookimpl
from tactbench.core.plugins.interfaces import (
    Acquisition as Acquisition,
    Estimator as Estimator,
    ReplayRig as ReplayRig,
    Rig as Rig,
    RigContext as RigContext,
)
from tactbench.core.plugins.registry import load_object as load_object, load_registry as load_registry
from tactbench.core.samples import (
    Block as Block,
    FloatArray as FloatArray,
    Quality as Quality,
    StreamReadings as StreamReadings,
)
from tactbench.core.spec.events import AlarmPolicy as AlarmPolicy, SlipTarget as SlipTarget
from tactbench.core.spec.force_profiles import sine as sine, staircase as staircase
from tactbench.core.spec.profile import ForcePath as ForcePath, ForceRamp as ForceRamp
from tactbench.core.spec.quantity import (
    Quantity as Quantity,
    Source as Source,
    assumed as assumed,
    derived as derived,
    measured as measured,
    sourced as sourced,
)
from tactbench.core.spec.recording import PlanEntry as PlanEntry, Scalar as Scalar
from tactbench.core.spec.rig import (
    EstimatorDescriptor as EstimatorDescriptor,
    IndenterDescriptor as IndenterDescriptor,
    ManualFrame as ManualFrame,
    Parameter as Parameter,
    ProfileDescriptor as ProfileDescriptor,
    RigDescriptor as RigDescriptor,
    SensorDescriptor as SensorDescriptor,
    TaskDescriptor as TaskDescriptor,
)
from tactbench.core.spec.scene import Indenter as Indenter, Placement as Placement, Role as Role, Scene as Scene
from tactbench.core.spec.sensor import (
    ChannelKind as ChannelKind,
    ChannelSpec as ChannelSpec,
    DataSheet as DataSheet,
    PhysicalRange as PhysicalRange,
    SensorSpec as SensorSpec,
    Statement as Statement,
    StreamSpec as StreamSpec,
)
from tactbench.core.spec.task import (
    ChannelTarget as ChannelTarget,
    LabelTarget as LabelTarget,
    PlannedScene as PlannedScene,
    Published as Published,
    Summary as Summary,
    TaskSpec as TaskSpec,
    VectorTarget as VectorTarget,
)

__all__ = public_names(__name__)
