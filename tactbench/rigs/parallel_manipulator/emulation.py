"""The rig's emulated devices for real time: the motor presses, the force sensor and the sensor answer."""

from __future__ import annotations

from typing import Any

from tactbench.plugin import Acquisition, Scene, SensorDescriptor
from tactbench.plugin.devices import RigEmulators, RigFile
from tactbench.rigs.parallel_manipulator.emulated_press import emulated_press, quiet
from tactbench.rigs.parallel_manipulator.session import Senses, coupled_emulators
from tactbench.rigs.parallel_manipulator.settings import settings_of, with_limits


class PressEmulators(RigEmulators):
    """Emulators of the rig file's devices."""

    def __init__(self, file: RigFile, registry: Any) -> None:
        self._file, self._senses, self._settings = file, Senses(), settings_of(file)
        limited = with_limits(file, self._settings, registry)
        self.devices = coupled_emulators(limited, self._settings, registry, list(file.sensors), self._senses)

    def prepare(self, simulated: Acquisition, sensor: SensorDescriptor, scene: Scene, seed: int) -> None:
        """Put the sensor of a scene before the motor."""
        self._senses.press = emulated_press(self._file, self._settings, simulated, quiet(scene), seed)

    def begin(self, at_s: float) -> None:
        """Let the scene's time begin."""
        if self._senses.press is not None:
            self._senses.press.start(at_s)
