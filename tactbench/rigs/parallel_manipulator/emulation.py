"""The rig's emulated devices for real time: the motor presses, the force sensor and the sensor answer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tactbench.plugin import Acquisition, Scene, SensorDescriptor
from tactbench.plugin.devices import RigEmulators, RigFile, emulators_of, with_sensor
from tactbench.rigs.parallel_manipulator.emulated_press import EmulatedPress, quiet
from tactbench.rigs.parallel_manipulator.rig import ParallelManipulator

if TYPE_CHECKING:
    from tactbench.plugin.devices import EmulatedDevice


class PressEmulators(RigEmulators):
    """Emulators of the rig file's devices."""

    def __init__(self, file: RigFile, registry: Any) -> None:
        self._rig = ParallelManipulator(file, None, None)
        self._file = file
        self._press: EmulatedPress | None = None
        devices: dict[str, EmulatedDevice] = {}
        for sensor in file.sensors:
            devices = emulators_of(with_sensor(file, sensor), registry, sensor, self._sensed) | devices
        self._rig.free_joints(devices)
        self.devices = devices

    def _sensed(self, t_s: float) -> Mapping[str, float]:
        return {} if self._press is None else self._press(t_s)

    def prepare(self, simulated: Acquisition, sensor: SensorDescriptor, scene: Scene, seed: int) -> None:
        """Put the sensor of a scene before the motor."""
        press = self._rig.emulated_press(simulated, self._file, quiet(scene), seed)
        self._rig.pressed_by(press, self.devices)
        self._press = press

    def begin(self, at_s: float) -> None:
        """Let the scene's time begin."""
        if self._press is not None:
            self._press.start(at_s)
