"""The bench as a rig: a sensor and a reference force sensor are read while a person presses, and nothing moves.

Devices that the rig file calls emulated sense what a simulated rig computes of the same scene, in virtual time; their
links and drivers carry it as those of real ones do. What `tactbench emulate` runs in real time is a real device here.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tactbench.plugin import (
    Acquisition,
    Block,
    PlanEntry,
    Rig,
    RigContext,
    Scalar,
    Scene,
    SensorDescriptor,
    StreamSpec,
    UsageError,
    load_registry,
)
from tactbench.plugin.devices import (
    FORCE,
    DeviceAcquisition,
    Driver,
    EmulatedDevices,
    Operator,
    PressingForce,
    Reading,
    RigFile,
    SceneEmulators,
    StreamCounts,
    ask_operator,
    drivers_of,
    physics_of,
    with_sensor,
)

if TYPE_CHECKING:
    from tactbench.plugin.devices import Clock


@dataclass
class BenchAcquisition:
    """One scene at the bench: iterate it for blocks."""

    streams: tuple[StreamSpec, ...]
    reference: tuple[StreamSpec, ...]
    plan: tuple[PlanEntry, ...]
    assumptions: Mapping[str, Scalar]
    drawn: Mapping[str, Scalar]
    reading: Reading = field(repr=False)
    duration_s: float
    force: PressingForce | None

    def __iter__(self) -> Iterator[Block]:
        """Yield blocks until the scene is over, or a device is gone."""
        for block in self.reading.blocks(self.duration_s):
            yield block if self.force is None else self.force.turned(block)

    @property
    def stream_counts(self) -> Mapping[str, StreamCounts]:
        """The counts of rows by stream."""
        return self.reading.stream_counts

    @property
    def counts(self) -> Mapping[str, int]:
        """The drivers' counts, by device and name."""
        return self.reading.counts

    @property
    def ended(self) -> str:
        """The reason for which it ended before its time; empty: it did not."""
        return self.reading.ended


class Bench(Rig):
    """Devices of a rig file, read while a scene is pressed by hand.

    Parameters
    ----------
    file
        Which devices, on which links.
    operator
        The person who presses; not needed where all devices are emulated.
    """

    def __init__(self, file: RigFile, operator: Operator | None) -> None:
        self._registry = load_registry()
        self._file = file
        self._operator = operator
        self._physics = physics_of(self._file, self._registry)

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[DeviceAcquisition]:
        """Open the devices and let them sample; the blocks begin when the scene does.

        Raises
        ------
        RigError
            If a device is not what the rig file says, or no operator is there to press.
        UsageError
            If the rig file has no entry for the sensor, or an option that a driver does not know.
        LinkError
            If a link cannot be opened, or a device does not answer.
        """
        file = with_sensor(self._file, sensor.name).checked_for_one_clock()
        with ExitStack() as stack:
            simulated: Acquisition | None = None
            emulators = SceneEmulators(file, self._registry)
            clock: Clock = time.monotonic_ns
            advance, links = None, {}
            if self._physics is not None:
                simulated = stack.enter_context(self._physics.open(sensor, scene, seed=seed))
            if simulated is not None and file.emulated:
                emulators.prepare(simulated, sensor, scene, seed)
                emulated = stack.enter_context(EmulatedDevices(emulators.devices))
                clock, advance = emulated.clock, emulated.advance
                links = {name: emulated.opener(name) for name in emulators.devices}
            drivers = drivers_of(file, self._registry, sensor.name, links, clock)
            for driver in drivers.values():
                stack.callback(driver.close)
            identity = {name: driver.identify() for name, driver in drivers.items()}
            force = None if file.force is None else PressingForce(file.force, drivers[FORCE].streams)
            taken = ""
            if force is not None:
                self._take_zero(force, file, drivers[FORCE], clock)
                taken = f"Zero of the force: {force.zero[force.column]:.3g} N. "
            profile, duration_s = scene.profile, scene.profile.duration.to("s")
            text = (
                f"{scene.name}: {sensor.spec.title}, {scene.indenter}. {taken}Press now: touch nothing for the first "
                f"{profile.hold_s:.0f} s, then press slowly to {profile.largest_n:g} N and back, within "
                f"{duration_s:.0f} s in all."
            )
            ask_operator(file, self._operator, "press", text)
            reading = stack.enter_context(
                Reading(drivers, clock=clock, advance=advance, silent_s=file.allowed.silent_s)
            )
            emulators.begin(clock() * 1e-9)
            if self._physics is not None:
                self._physics.begin()
            drawn: dict[str, Scalar] = {} if simulated is None else dict(simulated.drawn)
            drawn |= {f"{name} {key}": value for name, about in identity.items() for key, value in about.items()}
            yield BenchAcquisition(
                streams=drivers[sensor.name].streams,
                reference=() if force is None else force.streams,
                plan=() if simulated is None else simulated.plan,
                assumptions={} if simulated is None else simulated.assumptions,
                drawn=drawn if force is None else drawn | force.about(),
                reading=reading,
                duration_s=duration_s,
                force=force,
            )

    def _take_zero(self, force: PressingForce, file: RigFile, driver: Driver, clock: Clock) -> None:
        assert file.force is not None
        seconds = file.force.zero_s
        blocks: list[Block] = []
        if seconds > 0:
            text = f"Take your hands off: nothing may touch the sensor while the force is zeroed, {seconds:g} s."
            ask_operator(file, self._operator, "take the hands off", text)
            driver.start()
            until_ns = clock() + round(1e9 * seconds)
            while clock() < until_ns:
                blocks += driver.read(min(0.1, max(0.0, (until_ns - clock()) * 1e-9)))
            driver.stop()
        force.take_zero(blocks)


def build(context: RigContext) -> Bench:
    """Return the rig.

    Raises
    ------
    UsageError
        If there is no rig file, or it names a simulation that is none, or devices that the bench does not open.
    """
    if context.rig_file is None:
        raise UsageError(
            "The rig 'bench' needs to know its devices.",
            hint="Name a rig file with --rig-file FILE; `tactbench emulate biotac net-ft > FILE` makes one.",
        )
    if context.rig_file.devices:
        raise UsageError(
            f"The bench opens no {', '.join(context.rig_file.devices)}: nothing moves on it.",
            hint="Leave it out under `devices:`, or use the rig parallel-manipulator.",
        )
    return Bench(context.rig_file, context.operator)
