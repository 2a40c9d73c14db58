"""The rig's emulated devices: a motor presses a simulated sensor; force sensor and sensor respond to its position.

Quasi-static. The motor's position gives the depth of the indenter, the simulated rig's press curve the force at that
depth, and the sensor's reading is that of the simulated recording of the same scene at the time when the ramp had
this force. So effects of force are exact on a slow ramp, and effects of time (drift, creep, noise) are those of the
simulated recording as long as the force keeps to its profile. Not modelled: the machine's compliance, the mass between
motor and force sensor, the effect of a quicker press on a skin with memory, and sideways motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from tactbench.plugin import Acquisition, NotApplicable, Scene, SensorDescriptor
from tactbench.plugin.devices import RigEmulators, RigFile, SceneSamples, emulators_of, with_sensor
from tactbench.plugin.simulation import SimulatedPress
from tactbench.rigs.parallel_manipulator.settings import MOTOR, with_limits

FORCE = "fz"
"""Channel name of the pressing force in a simulated rig and in emulated force sensors."""
FLOOR_N = 0.6e-3
"""Standard deviation of the force sensor's noise [N] (derived: quantisation of a Nano17 read with 16 bits on +-10 V,
rms of Fz); without it a sensor without noise would seem stuck."""
BEYOND_M = 1.0
"""Length of the linear spring beyond the press curve's end [m]: at least the travel of any motor."""


def quiet(scene: Scene) -> Scene:
    """Return the scene to simulate: the load follows the force profile exactly, without a filter of the force.

    Raises NotApplicable if the scene slides, presses nothing or begins above 0 N: its recording then lacks some forces.
    """
    profile = scene.profile
    if scene.slide is not None:
        raise NotApplicable(f"The scene {scene.name!r} slides, and this rig only presses.")
    rises = profile.kind == "ramp" and profile.corners[1][0] == 0 < profile.corners[1][-1]
    if not rises or not profile.duration.to("s") > profile.hold_s:
        raise NotApplicable(f"The scene {scene.name!r} is not a ramp from 0 N, the only profile that this rig presses.")
    environment = scene.environment.model_copy(update={"force_filter": None})
    return scene.model_copy(update={"drive": None, "environment": environment})


class EmulatedPress:
    """A simulated sensor, pressed by an emulated motor.

    Without load, the sensor repeats the readings of the recording's unloaded hold, from `start_s` on.

    Parameters
    ----------
    simulated
        The scene of :func:`quiet` as carried out by the simulated rig.
    scene
        The scene of :func:`quiet` itself.
    skin_m
        Position of the motor, as counted by its drive, at which the indenter touches the skin [m].
    largest_n
        Largest force that is simulated [N]; beyond it the skin is a spring with the stiffness at this force.
    rng
        Random generator for the force sensor's noise.
    """

    def __init__(
        self, simulated: SimulatedPress, scene: Scene, *, skin_m: float, largest_n: float, rng: np.random.Generator
    ) -> None:
        profile = scene.profile
        self.skin_m = skin_m
        self.start_s = 0.0
        """Start of the scene on the devices' clock [s]."""
        self._hold_s, self._duration_s = profile.hold_s, profile.duration.to("s")
        self._s_per_n = (self._duration_s - self._hold_s) / profile.corners[1][-1]
        self._corners = profile.corners
        depths_m, forces_n = simulated.press_curve(largest_n)
        steepness = (forces_n[-1] - forces_n[-2]) / (depths_m[-1] - depths_m[-2])
        self._curve = (
            skin_m + np.append(depths_m, depths_m[-1] + BEYOND_M),
            np.append(forces_n, forces_n[-1] + BEYOND_M * steepness),
        )
        streams = (*simulated.streams, *simulated.reference)
        self._samples = SceneSamples(streams, simulated, self._duration_s, rest_s=self._hold_s)
        self._samples.start(0.0)
        self._rng = rng

    def force_n(self, position_m: float) -> float:
        """Return the force of the skin [N] at a position of the motor, as its drive counts [m]."""
        return float(np.interp(position_m, *self._curve)) if position_m > self.skin_m else 0.0

    def sensed(self, t_s: float, position_m: float) -> Mapping[str, float]:
        """Return every channel's value, in its unit, at a time of the devices' clock [s] and a motor's position [m]."""
        force_n = self.force_n(position_m)
        last_s = self._duration_s - 1e-9  # the sample at the end of the scene is one without load
        since_s = min((t_s - self.start_s) % self._duration_s, last_s)
        load_n = float(np.interp(since_s, *self._corners))
        noise_n = self._samples(since_s).get(FORCE, load_n) - load_n
        if force_n > 0.0:
            at_s = min(self._hold_s + force_n * self._s_per_n, last_s)
        else:
            at_s = since_s % self._hold_s if self._hold_s else 0.0
        return {**self._samples(at_s), FORCE: force_n + noise_n + FLOOR_N * self._rng.standard_normal()}


class PressEmulators(RigEmulators):
    """Emulators of a rig file's devices, with all its sensors: the motor moves, sensor and force sensor respond.

    Raises UsageError if the rig file lacks a device or a setting.
    """

    def __init__(self, file: RigFile, registry: Any) -> None:
        self._file = file
        limited, self._settings = with_limits(file, registry)
        self.press: EmulatedPress | None = None
        """Press of the present scene; None: no sensor is pressed."""
        self.pushed_n = 0.0
        """Force of a push by hand on the force sensor [N], added to that of the skin."""
        self.devices: dict[str, Any] = {}
        for sensor in file.sensors:  # which share force sensor and axes
            own = emulators_of(with_sensor(limited, sensor), registry, sensor, self._sensed)
            self.devices = {**own, **self.devices}
        self._motor = self.devices[MOTOR].emulator if MOTOR in self.devices else None
        if self._motor is not None:  # the platform's weight on its rails is not modelled
            self._motor.press_against(self._force_n)

    def prepare(self, simulated: Acquisition, sensor: SensorDescriptor, scene: Scene, seed: int) -> None:
        """Put the sensor of a scene below the motor; the height of its skin is drawn at random."""
        press: Any = simulated  # a SimulatedPress
        settings, heights, scene = self._settings, self._settings.heights, quiet(scene)
        rng = np.random.default_rng([self._file.emulation.seed, seed, *b"skin", *scene.name.encode()])
        most_mm = heights.tolerance_mm
        off_mm = float(np.clip(most_mm / 3 * rng.standard_normal(), -most_mm, min(most_mm, heights.depth_mm)))
        largest_n = 1.5 * settings.limits.force_ceiling_n
        skin_m = settings.surface_m + 1e-3 * off_mm
        self.press = EmulatedPress(press, scene, skin_m=skin_m, largest_n=largest_n, rng=rng)

    def begin(self, at_s: float) -> None:
        """Let the scene's time begin at `at_s` of the devices' clock [s]."""
        if self.press is not None:
            self.press.start_s = at_s

    def _sensed(self, t_s: float) -> Mapping[str, float]:
        position_m = -math.inf if self._motor is None else self._motor.position_m
        found = {} if self.press is None else self.press.sensed(t_s, position_m)
        return {**found, FORCE: found.get(FORCE, 0.0) + self.pushed_n}

    def _force_n(self, position_m: float) -> float:
        return 0.0 if self.press is None else self.press.force_n(position_m)
