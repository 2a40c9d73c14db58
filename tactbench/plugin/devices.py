"""Public interface for devices: drivers, emulators, links, rig files, and the rigs that use them.

``docs/hardware.md`` explains drivers, ``docs/links.md`` links, ``docs/emulation.md`` emulated devices.
"""

from typing import TYPE_CHECKING

from tactbench.core.errors import LinkError, LinkTimeout, LinkUnplugged
from tactbench.core.on_demand import on_demand
from tactbench.core.plugins.interfaces import CheckTable, DeviceAcquisition, DeviceLog, Operator, RigCheck
from tactbench.core.spec.recording import StreamCounts
from tactbench.core.spec.rig import DeviceDescriptor
from tactbench.core.spec.rig_file import FORCE, NamedDevice, RigFile

if TYPE_CHECKING:
    from tactbench.devices.control import Control
    from tactbench.devices.driver import Driver, DriverSettings, Options, RowDriver, Sample, Unwrap
    from tactbench.devices.emulation.virtual_time import EmulatedDevice, EmulatedDevices
    from tactbench.devices.emulator import (
        DeviceEmulator,
        EmulatorSettings,
        Fault,
        RowEmulator,
        Senses,
        Sent,
        SpiDeviceEmulator,
        fault_concerns,
    )
    from tactbench.devices.force_loop import ForceLaw, LoopModel
    from tactbench.devices.force_watch import samples
    from tactbench.devices.guard import LocalGuard, largest_force_n
    from tactbench.devices.guard_messages import (
        Beat,
        CommandKind,
        Event,
        GuardLostError,
        GuardState,
        Limits,
    )
    from tactbench.devices.guard_process import DeviceSettings, Guard, GuardProcess, ProcessSettings
    from tactbench.devices.positioner import (
        HOMING_S,
        NotReadyError,
        Positioner,
        PositionerError,
        PositionerFacts,
        PositionerOptions,
        PositionerSilentError,
        PositionerState,
    )
    from tactbench.devices.press import Course, Press, PressPlan
    from tactbench.devices.reading import Reading
    from tactbench.devices.rig_devices import PressingForce, ask_operator, drivers_of, emulators_of, with_sensor
    from tactbench.devices.scene_emulators import (
        RigEmulators,
        SceneEmulators,
        ScenePhysics,
        SceneSamples,
        physics_of,
    )
    from tactbench.links.address import open_link, read_options
    from tactbench.links.can_link import CanFrame, CanLink, read_can_log
    from tactbench.links.link import ByteLink, Clock, DatagramLink, Link, Received
    from tactbench.links.spi_link import SpiBridge, SpiLink, SpiReply, SpiStep

__all__ = [
    "FORCE",
    "HOMING_S",
    "Beat",
    "ByteLink",
    "CanFrame",
    "CanLink",
    "CheckTable",
    "Clock",
    "CommandKind",
    "Control",
    "Course",
    "DatagramLink",
    "DeviceAcquisition",
    "DeviceDescriptor",
    "DeviceEmulator",
    "DeviceLog",
    "DeviceSettings",
    "Driver",
    "DriverSettings",
    "EmulatedDevice",
    "EmulatedDevices",
    "EmulatorSettings",
    "Event",
    "Fault",
    "ForceLaw",
    "Guard",
    "GuardLostError",
    "GuardProcess",
    "GuardState",
    "Limits",
    "Link",
    "LinkError",
    "LinkTimeout",
    "LinkUnplugged",
    "LocalGuard",
    "LoopModel",
    "NamedDevice",
    "NotReadyError",
    "Operator",
    "Options",
    "Positioner",
    "PositionerError",
    "PositionerFacts",
    "PositionerOptions",
    "PositionerSilentError",
    "PositionerState",
    "Press",
    "PressPlan",
    "PressingForce",
    "ProcessSettings",
    "Reading",
    "Received",
    "RigCheck",
    "RigEmulators",
    "RigFile",
    "RowDriver",
    "RowEmulator",
    "Sample",
    "SceneEmulators",
    "ScenePhysics",
    "SceneSamples",
    "Senses",
    "Sent",
    "SpiBridge",
    "SpiDeviceEmulator",
    "SpiLink",
    "SpiReply",
    "SpiStep",
    "StreamCounts",
    "Unwrap",
    "ask_operator",
    "drivers_of",
    "emulators_of",
    "fault_concerns",
    "largest_force_n",
    "open_link",
    "physics_of",
    "read_can_log",
    "read_options",
    "samples",
    "with_sensor",
]

__getattr__ = on_demand(__name__)
