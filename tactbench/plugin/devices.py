"""Public interface for devices: drivers, emulators, links, rig files, and the rigs that use them.

``docs/hardware.md`` explains drivers, ``docs/links.md`` links, ``docs/emulation.md`` emulated devices.
"""

from typing import TYPE_CHECKING

from tactbench.core.errors import LinkError as LinkError, LinkTimeout as LinkTimeout, LinkUnplugged as LinkUnplugged
from tactbench.core.on_demand import on_demand, public_names
from tactbench.core.plugins.interfaces import (
    CheckTable as CheckTable,
    DeviceAcquisition as DeviceAcquisition,
    DeviceLog as DeviceLog,
    Operator as Operator,
    RigCheck as RigCheck,
)
from tactbench.core.spec.recording import StreamCounts as StreamCounts
from tactbench.core.spec.rig import DeviceDescriptor as DeviceDescriptor
from tactbench.core.spec.rig_file import FORCE as FORCE, NamedDevice as NamedDevice, RigFile as RigFile

if TYPE_CHECKING:
    from tactbench.devices.control import Control as Control
    from tactbench.devices.driver import (
        Driver as Driver,
        DriverSettings as DriverSettings,
        Options as Options,
        RowDriver as RowDriver,
        Sample as Sample,
        Unwrap as Unwrap,
    )
    from tactbench.devices.emulation.virtual_time import (
        EmulatedDevice as EmulatedDevice,
        EmulatedDevices as EmulatedDevices,
    )
    from tactbench.devices.emulator import (
        DeviceEmulator as DeviceEmulator,
        EmulatorSettings as EmulatorSettings,
        Fault as Fault,
        RowEmulator as RowEmulator,
        Senses as Senses,
        Sent as Sent,
        SpiDeviceEmulator as SpiDeviceEmulator,
        fault_concerns as fault_concerns,
    )
    from tactbench.devices.force_loop import ForceLaw as ForceLaw, LoopModel as LoopModel
    from tactbench.devices.force_watch import samples as samples
    from tactbench.devices.guard import LocalGuard as LocalGuard, largest_force_n as largest_force_n
    from tactbench.devices.guard_messages import (
        Beat as Beat,
        CommandKind as CommandKind,
        Event as Event,
        GuardLostError as GuardLostError,
        GuardState as GuardState,
        Limits as Limits,
    )
    from tactbench.devices.guard_process import (
        DeviceSettings as DeviceSettings,
        Guard as Guard,
        GuardProcess as GuardProcess,
        ProcessSettings as ProcessSettings,
    )
    from tactbench.devices.positioner import (
        HOMING_S as HOMING_S,
        NotReadyError as NotReadyError,
        Positioner as Positioner,
        PositionerError as PositionerError,
        PositionerFacts as PositionerFacts,
        PositionerOptions as PositionerOptions,
        PositionerSilentError as PositionerSilentError,
        PositionerState as PositionerState,
    )
    from tactbench.devices.press import Course as Course, Press as Press, PressPlan as PressPlan
    from tactbench.devices.reading import Reading as Reading
    from tactbench.devices.rig_devices import (
        PressingForce as PressingForce,
        ask_operator as ask_operator,
        drivers_of as drivers_of,
        emulators_of as emulators_of,
        with_sensor as with_sensor,
    )
    from tactbench.devices.scene_emulators import (
        RigEmulators as RigEmulators,
        SceneEmulators as SceneEmulators,
        ScenePhysics as ScenePhysics,
        SceneSamples as SceneSamples,
        physics_of as physics_of,
    )
    from tactbench.links.address import open_link as open_link, read_options as read_options
    from tactbench.links.byte_link import ByteLink as ByteLink
    from tactbench.links.can_link import CanFrame as CanFrame, CanLink as CanLink, read_can_log as read_can_log
    from tactbench.links.datagram_link import DatagramLink as DatagramLink
    from tactbench.links.link import Clock as Clock, Link as Link, Received as Received
    from tactbench.links.spi_bridge import SpiBridge as SpiBridge
    from tactbench.links.spi_link import SpiLink as SpiLink, SpiReply as SpiReply, SpiStep as SpiStep

__all__ = public_names(__name__)
__getattr__ = on_demand(__name__)
