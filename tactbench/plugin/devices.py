"""The door to devices: drivers, emulators, links, rig files, and the rigs that use them.

``docs/hardware.md`` shows a driver, ``docs/links.md`` what it speaks through, ``docs/emulation.md`` what stands in for
the device.
"""

from typing import TYPE_CHECKING

from tactbench.core.errors import LinkClosed, LinkEnded, LinkError, LinkTimeout, LinkUnplugged
from tactbench.core.on_demand import on_demand
from tactbench.core.plugins.checks import CheckTable, RigCheck
from tactbench.core.plugins.interfaces import DeviceAcquisition, Operator
from tactbench.core.spec.recording import Emulation, StreamClock, StreamCounts
from tactbench.core.spec.rig import DeviceDescriptor
from tactbench.core.spec.rig_file import FORCE, DeviceEntry, ForceEntry, NamedDevice, RigFile

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
    from tactbench.devices.driver import Driver, DriverSettings
    from tactbench.devices.emulation.emulated_devices import EmulatedDevice, EmulatedDevices
    from tactbench.devices.emulation.scene_samples import SceneSamples
    from tactbench.devices.emulator import DeviceEmulator, EmulatorSettings, Senses, Sent, SpiDeviceEmulator
    from tactbench.devices.fault import Fault, fault_concerns
    from tactbench.devices.log import DeviceLog
    from tactbench.devices.reading import Reading
    from tactbench.devices.row_driver import RowDriver, Sample
    from tactbench.devices.row_emulator import RowEmulator
    from tactbench.devices.sequence import SequenceCheck, Unwrap
    from tactbench.links.address import open_link
    from tactbench.links.bridge_frame import Frame, FrameDecoder, encode_frame
    from tactbench.links.byte_link import ByteLink
    from tactbench.links.can_link import CanFrame, CanLink
    from tactbench.links.can_log import CanLog
    from tactbench.links.datagram_link import DatagramLink
    from tactbench.links.link import Clock, Link, Received
    from tactbench.links.spi_bridge import SpiBridge
    from tactbench.links.spi_link import SpiLink, SpiReply, SpiStep

__all__ = [
    "FORCE",
    "ByteLink",
    "CanFrame",
    "CanLink",
    "CanLog",
    "CheckTable",
    "Clock",
    "DatagramLink",
    "DeviceAcquisition",
    "DeviceDescriptor",
    "DeviceEmulator",
    "DeviceEntry",
    "DeviceLog",
    "Driver",
    "DriverSettings",
    "EmulatedDevice",
    "EmulatedDevices",
    "Emulation",
    "EmulatorSettings",
    "Fault",
    "ForceEntry",
    "Frame",
    "FrameDecoder",
    "Link",
    "LinkClosed",
    "LinkEnded",
    "LinkError",
    "LinkTimeout",
    "LinkUnplugged",
    "NamedDevice",
    "Operator",
    "PressingForce",
    "Reading",
    "Received",
    "RigCheck",
    "RigFile",
    "RowDriver",
    "RowEmulator",
    "Sample",
    "SceneSamples",
    "Senses",
    "Sent",
    "SequenceCheck",
    "SpiBridge",
    "SpiDeviceEmulator",
    "SpiLink",
    "SpiReply",
    "SpiStep",
    "StreamClock",
    "StreamCounts",
    "Unwrap",
    "ask_operator",
    "drivers_of",
    "emulation_of",
    "emulators_of",
    "encode_frame",
    "fault_concerns",
    "open_link",
    "physics_of",
    "with_sensor",
]

__getattr__ = on_demand(__name__)
