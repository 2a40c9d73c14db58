"""The rig's emulated devices for real time: the motor presses, the force sensor and the sensor answer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from tactbench.plugin import Acquisition, Scene, SensorDescriptor
from tactbench.plugin.devices import RigEmulators, RigFile, emulators_of, with_sensor
from tactbench.rigs.parallel_manipulator.emulated_press import EmulatedPress, quiet
from tactbench.rigs.parallel_manipulator.rig import ParallelManipulator
from tactbench.rigs.parallel_manipulator.settings import JOINTS, MOTOR

if TYPE_CHECKING:
    from tactbench.plugin.devices import EmulatedDevice


class PressEmulators(RigEmulators):
    """Emulators of the rig file's devices."""

    def __init__(self, file: RigFile, registry: Any) -> None:
        self._file = file
        self._press: EmulatedPress | None = None
        devices: dict[str, EmulatedDevice] = {}
        for sensor in file.sensors:
            devices = emulators_of(with_sensor(file, sensor), registry, sensor, self._sensed) | devices
        for name in JOINTS:
            if name in devices:
                joint: Any = devices[name].emulator
                joint.drive.servo.load = None  # the platform's weight is not modelled
        self.devices = devices

    def _sensed(self, t_s: float) -> Mapping[str, float]:
        return {} if self._press is None else self._press(t_s)

    def prepare(self, simulated: Acquisition, sensor: SensorDescriptor, scene: Scene, seed: int) -> None:
        """Put the sensor of a scene before the motor."""
        rig = ParallelManipulator(self._file, None, _Carried(simulated))
        with ExitStack() as stack:
            found = rig._senses(stack, self._file, sensor, quiet(scene), seed)
        assert found is not None
        motor: Any = self.devices[MOTOR].emulator
        found[1].pressed_by(motor.drive)
        self._press = found[1]

    def begin(self, at_s: float) -> None:
        """Let the scene's time begin."""
        if self._press is not None:
            self._press.start(at_s)


class _Carried:
    """A simulated rig whose scene is carried out already."""

    def __init__(self, simulated: Acquisition) -> None:
        self._simulated = simulated

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[Acquisition]:
        yield self._simulated
