"""The devices of a rig file: their emulators and their drivers, from what is installed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import RigError, TactbenchError, UsageError
from tactbench.core.plugins.interfaces import Operator, Rig
from tactbench.core.plugins.registry import Registry, load_object
from tactbench.core.plugins.taking_part import rig_context
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.rig import DeviceDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import FORCE, DeviceEntry, ForceEntry, NamedDevice, RigFile
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

if TYPE_CHECKING:
    from tactbench.core.samples import Block, FloatArray
    from tactbench.devices.driver import Driver
    from tactbench.devices.emulation.emulated_devices import EmulatedDevice
    from tactbench.devices.emulator import Senses
    from tactbench.links.link import Clock, Link

LEAST_ROWS = 10
"""From which a zero is taken."""
STRETCHES = 30
"""In which a zero is cut to see by how much their means scatter."""
STRETCH_S = 0.02
"""Noise of a force may be alike so long (assumed: a sample of 50 Hz that is held). No drift is told within 0.6 s."""
MOST_BAD = 0.1
"""Of the rows that a zero is taken from, the share that may be no numbers (assumed)."""
_PRESSED = "normal"
"""What the channel along which the sensor is pressed is called where it is not plain `fz`; tasks look for either."""


class PressingForce:
    """The force sensor of a rig as it is recorded: pressing makes the channel of the rig file's `entry` rise.

    Attributes
    ----------
    streams
        Of the force sensor, the pressing channel with sign 1, and called `normal` where it is not plain `fz`.
    stream, column, sign
        Where the pressing force is, and 1 or -1: pressing makes the device's channel rise or fall.

    Raises
    ------
    UsageError
        If there is no such channel.
    """

    def __init__(self, entry: ForceEntry, streams: tuple[StreamSpec, ...]) -> None:
        self._entry, self.sign = entry, entry.sign
        self._zeroed: dict[str, Scalar] = {}
        self._plain = (entry.channel, entry.sign) == ("fz", 1)
        names = {stream.name: [channel.name for channel in stream.channels] for stream in streams}
        having = [stream for stream in streams if entry.channel in names[stream.name]]
        if not having:
            known = ", ".join(name for several in names.values() for name in several)
            raise UsageError(
                f"The force sensor {entry.device!r} has no channel {entry.channel!r}; it has {known}.",
                hint="Correct `channel:` under `force:` in the rig file.",
            )
        stream = having[0]
        self.stream, self.column = stream.name, names[stream.name].index(entry.channel)
        channels = list(stream.channels)
        update = {"sign": 1} if self._plain else {"sign": 1, "name": _PRESSED}
        channels[self.column] = ChannelSpec.model_validate({**dict(channels[self.column]), **update})
        pressed = stream.model_copy(update={"channels": tuple(channels)})
        self.streams = tuple(pressed if one is stream else one for one in streams)

    def zero(self, blocks: Iterable[Block]) -> dict[str, FloatArray]:
        """Return what every channel reads without load, by stream: the mean of `blocks`, if nothing speaks against it.

        Every channel of unit N is tested: the size of its mean, its spread, its drift (the last third's mean less the
        first's). Rows that are no numbers or are marked are counted and left out.

        Raises
        ------
        RigError
            If the sensor is not at rest, or a tenth of its rows are no numbers, or fewer than ten come.
        """
        import numpy as np

        entry, came = self._entry, list(blocks)
        found = {stream.name: np.zeros(len(stream.channels)) for stream in self.streams}
        for stream in self.streams if entry.zero_s > 0 else ():
            own = [block for block in came if block.stream == stream.name]
            rows = np.concatenate([np.empty((0, len(stream.channels))), *(block.data for block in own)])
            marks = [block.quality if block.quality is not None else np.zeros(block.data.shape) for block in own]
            good = np.isfinite(rows).all(axis=1) & ~np.concatenate([np.empty((0, rows.shape[1])), *marks]).any(axis=1)
            counted = f"{len(rows)} rows in {entry.zero_s:g} s, {int((~good).sum())} of them no numbers or marked"
            if good.sum() < LEAST_ROWS or good.mean() < 1 - MOST_BAD:
                raise RigError(
                    f"The force has no zero: {counted}.", hint="Look at the force sensor: `tactbench doctor` reads it."
                )
            rows = rows[good]
            forces = [place for place, channel in enumerate(stream.channels) if channel.unit == "N"]
            wrong = [text for place in forces for text in self._at_rest(stream.channels[place].name, rows[:, place])]
            if wrong:
                raise RigError(
                    f"The force sensor is not at rest, and its zero is refused: {'; '.join(wrong)} ({counted}).",
                    hint="Take hands and loads off and start again; else bias the sensor, or state its range_n, "
                    "noise_n and largest_zero_n under `force:`.",
                )
            found[stream.name] = rows.mean(axis=0)
            self._zeroed[f"zero rows of {stream.name}"] = counted
        return found

    def _at_rest(self, name: str, values: FloatArray) -> Iterator[str]:
        """Yield what is wrong with the readings of one channel without load."""
        import numpy as np

        entry, third = self._entry, len(values) // 3
        found = [
            ("mean", float(values.mean()), entry.largest_zero_n or 0.1 * entry.range_n),
            ("spread", float(values.std()), 2 * entry.noise_n if entry.noise_n else 0.05 * entry.range_n),
        ]
        if entry.zero_s >= STRETCHES * STRETCH_S and len(values) >= STRETCHES:
            drift = float(values[-third:].mean() - values[:third].mean())
            # Means of stretches scatter by noise that is held or filtered, too; neighbours differ little by a drift.
            means = values[: len(values) // STRETCHES * STRETCHES].reshape(STRETCHES, -1).mean(axis=1)
            deviation = float(np.sqrt(np.mean(np.diff(means) ** 2) / 2 * 6 / STRETCHES))
            found.append(("drift", drift, max(0.01 * entry.range_n, 5 * deviation)))  # one zero in ten thousand
        for what, value, most in found:
            if abs(value) > most:
                yield f"{name} has a {what} of {value:.3g} N, allowed are {most:.3g} N"

    def about(self, zero: Mapping[str, FloatArray]) -> dict[str, Scalar]:
        """Return what a recording says of the mounting and of the `zero` taken off, by stream."""
        said = {f"zero of {name}": ", ".join(f"{value:.6g}" for value in values) for name, values in zero.items()}
        if not self._plain:
            said["normal force"] = f"{'-' if self.sign < 0 else ''}{self._entry.channel} of {self._entry.device}"
        return {**said, **self._zeroed}

    def turned(self, block: Block, zero: Mapping[str, FloatArray]) -> Block:
        """Return a block with forces from the unloaded sensor's `zero`, by stream, and positive when pressing."""
        if block.stream not in zero:
            return block
        data = block.data - zero[block.stream]
        if block.stream == self.stream:
            data[:, self.column] *= self.sign
        return replace(block, data=data)


def with_sensor(file: RigFile, sensor: str) -> RigFile:
    """Return a rig file with one of its sensors; raises UsageError if it has no entry for it."""
    if sensor not in file.sensors:
        raise UsageError(
            f"The rig file has no entry for the sensor {sensor!r}; it has {', '.join(file.sensors)}.",
            hint=f"Add `{sensor}:` with its link under `sensors:`.",
        )
    return file.model_copy(update={"sensors": {sensor: file.sensors[sensor]}})


def physics_of(file: RigFile, registry: Registry) -> Rig | None:
    """Build the simulated rig that moves a rig's emulated devices; None: it has none.

    Raises
    ------
    UsageError
        If the file names a rig that is no simulation.
    """
    if not file.emulated:
        return None
    descriptor = registry.rigs[file.emulation.physics]
    if not descriptor.simulated:
        raise UsageError(
            f"`physics: {descriptor.name}` in the rig file is no simulated rig.", hint="Use `physics: twin`."
        )
    rig: Rig = load_object(descriptor.where)(rig_context(registry))
    return rig


def ask_operator(file: RigFile, operator: Operator | None, doing: str, text: str) -> None:
    """Let somebody do at the rig what `text` says, in a word `doing`; devices that are all emulated need nobody.

    Raises
    ------
    RigError
        If nobody is there.
    """
    told = bool(file.emulation.control)
    if all(entry.emulated or (entry.emulator and told) for entry in file.entries().values()):
        return
    if operator is None:
        raise RigError(
            f"Somebody has to {doing}: {text}",
            hint="Start it at a terminal, or use a rig file with emulated devices.",
        )
    operator.prompt(text)


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
    import numpy as np

    from tactbench.devices.emulation.emulated_devices import EmulatedDevice
    from tactbench.devices.emulation.line import split_faults
    from tactbench.devices.emulation.scene_samples import PRESSING_FORCE
    from tactbench.devices.emulator import EmulatorSettings

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
    from tactbench.devices.driver import DriverSettings
    from tactbench.links.address import open_link

    drivers: dict[str, Driver] = {}
    with ExitStack() as opened:
        for name, (entry, descriptor) in _used(file, registry, sensor).items():
            if name not in ((sensor, FORCE) if names is None else names):
                continue
            with _entry(name):
                if descriptor.driver is None:
                    raise UsageError(
                        f"{descriptor.name} has no driver: it can be simulated or replayed, not read.",
                        hint="A plugin's SensorDescriptor names one; see docs/plugins.md.",
                    )
                if not entry.emulated:
                    opener: Callable[[], Link] = partial(open_link, entry.link, clock)
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
    with_sensor(file, sensor)
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
