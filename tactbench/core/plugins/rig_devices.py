"""The devices of a rig file: their emulators and their drivers, from what is installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import PluginContractError, TactbenchError, UsageError
from tactbench.core.plugins.registry import Registry, load_object
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.rig import DeviceDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import DeviceEntry, ForceEntry, NamedDevice, RigFile

if TYPE_CHECKING:
    from tactbench.devices.driver import Driver
    from tactbench.devices.emulation.emulated_devices import EmulatedDevice
    from tactbench.devices.emulator import Senses
    from tactbench.links.link import Clock, Link

FORCE = "force"
"""Name of the force sensor's entry among the devices of a rig file."""


def emulators_of(file: RigFile, registry: Registry, sensor: str, senses: Senses) -> dict[str, EmulatedDevice]:
    """Return the emulated devices of a rig with one sensor, by the names of :meth:`RigFile.entries`.

    Parameters
    ----------
    sensor
        The one that is used; the file's other sensors are left out.
    senses
        What the channels read. Of the force sensor, its entry's channel gets the pressing force (``fz``) with the
        entry's sign, and all its other channels are at rest.

    Returns
    -------
    dict
        Devices that the file says are real are not in it. Each draws from a generator of its own, made of the file's
        seed and its name: a further device changes nothing for the others.

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
    import numpy as np

    from tactbench.devices.emulation.emulated_devices import EmulatedDevice
    from tactbench.devices.emulation.line import split_faults
    from tactbench.devices.emulation.scene_samples import PRESSING_FORCE
    from tactbench.devices.emulator import EmulatorSettings

    if descriptor.emulator is None:
        raise UsageError(
            f"{descriptor.name} has no emulator.",
            hint="Give the address of a real one under `link:`, or leave it out.",
        )
    if descriptor.emulated_link is None:
        raise PluginContractError(
            f"{descriptor.name} has an emulator, but does not say on which kind of link.",
            hint="Its plugin's descriptor needs emulated_link.",
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
    file: RigFile, registry: Registry, sensor: str, links: Mapping[str, Callable[[], Link]], clock: Clock
) -> dict[str, Driver]:
    """Open the sensor and the force sensor of a rig; its other devices are the rig's own business.

    Parameters
    ----------
    links
        By name: what opens the links of emulated devices. The others are opened by the file's addresses.
    clock
        The host's.

    Returns
    -------
    dict
        By the names of :meth:`RigFile.entries`: the sensor's name, and ``force`` if the file has one. Close each.

    Raises
    ------
    UnknownNameError
        If the sensor or the force sensor is not installed.
    UsageError
        If the file has no entry for the sensor, a device has no driver, or an option is not known.
    LinkError, RigError
        If a link cannot be opened, or a device refuses. What was opened before is closed again.
    """
    from tactbench.devices.driver import DriverSettings
    from tactbench.links.address import LinkAddress

    drivers: dict[str, Driver] = {}
    with ExitStack() as opened:
        for name, (entry, descriptor) in _used(file, registry, sensor).items():
            if name not in (sensor, FORCE):
                continue
            with _entry(name):
                if descriptor.driver is None:
                    raise UsageError(
                        f"{descriptor.name} has no driver: it can be simulated or replayed, not read.",
                        hint="A plugin's SensorDescriptor names one; see docs/plugins.md.",
                    )
                if not entry.emulated:
                    opener: Callable[[], Link] = partial(LinkAddress.parse(entry.link).open, clock)
                elif name in links:
                    opener = links[name]
                else:
                    raise UsageError(
                        f"{descriptor.name} is emulated, and nothing emulates it here.",
                        hint="Give the address of its link: `tactbench emulate` prints one.",
                    )
                streams = descriptor.spec.streams if isinstance(descriptor, SensorDescriptor) else ()
                options = options_of(descriptor, entry)
                driver = load_object(descriptor.driver)(DriverSettings(opener, streams, options, clock))
            opened.callback(driver.close)
            drivers[name] = driver
        opened.pop_all()
    return drivers


def _used(
    file: RigFile, registry: Registry, sensor: str
) -> dict[str, tuple[DeviceEntry, SensorDescriptor | DeviceDescriptor]]:
    """Return the entries of a rig with one sensor, each with what is installed for it."""
    if sensor not in file.sensors:
        raise UsageError(
            f"The rig file has no entry for the sensor {sensor!r}; it has {', '.join(file.sensors)}.",
            hint=f"Add `{sensor}:` with its link under `sensors:`.",
        )
    used: dict[str, tuple[DeviceEntry, SensorDescriptor | DeviceDescriptor]] = {}
    for name, entry in file.entries().items():
        if name == sensor or isinstance(entry, ForceEntry | NamedDevice):
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
