"""The bench as a rig: sensor and reference force sensor are read while a person presses by hand; no motor moves.

Devices marked as emulated in the rig file sense the forces that a simulated rig computes for the same scene, in virtual
time, and use the usual drivers. Devices run by `tactbench emulate` in real time count as real devices here.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tactbench.plugin import (
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
    """Recording of one scene at the bench: iterate over it to get the blocks."""

    streams: tuple[StreamSpec, ...]
    reference: tuple[StreamSpec, ...]
    plan: tuple[PlanEntry, ...]
    assumptions: Mapping[str, Scalar]
    drawn: Mapping[str, Scalar]
    reading: Reading = field(repr=False)
    duration_s: float
    force: PressingForce | None

    def __iter__(self) -> Iterator[Block]:
        """Yield blocks until the scene is over, or a device has failed."""
        for block in self.reading.blocks(self.duration_s):
            yield block if self.force is None else self.force.turned(block)

    @property
    def stream_counts(self) -> Mapping[str, StreamCounts]:
        """Numbers of rows by stream: received, dropped and others."""
        return self.reading.stream_counts

    @property
    def counts(self) -> Mapping[str, int]:
        """Event counts of the drivers, by device and name."""
        return self.reading.counts

    @property
    def ended(self) -> str:
        """Reason for an early end of the recording; empty: no early end."""
        return self.reading.ended


class Bench(Rig):
    """Devices of a rig file, read while a scene is pressed by hand.

    Parameters
    ----------
    file
        Rig file with the devices and their links.
    operator
        Access to the person who presses; not needed if all devices are emulated.
    """

    def __init__(self, file: RigFile, operator: Operator | None) -> None:
        self._registry = load_registry()
        self._file = file
        self._operator = operator
        self._physics = physics_of(self._file, self._registry)

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[DeviceAcquisition]:
        """Open the devices and let them sample; the blocks begin with the scene.

        Raises
        ------
        RigError
            If a device is not as stated in the rig file, or there is no operator to press.
        UsageError
            If the rig file has no entry for the sensor, or has an option unknown to a driver.
        LinkError
            If a link cannot be opened, or a device does not answer.
        """
        file = with_sensor(self._file, sensor.name).checked_for_one_clock()
        with ExitStack() as stack:
            simulated = stack.enter_context(self._physics.open(sensor, scene, seed=seed))
            emulators = SceneEmulators(file, self._registry)
            clock: Clock = time.monotonic_ns
            advance, links = None, {}
            if file.emulated:
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
                taken = f"Force reading without load: {force.zero[force.column]:.3g} N. "
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
            self._physics.begin()
            drawn: dict[str, Scalar] = dict(simulated.drawn)
            drawn |= {f"{name} {key}": value for name, about in identity.items() for key, value in about.items()}
            yield BenchAcquisition(
                streams=drivers[sensor.name].streams,
                reference=() if force is None else force.streams,
                plan=simulated.plan,
                assumptions=simulated.assumptions,
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
            text = f"Take your hands off: nothing may touch the sensor for {seconds:g} s, while the force is zeroed."
            ask_operator(file, self._operator, "take the hands off", text)
            driver.start()
            until_ns = clock() + round(1e9 * seconds)
            while clock() < until_ns:
                blocks += driver.read(min(0.1, max(0.0, (until_ns - clock()) * 1e-9)))
            driver.stop()
        force.take_zero(blocks)


def build(context: RigContext) -> Bench:
    """Build the rig `bench`.

    Raises UsageError if no rig file is given, its `physics` is no simulation, or it names devices besides sensors.
    """
    if context.rig_file is None:
        raise UsageError(
            "The rig 'bench' needs a rig file with its devices.",
            hint="Give one by --rig-file FILE; `tactbench emulate biotac net-ft > FILE` makes one.",
        )
    if context.rig_file.devices:
        raise UsageError(
            f"The bench moves nothing, and so cannot open {', '.join(context.rig_file.devices)}.",
            hint="Remove the entry under `devices:`, or use the rig parallel-manipulator.",
        )
    return Bench(context.rig_file, context.operator)
