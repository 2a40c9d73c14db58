"""``tactbench emulate``: emulated sensors and devices on links of this machine, pressed by a simulated rig."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.scenes import PROFILE, profile_of, scene_of
from tactbench.core.cli.screen import remark

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.rig_file import DeviceEntry, RigFile
    from tactbench.core.spec.scene import Scene
    from tactbench.devices.emulation.emulated_devices import EmulatedDevice, EmulatedDevices
    from tactbench.devices.emulation.scene_samples import SceneSamples

HEAD = "# Written by `tactbench emulate`; its links are gone when that ends."
STATUS_S = 5.0
"""How often it is said how many bytes have passed."""


@click.command(name="emulate")
@click.argument("names", nargs=-1, metavar="[DEVICE]...")
@click.option("--rig-file", type=click.Path(path_type=Path), metavar="FILE",
              help="Start every device of this file whose link is `emulated`, with its faults.")  # fmt: skip
@PROFILE
def command(
    names: tuple[str, ...],
    rig_file: Path | None,
    profile: str | None,
) -> None:
    """Start emulated sensors and devices on links of this machine, pressed by a simulated rig, until Ctrl-C.

    DEVICE is a sensor or device by name, for example: tactbench emulate biotac net-ft. The rig file that
    opens them is printed: > rig.yaml.
    """
    from itertools import count

    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.plugins.rig_devices import descriptor_of, emulated_device, options_of
    from tactbench.core.plugins.rig_files import load_rig_file
    from tactbench.core.spec.rig_file import EmulationSettings
    from tactbench.devices.emulation.emulated_devices import EmulatedDevices

    if bool(names) == (rig_file is not None):
        raise UsageError(
            "Either devices or a rig file say what to emulate.",
            hint="For example: tactbench emulate biotac net-ft; `tactbench list devices` names more.",
        )
    registry = load_registry()
    file = load_rig_file(rig_file, registry) if rig_file is not None else None
    entries = _named(registry, names) if file is None else file.entries()
    how = EmulationSettings() if file is None else file.emulation

    load = profile_of(registry, profile)
    pressed = [name for name, entry in entries.items() if entry.emulated and not hasattr(entry, "device")]
    scenes = {name: scene_of("press", registry.sensors[name], profile=load) for name in pressed}
    presser = Presser(registry, how.physics, scenes, scene_of("press", None, profile=load), how.seed)
    devices: dict[str, EmulatedDevice] = {}
    for name, entry in entries.items():
        descriptor = descriptor_of(registry, name, entry)
        entries[name] = entry.model_copy(update={"options": options_of(descriptor, entry)})
        if entry.emulated:
            devices[name] = emulated_device(descriptor, name, entry, presser.senses(name), presser.seed)
    if not devices:
        raise UsageError("No device in the rig file is emulated.", hint="Write `link: emulated` for one.")
    presser.draw(1)
    with EmulatedDevices(devices, time="real") as emulated:
        _say_where(emulated, entries, file)
        for number in count(1):
            if number > 1:
                presser.draw(number)
            _press(emulated, presser, number)


@dataclass
class Presser:
    """Presses the sensors, one scene each, time and again.

    Parameters
    ----------
    physics
        Name of the simulated rig.
    scenes
        By sensor.
    alone
        Scene of the force where there is no sensor.
    seed
        Of the first press; the next ones count on from it.
    """

    registry: Registry
    physics: str
    scenes: Mapping[str, Scene]
    alone: Scene
    seed: int

    def __post_init__(self) -> None:
        from tactbench.core.errors import UsageError
        from tactbench.core.plugins.registry import load_object
        from tactbench.core.plugins.taking_part import rig_context

        descriptor = self.registry.rigs[self.physics]
        if not descriptor.simulated:
            raise UsageError(f"The rig {self.physics!r} is not simulated.", hint="Use twin.")
        self._rig = load_object(descriptor.where)(rig_context(self.registry))
        self._drawn: dict[str, SceneSamples] = {}
        self._began_s = math.inf

    def draw(self, number: int) -> None:
        """Compute press `number`, 1 being the first; nothing is pressed until it is started."""
        from tactbench.devices.emulation.scene_samples import SceneSamples

        drawn = {}
        for name, scene in self.scenes.items():
            sensor: SensorDescriptor = self.registry.sensors[name]
            kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels()))
            observed = scene.model_copy(update={"observe": kinds})
            with self._rig.open(sensor, observed, seed=self.seed + number - 1) as acquisition:
                profile = scene.profile
                drawn[name] = SceneSamples(acquisition, profile.duration.to("s"), rest_s=profile.hold_s)
        self._drawn = drawn

    def start(self, at_s: float) -> float:
        """Begin to press at `at_s` on the devices' clock; return when it is over."""
        self._began_s = at_s
        for samples in self._drawn.values():
            samples.start(at_s)
        alone_s = at_s + self.alone.profile.duration.to("s")
        return max((samples.over_s for samples in self._drawn.values()), default=alone_s)

    def senses(self, name: str) -> Any:
        """Return what a device senses: a sensor its own press, any other device that of the first sensor."""

        def sensed(t_s: float) -> Mapping[str, float]:
            drawn = self._drawn
            if not self.scenes:
                return {"fz": self._force_n(t_s - self._began_s)}
            return drawn[name if name in drawn else next(iter(drawn))](t_s) if drawn else {}

        return sensed

    def _force_n(self, passed_s: float) -> float:
        """Return the force where nothing is pressed, so long after the press began."""
        import numpy as np

        profile = self.alone.profile
        within = 0.0 <= passed_s < profile.duration.to("s")
        return float(np.interp(passed_s if within else 0.0, *profile.corners))


def _named(registry: Registry, names: Sequence[str]) -> dict[str, DeviceEntry]:
    """Return an entry for every sensor and device named, by the names that they have in a rig file."""
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.spec.rig_file import EMULATED, FORCE, DeviceEntry, ForceEntry, NamedDevice

    entries: dict[str, DeviceEntry] = {}
    for name in names:
        if name in registry.sensors:
            part, entry = name, DeviceEntry(link=EMULATED)
        elif name in registry.devices and registry.devices[name].kind == "force":
            part, entry = FORCE, ForceEntry(link=EMULATED, device=name)
        elif name in registry.devices:
            part, entry = registry.devices[name].kind, NamedDevice(link=EMULATED, device=name)
        else:
            raise UnknownNameError("sensor or device", name, [*registry.sensors.names(), *registry.devices.names()])
        if part in entries:
            raise UsageError(f"A rig has one {part}, {name} would be another one.", hint="Name one of them.")
        entries[part] = entry
    return entries


def _say_where(emulated: EmulatedDevices, entries: Mapping[str, DeviceEntry], file: RigFile | None) -> None:
    import yaml

    from tactbench.core.spec.rig_file import FORCE, RigFile
    from tactbench.core.tables.text import command_line

    found: dict[str, Any] = {
        name: entry.model_copy(update={"link": emulated.addresses[name], "faults": (), "emulator": True})
        if name in emulated.addresses
        else entry
        for name, entry in entries.items()
    }
    sensors = {name: entry for name, entry in found.items() if not hasattr(entry, "device")}
    if not sensors:
        for name, address in emulated.addresses.items():
            click.echo(f"{name}: {address}")
        remark("A rig file needs a sensor beside them: name one, too, to have one written.")
        return
    others = {name: entry for name, entry in found.items() if name not in sensors and name != FORCE}
    parts = {"sensors": sensors, "force": found.get(FORCE), "devices": others}
    rig = RigFile(rig="bench", **parts) if file is None else file.model_copy(update=parts)
    plain = rig.model_dump(mode="json", exclude_defaults=True, exclude={"emulation", "version"})
    click.echo(f"{HEAD}\n{yaml.safe_dump({'version': 1, **plain}, sort_keys=False)}", nl=False)
    words = ("--rig-file", "rig.yaml", "--sensor", next(iter(sensors)), "--live", "--out", "press.h5")
    remark("Ctrl-C ends the devices. With the above in rig.yaml (> rig.yaml), record in another terminal:")
    remark(f"  {command_line('tactbench', 'record', *words)}")


def _press(emulated: EmulatedDevices, presser: Presser, number: int) -> None:
    """Press once, and say how it goes."""
    profile, over_s = presser.alone.profile, presser.start(emulated.clock() * 1e-9)
    remark(f"Press {number}: {profile.largest_n:g} N after {profile.duration.to('s'):g} s")
    while (now_s := emulated.clock() * 1e-9) < over_s:
        emulated.advance(round(1e9 * min(now_s + STATUS_S, over_s)))
        passed = (f"{name} {here} bytes in, {there} out" for name, (here, there) in emulated.passed_bytes.items())
        remark(f"  {'; '.join(passed)}")
