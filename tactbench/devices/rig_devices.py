"""Devices of a rig file: emulators and drivers are made by the installed plugins."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any

import numpy as np

from tactbench.core.errors import RigError, TactbenchError, UsageError
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import Registry, load_object
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.rig import DeviceDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import FORCE, DeviceEntry, ForceEntry, NamedDevice, RigFile
from tactbench.devices.driver import Driver, DriverSettings
from tactbench.devices.emulation.line import split_faults
from tactbench.devices.emulation.virtual_time import EmulatedDevice
from tactbench.devices.emulator import EmulatorSettings, Senses
from tactbench.links.address import open_link
from tactbench.links.link import Clock, Link

PRESSING_FORCE = "fz"
"""Channel name of the force on the sensor in simulated rigs [N], positive when pressing."""


def with_sensor(file: RigFile, sensor: str) -> RigFile:
    """Return a copy of a rig file with only one of its sensors; raises UsageError if the sensor has no entry."""
    if sensor not in file.sensors:
        raise UsageError(
            f"The rig file has no entry for the sensor {sensor!r}; it has {', '.join(file.sensors)}.",
            hint=f"Add `{sensor}:` with its link under `sensors:`.",
        )
    return file.model_copy(update={"sensors": {sensor: file.sensors[sensor]}})


def ask_operator(file: RigFile, operator: Operator | None, doing: str, text: str) -> bool:
    """Prompt the operator with `text` (in short, `doing`); return True after confirmation, False if none is needed.

    No operator is needed if all devices are emulated.

    Raises
    ------
    RigError
        If there is no operator.
    """
    announced = bool(file.emulation.control)
    if all(entry.emulated or (entry.emulator and announced) for entry in file.entries().values()):
        return False
    if operator is None:
        hint = "Start the command at a terminal, or use a rig file with emulated devices."
        raise RigError(f"An operator has to {doing}: {text}", hint=hint)
    operator.prompt(text)
    return True


def emulators_of(file: RigFile, registry: Registry, sensor: str, senses: Senses) -> dict[str, EmulatedDevice]:
    """Return the emulated devices of a rig with one of its sensors, by the names of :meth:`RigFile.entries`.

    The channels read `senses`. In the force sensor, the channel of its entry gets the pressing force (``fz``) with the
    entry's sign, its other channels are at rest. Each device has its own random generator, made of the file's seed and
    the device's name: a further device does not change the noise of others.

    Raises
    ------
    UnknownNameError
        If the sensor or a device is not installed.
    UsageError
        If the file has no entry for the sensor, a device has no emulator, or an option or fault is not known.
    """
    devices = {}
    for name, entry in with_sensor(file, sensor).entries().items():
        with _entry(name):
            descriptor = descriptor_of(registry, name, entry)
            if entry.emulated:
                devices[name] = emulated_device(descriptor, name, entry, senses, file.emulation.seed)
    return devices


def emulated_device(
    descriptor: SensorDescriptor | DeviceDescriptor, name: str, entry: DeviceEntry, senses: Senses, seed: int
) -> EmulatedDevice:
    """Return one emulated device from its rig-file entry; see :func:`emulators_of`."""
    if descriptor.emulator is None or descriptor.emulated_link is None:
        raise UsageError(
            f"{descriptor.name} cannot be emulated{' on a kind of link' if descriptor.emulator else ''}.",
            hint="Give the address of a real device under `link:`, or leave the device out.",
        )
    own = senses
    if isinstance(entry, ForceEntry):
        channel, sign = entry.channel, entry.sign

        def own(t_s: float) -> Mapping[str, float]:
            return {channel: sign * senses(t_s).get(PRESSING_FORCE, 0.0)}

    of_link, of_device = split_faults(entry.faults)
    rng = np.random.default_rng([seed, *name.encode()])
    settings = EmulatorSettings(own, rng, options_of(descriptor, entry), of_device)
    return EmulatedDevice(descriptor.emulated_link, load_object(descriptor.emulator)(settings), of_link)


def drivers_of(
    file: RigFile,
    registry: Registry,
    sensor: str,
    links: Mapping[str, Callable[[], Link]],
    clock: Clock,
    names: Collection[str] | None = None,
) -> dict[str, Driver]:
    """Open devices of a rig; return their drivers by the names of :meth:`RigFile.entries`. The caller closes each.

    Parameters
    ----------
    links
        Functions that open the links of emulated devices, by name. Other links are opened by the file's addresses.
    clock
        Clock of the host.
    names
        Names of the devices to open; None: the sensor, and the force sensor if the file has one.

    Raises
    ------
    UnknownNameError
        If the sensor or the force sensor is not installed.
    UsageError
        If the file has no entry for the sensor, a device has no driver, or an option is not known.
    LinkError, RigError
        If a link cannot be opened, or a device fails. Devices opened before are closed again.
    """
    drivers: dict[str, Driver] = {}
    with ExitStack() as opened:
        for name, entry in with_sensor(file, sensor).entries().items():
            with _entry(name):
                descriptor = descriptor_of(registry, name, entry)
                if name in ((sensor, FORCE) if names is None else names):
                    drivers[name] = opened.enter_context(open_driver(descriptor, entry, clock, links.get(name)))
        opened.pop_all()
    return drivers


def open_driver(
    descriptor: SensorDescriptor | DeviceDescriptor,
    entry: DeviceEntry,
    clock: Clock,
    link: Callable[[], Link] | None = None,
) -> Driver:
    """Open one device, see :func:`drivers_of`; `link` is the function that opens an emulated device's link."""
    if descriptor.driver is None:
        raise UsageError(
            f"{descriptor.name} has no driver: it can be simulated or replayed, not read.",
            hint="Name a driver in the plugin's SensorDescriptor; see docs/plugins.md.",
        )
    if not entry.emulated:
        link = partial(open_link, entry.link, clock)
    elif link is None:
        raise UsageError(
            f"{descriptor.name} is emulated, but this command starts no emulators.",
            hint="Give the address of its link, as printed by `tactbench emulate`.",
        )
    streams = descriptor.spec.streams if isinstance(descriptor, SensorDescriptor) else ()
    settings = DriverSettings(link, streams, options_of(descriptor, entry), clock)
    driver: Driver = load_object(descriptor.driver)(settings)
    return driver


def options_of(descriptor: SensorDescriptor | DeviceDescriptor, entry: DeviceEntry) -> dict[str, Scalar | bool]:
    """Return the options of an entry; for an emulated device, options left out get defaults."""
    return {**(descriptor.emulated_options if entry.emulated else {}), **entry.options}


def descriptor_of(registry: Registry, name: str, entry: DeviceEntry) -> SensorDescriptor | DeviceDescriptor:
    """Return the descriptor of the sensor or device of an entry in a rig file.

    Raises
    ------
    UnknownNameError
        If the sensor or device is not installed.
    UsageError
        If the device under `force` is not a force sensor.
    """
    if not isinstance(entry, ForceEntry | NamedDevice):
        return registry.sensors[name]
    descriptor = registry.devices[entry.device]
    if isinstance(entry, ForceEntry) and descriptor.kind != "force":
        known = ", ".join(device.name for device in registry.devices if device.kind == "force") or "none"
        raise UsageError(f"{entry.device} is a {descriptor.kind}, not a force sensor.", hint=f"Installed are: {known}.")
    return descriptor


@contextmanager
def _entry(name: str) -> Iterator[Any]:
    """Add the name of the rig file's entry to the message of errors."""
    try:
        yield
    except TactbenchError as error:
        error.message = f"The rig file's entry {name!r}: {error.message}"
        raise
