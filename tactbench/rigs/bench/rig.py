"""The bench as a rig: a sensor and a reference force sensor are read while somebody presses, and nothing moves.

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
        """By stream: what became of its rows."""
        return self.reading.stream_counts

    @property
    def counts(self) -> Mapping[str, int]:
        """What the drivers counted, by device and name."""
        return self.reading.counts

    @property
    def ended(self) -> str:
        """Why it ended before its time; empty: it did not."""
        return self.reading.ended


class Bench(Rig):
    """Devices of a rig file, read while a scene is pressed by hand.

    Parameters
    ----------
    file
        Which devices, on which links.
    operator
        Who presses; not needed where all devices are emulated.
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
            If a device is not what the rig file says, or somebody has to press and nobody is there.
        UsageError
            If the rig file has no entry for the sensor, or says something that a driver does not know.
        LinkError
            If a link cannot be opened, or a device does not answer.
        """
        file = with_sensor(self._file, sensor.name).checked_for_one_clock()
        with ExitStack() as stack:
            simulated: Acquisition | None = None
            emulators = SceneEmulators(file, self._registry)
            emulated: EmulatedDevices | None = None
            if self._physics is not None:
                simulated = stack.enter_context(self._physics.open(sensor, scene, seed=seed))
            if simulated is not None and file.emulated:
                emulators.prepare(simulated, sensor, scene, seed)
                emulated = stack.enter_context(EmulatedDevices(emulators.devices))
            clock = time.monotonic_ns if emulated is None else emulated.clock
            links = {} if emulated is None else {name: emulated.opener(name) for name in emulators.devices}
            drivers = drivers_of(file, self._registry, sensor.name, links, clock)
            for driver in drivers.values():
                stack.callback(driver.close)
            identity = {name: driver.identify() for name, driver in drivers.items()}
            force = None if file.force is None else PressingForce(file.force, drivers[FORCE].streams)
            if force is not None:
                self._take_zero(force, file, drivers[FORCE], clock)
            self._prompt(force, file, sensor, scene)
            advance = None if emulated is None else emulated.advance
            reading = stack.enter_context(
                Reading(drivers, clock=clock, advance=advance, silent_s=file.allowed.silent_s)
            )
            own = drivers[sensor.name].streams
            emulators.begin(clock() * 1e-9)
            if self._physics is not None:
                self._physics.begin()
            yield BenchAcquisition(
                streams=own,
                reference=() if force is None else force.streams,
                plan=simulated.plan if simulated is not None else (),
                assumptions=simulated.assumptions if simulated is not None else {},
                drawn={
                    **(simulated.drawn if simulated is not None else {}),
                    **{f"{name} {key}": value for name, about in identity.items() for key, value in about.items()},
                    **({} if force is None else force.about()),
                },
                reading=reading,
                duration_s=scene.profile.duration.to("s"),
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

    def _prompt(
        self,
        force: PressingForce | None,
        file: RigFile,
        sensor: SensorDescriptor,
        scene: Scene,
    ) -> None:
        profile = scene.profile
        taken = "" if force is None else f"Zero of the force: {force.zero[force.column]:.3g} N. "
        text = (
            f"{scene.name}: {sensor.spec.title}, {scene.indenter}. {taken}Press now: touch nothing for the first "
            f"{profile.hold_s:.0f} s, then press slowly to {profile.largest_n:g} N and back, within "
            f"{profile.duration.to('s'):.0f} s in all."
        )
        ask_operator(file, self._operator, "press", text)


def build(context: RigContext) -> Bench:
    """Return the rig.

    Raises
    ------
    UsageError
        If there is no rig file, or it names a simulation that is none, or devices that nobody would open.
    """
    if context.rig_file is None:
        raise UsageError(
            "The rig 'bench' needs to know its devices.",
            hint="Name a rig file with --rig-file FILE; `tactbench emulate biotac net-ft > FILE` makes one.",
        )
    if context.rig_file.devices:
        raise UsageError(
            f"The bench opens no {', '.join(context.rig_file.devices)}: a hand presses, and nothing moves.",
            hint="Leave it out under `devices:`, or use the rig parallel-manipulator.",
        )
    return Bench(context.rig_file, context.operator)
