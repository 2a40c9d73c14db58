"""Devices of a rig file: emulators and drivers made by the installed plugins, and the recorded force sensor."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from tactbench.core.errors import RigError, TactbenchError, UsageError
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import Registry, load_object
from tactbench.core.samples import Block, FloatArray
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.rig import DeviceDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import FORCE, DeviceEntry, ForceEntry, NamedDevice, RigFile
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec
from tactbench.devices.driver import Driver, DriverSettings
from tactbench.devices.emulation.virtual_time import EmulatedDevice, split_faults
from tactbench.devices.emulator import EmulatorSettings, Senses
from tactbench.links.address import open_link
from tactbench.links.link import Clock, Link

PRESSING_FORCE = "fz"
"""Channel name of the force on the sensor in simulated rigs [N], positive when pressing."""
LEAST_ROWS = 10
"""Least number of rows from which a zero is computed."""
STRETCHES = 30
"""Number of parts of a zero's rows whose means are compared to estimate the scatter."""
STRETCH_S = 0.02
"""Time of correlated noise [s] (assumed: a held sample of 50 Hz). A zero below 0.6 s has no drift test."""
MOST_BAD = 0.1
"""Largest part of a zero's rows that may be marked as bad or not finite (assumed)."""
_PRESSED = "normal"
"""Name of the pressing channel if it is not simply `fz`; tasks accept both names."""


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


class PressingForce:
    """The force sensor of a rig as recorded: the channel of the rig file's `entry`, rising when pressed.

    Attributes
    ----------
    streams
        Streams of the force sensor; the pressing channel has sign 1, and the name `normal` where it is not plain `fz`.
    stream, column, sign
        Stream and column of the pressing force, and 1 or -1: pressing makes the device's channel rise or fall.
    zero
        (channels,) zero of this stream; 0 until :meth:`take_zero`.

    Raises
    ------
    UsageError
        If the force sensor lacks the channel.
    """

    def __init__(self, entry: ForceEntry, streams: tuple[StreamSpec, ...]) -> None:
        self._entry, self.sign, self._counted = entry, entry.sign, ""
        self._plain = (entry.channel, entry.sign) == ("fz", 1)
        places = [(stream, place) for stream in streams for place in range(len(stream.channels))]
        named = {stream.channels[place].name: (stream, place) for stream, place in reversed(places)}
        if entry.channel not in named:
            raise UsageError(
                f"The force sensor {entry.device!r} has no channel {entry.channel!r}; it has {', '.join(named)}.",
                hint="Correct `channel:` under `force:` in the rig file.",
            )
        stream, self.column = named[entry.channel]
        self.stream = stream.name
        channels = list(stream.channels)
        self.zero: FloatArray = np.zeros(len(channels))
        self._forces = {place: channel.name for place, channel in enumerate(channels) if channel.unit == "N"}
        update = {"sign": 1} if self._plain else {"sign": 1, "name": _PRESSED}
        channels[self.column] = ChannelSpec.model_validate({**dict(channels[self.column]), **update})
        pressed = stream.model_copy(update={"channels": tuple(channels)})
        self.streams = tuple(pressed if one is stream else one for one in streams)

    def take_zero(self, blocks: Iterable[Block]) -> None:
        """Set the zero of every channel of the stream to its mean in `blocks`, read without load.

        Every channel of unit N is tested: the size of its mean, its spread, its drift (the last third's mean less the
        first's). Rows that are not finite or marked are counted and left out.

        Raises
        ------
        RigError
            If the sensor is not at rest, or a tenth of its rows are marked or not finite, or it sends fewer than ten.
        """
        entry = self._entry
        if entry.zero_s == 0:
            return
        own = [
            np.where(0 if block.quality is None else block.quality, np.nan, block.data)
            for block in blocks
            if block.stream == self.stream
        ]
        rows = np.concatenate([np.empty((0, self.zero.size)), *own])
        good = np.isfinite(rows).all(axis=1)
        self._counted = f"{len(rows)} rows in {entry.zero_s:g} s, {int((~good).sum())} of them not finite or marked"
        if good.sum() < LEAST_ROWS or good.mean() < 1 - MOST_BAD:
            hint = "Check the force sensor with `tactbench doctor`."
            raise RigError(f"Too few rows are good for the zero of the force: {self._counted}.", hint=hint)
        rows = rows[good]
        wrong = [text for place, name in self._forces.items() for text in self._at_rest(name, rows[:, place])]
        if wrong:
            raise RigError(
                f"The force sensor is not at rest, and its zero is refused: {'; '.join(wrong)} ({self._counted}).",
                hint="Take hands and loads off and start again; else bias the sensor, or correct its range_n, noise_n "
                "or largest_zero_n under `force:`.",
            )
        self.zero = rows.mean(axis=0)

    def _at_rest(self, name: str, values: FloatArray) -> Iterator[str]:
        """Yield the problems in one channel's readings without load: mean, spread and drift."""
        entry, third = self._entry, len(values) // 3
        found = [
            ("mean", float(values.mean()), entry.largest_zero_n or 0.1 * entry.range_n),
            ("spread", float(values.std()), 2 * entry.noise_n if entry.noise_n else 0.05 * entry.range_n),
        ]
        if entry.zero_s >= STRETCHES * STRETCH_S and len(values) >= STRETCHES:
            drift = float(values[-third:].mean() - values[:third].mean())
            # The scatter of the means includes held or filtered noise; a drift changes neighbours little.
            means = values[: len(values) // STRETCHES * STRETCHES].reshape(STRETCHES, -1).mean(axis=1)
            deviation = float(np.sqrt(np.mean(np.diff(means) ** 2) / 2 * 6 / STRETCHES))
            found.append(("drift", drift, max(0.01 * entry.range_n, 5 * deviation)))  # one zero in ten thousand
        for what, value, most in found:
            if abs(value) > most:
                yield f"{name} has a {what} of {value:.3g} N, permitted are {most:.3g} N"

    def about(self) -> dict[str, Scalar]:
        """Return facts for a recording: the pressing channel with its sign, and the zeros."""
        about: dict[str, Scalar] = {f"zero of {self.stream}": ", ".join(f"{value:.6g}" for value in self.zero)}
        if not self._plain:
            about["normal force"] = f"{'-' if self.sign < 0 else ''}{self._entry.channel} of {self._entry.device}"
        return {**about, **({f"zero rows of {self.stream}": self._counted} if self._counted else {})}

    def turned(self, block: Block) -> Block:
        """Return a block; in blocks of the stream the zero is subtracted, and the force is positive when pressing."""
        if block.stream != self.stream:
            return block
        data = block.data - self.zero
        data[:, self.column] *= self.sign
        return replace(block, data=data)
