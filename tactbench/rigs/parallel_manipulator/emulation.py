"""The rig's emulated devices for real time: the motor presses, the force sensor and the sensor answer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from tactbench.plugin import Acquisition, Scene, SensorDescriptor
from tactbench.plugin.devices import RigEmulators, RigFile
from tactbench.rigs.parallel_manipulator.emulated_press import quiet
from tactbench.rigs.parallel_manipulator.rig import ParallelManipulator
from tactbench.rigs.parallel_manipulator.session import Senses, coupled_emulators
from tactbench.rigs.parallel_manipulator.settings import settings_of, with_limits


class PressEmulators(RigEmulators):
    """Emulators of the rig file's devices."""

    def __init__(self, file: RigFile, registry: Any) -> None:
        self._file = file
        self._senses = Senses()
        settings = settings_of(file)
        limited = with_limits(file, settings, registry)
        self.devices = coupled_emulators(limited, settings, registry, list(file.sensors), self._senses)

    def prepare(self, simulated: Acquisition, sensor: SensorDescriptor, scene: Scene, seed: int) -> None:
        """Put the sensor of a scene before the motor."""
        rig = ParallelManipulator(self._file, None, _Carried(simulated))
        with ExitStack() as stack:
            found = rig._senses(stack, sensor, quiet(scene), seed)
        self._senses.press = None if found is None else found[1]

    def begin(self, at_s: float) -> None:
        """Let the scene's time begin."""
        if self._senses.press is not None:
            self._senses.press.start(at_s)


class _Carried:
    """A simulated rig whose scene is carried out already."""

    def __init__(self, simulated: Acquisition) -> None:
        self._simulated = simulated

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[Acquisition]:
        yield self._simulated
