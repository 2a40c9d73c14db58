"""The devices of a rig file: their emulators and their drivers, from what is installed."""

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
from tactbench.devices.emulation.emulated_devices import EmulatedDevice
from tactbench.devices.emulation.line import split_faults
from tactbench.devices.emulation.scene_samples import PRESSING_FORCE
from tactbench.devices.emulator import EmulatorSettings, Senses
from tactbench.links.address import open_link
from tactbench.links.link import Clock, Link


def with_sensor(file: RigFile, sensor: str) -> RigFile:
    """Return a rig file with one of its sensors; raises UsageError if it has no entry for it."""
    if sensor not in file.sensors:
        raise UsageError(
            f"The rig file has no entry for the sensor {sensor!r}; it has {', '.join(file.sensors)}.",
            hint=f"Add `{sensor}:` with its link under `sensors:`.",
        )
    return file.model_copy(update={"sensors": {sensor: file.sensors[sensor]}})


def ask_operator(file: RigFile, operator: Operator | None, doing: str, text: str) -> bool:
    """Let somebody do at the rig what `text` says, in a word `doing`; return whether it was done.

    Devices that are all emulated need nobody.

    Raises
    ------
    RigError
        If nobody is there.
    """
    told = bool(file.emulation.control)
    if all(entry.emulated or (entry.emulator and told) for entry in file.entries().values()):
        return False
    if operator is None:
        raise RigError(
            f"Somebody has to {doing}: {text}",
            hint="Start it at a terminal, or use a rig file with emulated devices.",
        )
    operator.prompt(text)
    return True


def emulators_of(file: RigFile, registry: Registry, sensor: str, senses: Senses) -> dict[str, EmulatedDevice]:
    """Return the emulated devices of a rig with one of its sensors, by the names of :meth:`RigFile.entries`.

    `senses` is what the channels read. Of the force sensor, its entry's channel gets the pressing force (``fz``) with
    the entry's sign, and all its other channels are at rest. Each device draws from a generator of its own, made of the
    file's seed and its name: a further device changes nothing for the others.

    Raises
    ------
    UnknownNameError
        If the sensor or a device is not installed.
    UsageError
        If the file has no entry for the sensor, a device has no emulator, or an option or fault is not known.
    """
    devices = {}
    for name, (entry, descriptor) in _used(file, registry, sensor).items():
        if entry.emulated:
            with _entry(name):
                devices[name] = emulated_device(descriptor, name, entry, senses, file.emulation.seed)
    return devices


def emulated_device(
    descriptor: SensorDescriptor | DeviceDescriptor, name: str, entry: DeviceEntry, senses: Senses, seed: int
) -> EmulatedDevice:
    """Return one emulated device; see :func:`emulators_of`."""
    if descriptor.emulator is None or descriptor.emulated_link is None:
        raise UsageError(
            f"{descriptor.name} has no emulator{' on a kind of link' if descriptor.emulator else ''}.",
            hint="Give the address of a real one under `link:`, or leave it out.",
        )
    own = senses
    if isinstance(entry, ForceEntry):
        channel, sign = entry.channel, entry.sign

        def own(t_s: float) -> Mapping[str, float]:
            return {channel: sign * senses(t_s).get(PRESSING_FORCE, 0.0)}

    of_link, of_device = split_faults(entry.faults)
    rng = np.random.default_rng([seed, *name.encode()])
    options = options_of(descriptor, entry)
    emulator = load_object(descriptor.emulator)(EmulatorSettings(own, rng, options, of_device))
    baud = options.get("baud")
    return EmulatedDevice(descriptor.emulated_link, emulator, of_link, baud if isinstance(baud, int) else None)


def drivers_of(
    file: RigFile,
    registry: Registry,
    sensor: str,
    links: Mapping[str, Callable[[], Link]],
    clock: Clock,
    names: Collection[str] | None = None,
) -> dict[str, Driver]:
    """Open devices of a rig; return their drivers by the names of :meth:`RigFile.entries`. Close each.

    Parameters
    ----------
    links
        By name: what opens the links of emulated devices. The others are opened by the file's addresses.
    clock
        The host's.
    names
        Which ones; None: the sensor, and the force sensor if the file has one.

    Raises
    ------
    UnknownNameError
        If the sensor or the force sensor is not installed.
    UsageError
        If the file has no entry for the sensor, a device has no driver, or an option is not known.
    LinkError, RigError
        If a link cannot be opened, or a device refuses. What was opened before is closed again.
    """
    drivers: dict[str, Driver] = {}
    with ExitStack() as opened:
        for name, (entry, descriptor) in _used(file, registry, sensor).items():
            if name not in ((sensor, FORCE) if names is None else names):
                continue
            with _entry(name):
                drivers[name] = open_driver(descriptor, entry, clock, links.get(name))
            opened.callback(drivers[name].close)
        opened.pop_all()
    return drivers


def open_driver(
    descriptor: SensorDescriptor | DeviceDescriptor,
    entry: DeviceEntry,
    clock: Clock,
    link: Callable[[], Link] | None = None,
) -> Driver:
    """Open one device; see :func:`drivers_of`. `link` opens that of an emulated one."""
    if descriptor.driver is None:
        raise UsageError(
            f"{descriptor.name} has no driver: it can be simulated or replayed, not read.",
            hint="A plugin's SensorDescriptor names one; see docs/plugins.md.",
        )
    if not entry.emulated:
        link = partial(open_link, entry.link, clock)
    elif link is None:
        raise UsageError(
            f"{descriptor.name} is emulated, and nothing emulates it here.",
            hint="Give the address of its link: `tactbench emulate` prints one.",
        )
    streams = descriptor.spec.streams if isinstance(descriptor, SensorDescriptor) else ()
    settings = DriverSettings(link, streams, options_of(descriptor, entry), clock)
    driver: Driver = load_object(descriptor.driver)(settings)
    return driver


def _used(
    file: RigFile, registry: Registry, sensor: str
) -> dict[str, tuple[DeviceEntry, SensorDescriptor | DeviceDescriptor]]:
    """Return the entries of a rig with one sensor, each with what is installed for it."""
    used: dict[str, tuple[DeviceEntry, SensorDescriptor | DeviceDescriptor]] = {}
    for name, entry in with_sensor(file, sensor).entries().items():
        with _entry(name):
            used[name] = entry, descriptor_of(registry, name, entry)
    return used


def options_of(descriptor: SensorDescriptor | DeviceDescriptor, entry: DeviceEntry) -> dict[str, Scalar | bool]:
    """Return the options of an entry, with those of the emulated device that it leaves out, if it is one."""
    return {**(descriptor.emulated_options if entry.emulated else {}), **entry.options}


def descriptor_of(registry: Registry, name: str, entry: DeviceEntry) -> SensorDescriptor | DeviceDescriptor:
    """Return what is installed for an entry of a rig file.

    Raises
    ------
    UnknownNameError
        If nothing of that name is.
    UsageError
        If the force sensor is none.
    """
    if not isinstance(entry, ForceEntry | NamedDevice):
        return registry.sensors[name]
    descriptor = registry.devices[entry.device]
    if isinstance(entry, ForceEntry) and descriptor.kind != "force":
        known = ", ".join(device.name for device in registry.devices if device.kind == "force") or "none"
        raise UsageError(f"{entry.device} is a {descriptor.kind}, no force sensor.", hint=f"Installed are: {known}.")
    return descriptor


@contextmanager
def _entry(name: str) -> Iterator[Any]:
    """Say in errors which entry of the rig file they are about."""
    try:
        yield
    except TactbenchError as error:
        error.message = f"The rig file's entry {name!r}: {error.message}"
        raise
