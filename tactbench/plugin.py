"""The door: everything a plugin author imports.

A plugin is a module, named by an entry point of group ``tactbench``, that states ``TACTBENCH_API = 1`` and implements
one or more of the five hooks. See ``docs/plugins.md``.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import (
    DataError,
    LinkClosed,
    LinkEnded,
    LinkError,
    LinkTimeout,
    LinkUnplugged,
    MissingRecordingError,
    NotApplicable,
    PluginContractError,
    RigError,
    TactbenchError,
    UnknownNameError,
    UsageError,
)
from tactbench.core.plugins.checks import Check, CheckTable, RigCheck, Verdict
from tactbench.core.plugins.cost import CostJob, CostPoint, CostStudy
from tactbench.core.plugins.hookspecs import API_VERSION, hookimpl
from tactbench.core.plugins.interfaces import (
    Acquisition,
    DeviceAcquisition,
    Estimator,
    Explained,
    Operator,
    Reason,
    Rig,
    RigContext,
    Shelf,
    SimulatedPress,
    Transducer,
    TransducerFactory,
)
from tactbench.core.plugins.registry import load_object, load_registry
from tactbench.core.samples import Block, Quality, SkinGrid, SkinState
from tactbench.core.spec.drive import ForceLoop
from tactbench.core.spec.figure import RealFigure
from tactbench.core.spec.quantity import Quantity, Source, assumed, derived, measured, sourced
from tactbench.core.spec.recording import Emulation, PlanEntry, Scalar, StreamClock, StreamCounts
from tactbench.core.spec.rig import (
    DeviceDescriptor,
    EffectDescriptor,
    EstimatorDescriptor,
    RigDescriptor,
    SensorDescriptor,
    TaskDescriptor,
)
from tactbench.core.spec.rig_file import FORCE, DeviceEntry, EmulationSettings, ForceEntry, NamedDevice, RigFile
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
    from tactbench.core.plugins.rig_devices import (
        PressingForce,
        ask_operator,
        drivers_of,
        emulation_of,
        emulators_of,
        physics_of,
        with_sensor,
    )
    from tactbench.core.recording.reader import Recording, open_recording
    from tactbench.core.samples import FloatArray
    from tactbench.devices.driver import Driver, DriverFactory, DriverSettings
    from tactbench.devices.emulation.emulated_devices import EmulatedDevice, EmulatedDevices
    from tactbench.devices.emulation.scene_samples import SceneSamples
    from tactbench.devices.emulator import (
        DeviceEmulator,
        EmulatorFactory,
        EmulatorSettings,
        Senses,
        Sent,
        SpiDeviceEmulator,
    )
    from tactbench.devices.fault import Fault, fault_concerns
    from tactbench.devices.log import DeviceLog, LogReader
    from tactbench.devices.reading import Reading
    from tactbench.devices.sequence import SequenceCheck, Unwrap
    from tactbench.links.address import LinkAddress, open_link
    from tactbench.links.bridge_emulator import BridgeEmulator
    from tactbench.links.bridge_frame import Frame, FrameDecoder, encode_frame
    from tactbench.links.byte_link import ByteLink, SerialLink
    from tactbench.links.can_link import CanBus, CanFrame, CanLink
    from tactbench.links.can_log import CanLog
    from tactbench.links.datagram_link import DatagramLink, UdpLink
    from tactbench.links.link import Clock, Link, Received
    from tactbench.links.spi_bridge import SpiBridge
    from tactbench.links.spi_link import SpiLink, SpiReply, SpiStep
    from tactbench.links.spidev import SpidevLink

__all__ = [
    "API_VERSION",
    "FORCE",
    "Acquisition",
    "Block",
    "BondedLayer",
    "BridgeEmulator",
    "ByteLink",
    "CanBus",
    "CanFrame",
    "CanLink",
    "CanLog",
    "ChannelKind",
    "ChannelSpec",
    "ChannelTarget",
    "Check",
    "CheckTable",
    "Clock",
    "CostJob",
    "CostPoint",
    "CostStudy",
    "Creep",
    "DataError",
    "DataSheet",
    "DatagramLink",
    "DeviceAcquisition",
    "DeviceDescriptor",
    "DeviceEmulator",
    "DeviceEntry",
    "DeviceLog",
    "Dome",
    "Driver",
    "DriverFactory",
    "DriverSettings",
    "EffectDescriptor",
    "EmulatedDevice",
    "EmulatedDevices",
    "Emulation",
    "EmulationSettings",
    "EmulatorFactory",
    "EmulatorSettings",
    "Environment",
    "Estimator",
    "EstimatorDescriptor",
    "Explained",
    "Fault",
    "FloatArray",
    "FluidBackedShell",
    "FoamPad",
    "ForceEntry",
    "ForceLoop",
    "ForceRamp",
    "Frame",
    "FrameDecoder",
    "Indenter",
    "LabelTarget",
    "Link",
    "LinkAddress",
    "LinkClosed",
    "LinkEnded",
    "LinkError",
    "LinkTimeout",
    "LinkUnplugged",
    "LogReader",
    "MissingRecordingError",
    "NamedDevice",
    "NotApplicable",
    "Nuisances",
    "Operator",
    "PhysicalRange",
    "Placement",
    "PlanEntry",
    "PlannedScene",
    "PluginContractError",
    "PressingForce",
    "Published",
    "Quality",
    "Quantity",
    "Reading",
    "RealFigure",
    "Reason",
    "Received",
    "Recording",
    "Rig",
    "RigCheck",
    "RigContext",
    "RigDescriptor",
    "RigError",
    "RigFile",
    "Role",
    "Scalar",
    "Scenario",
    "Scene",
    "SceneSamples",
    "Senses",
    "SensorDescriptor",
    "SensorSpec",
    "Sent",
    "SequenceCheck",
    "SerialLink",
    "SheetTable",
    "Shelf",
    "SimulatedPress",
    "Simulation",
    "Skin",
    "SkinGrid",
    "SkinSheet",
    "SkinState",
    "Slide",
    "Source",
    "SpiBridge",
    "SpiDeviceEmulator",
    "SpiLink",
    "SpiReply",
    "SpiStep",
    "SpidevLink",
    "Statement",
    "StreamClock",
    "StreamCounts",
    "StreamSpec",
    "Surface",
    "TactbenchError",
    "TaskDescriptor",
    "TaskSpec",
    "Transducer",
    "TransducerFactory",
    "UdpLink",
    "UnknownNameError",
    "Unwrap",
    "UsageError",
    "Verdict",
    "ask_operator",
    "assumed",
    "derived",
    "drivers_of",
    "emulation_of",
    "emulators_of",
    "encode_frame",
    "fault_concerns",
    "hookimpl",
    "load_object",
    "load_registry",
    "measured",
    "open_link",
    "open_recording",
    "physics_of",
    "sourced",
    "with_sensor",
]

_ON_DEMAND = {
    "BridgeEmulator": "tactbench.links.bridge_emulator",
    "ByteLink": "tactbench.links.byte_link",
    "CanBus": "tactbench.links.can_link",
    "CanFrame": "tactbench.links.can_link",
    "CanLink": "tactbench.links.can_link",
    "CanLog": "tactbench.links.can_log",
    "Clock": "tactbench.links.link",
    "DatagramLink": "tactbench.links.datagram_link",
    "DeviceEmulator": "tactbench.devices.emulator",
    "DeviceLog": "tactbench.devices.log",
    "Driver": "tactbench.devices.driver",
    "DriverFactory": "tactbench.devices.driver",
    "DriverSettings": "tactbench.devices.driver",
    "EmulatedDevice": "tactbench.devices.emulation.emulated_devices",
    "EmulatedDevices": "tactbench.devices.emulation.emulated_devices",
    "EmulatorFactory": "tactbench.devices.emulator",
    "EmulatorSettings": "tactbench.devices.emulator",
    "Fault": "tactbench.devices.fault",
    "FloatArray": "tactbench.core.samples",
    "Frame": "tactbench.links.bridge_frame",
    "FrameDecoder": "tactbench.links.bridge_frame",
    "Link": "tactbench.links.link",
    "LinkAddress": "tactbench.links.address",
    "LogReader": "tactbench.devices.log",
    "Reading": "tactbench.devices.reading",
    "PressingForce": "tactbench.core.plugins.rig_devices",
    "Received": "tactbench.links.link",
    "Recording": "tactbench.core.recording.reader",
    "SceneSamples": "tactbench.devices.emulation.scene_samples",
    "Senses": "tactbench.devices.emulator",
    "Sent": "tactbench.devices.emulator",
    "SequenceCheck": "tactbench.devices.sequence",
    "SerialLink": "tactbench.links.byte_link",
    "SpiBridge": "tactbench.links.spi_bridge",
    "SpiDeviceEmulator": "tactbench.devices.emulator",
    "SpiLink": "tactbench.links.spi_link",
    "SpiReply": "tactbench.links.spi_link",
    "SpiStep": "tactbench.links.spi_link",
    "SpidevLink": "tactbench.links.spidev",
    "UdpLink": "tactbench.links.datagram_link",
    "Unwrap": "tactbench.devices.sequence",
    "drivers_of": "tactbench.core.plugins.rig_devices",
    "ask_operator": "tactbench.core.plugins.rig_devices",
    "emulation_of": "tactbench.core.plugins.rig_devices",
    "physics_of": "tactbench.core.plugins.rig_devices",
    "emulators_of": "tactbench.core.plugins.rig_devices",
    "encode_frame": "tactbench.links.bridge_frame",
    "fault_concerns": "tactbench.devices.fault",
    "open_link": "tactbench.links.address",
    "open_recording": "tactbench.core.recording.reader",
    "with_sensor": "tactbench.core.plugins.rig_devices",
}


def __getattr__(name: str) -> Any:
    """Import what stands on numpy, and links, when somebody asks for it: a plugin that is only listed need not."""
    if name not in _ON_DEMAND:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found = getattr(import_module(_ON_DEMAND[name]), name)
    return found
