"""What emulated devices of this rig sense: an emulated motor presses the sensor of a simulated scene.

Quasi-static. The motor's position gives the depth of the indenter, the simulated rig's press curve the force at that
depth, and the sensor reads what it read in the simulated recording of the same scene at the moment at which the ramp
had that force. So what depends on force is exact on a slow ramp, and what depends on time (drift, creep, noise) is that
of the simulated recording as long as the force keeps to its profile. Left out: the machine's own compliance, the mass
between motor and force sensor, what a quicker press would do to a skin with memory, anything sideways.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tactbench.plugin import NotApplicable, Scene
from tactbench.plugin.devices import SceneSamples
from tactbench.plugin.simulation import SimulatedPress

if TYPE_CHECKING:
    pass

FORCE = "fz"
"""Name under which a simulated rig gives the pressing force, and emulated force sensors are given it."""
FLOOR_N = 0.6e-3
"""Standard deviation of what the force sensor adds by itself (derived: quantisation of a Nano17 read with 16 bits on
+-10 V, rms of Fz); without it a sensor without noise would seem stuck."""
TABULATED = 4001
"""Depths at which the force is tabulated; straight between them."""
_FLOOR_DRAWS = 1 << 14
_FLOOR_HZ = 7000
"""A new draw for each sample of a Net F/T box."""


def quiet(scene: Scene) -> Scene:
    """Return the scene as a simulated rig is asked for it: the load follows the profile, the force is not filtered.

    Raises
    ------
    NotApplicable
        If it slides, or nothing is pressed, or the load does not begin at 0: there is no moment for every force.
    """
    profile = scene.profile
    if scene.slide is not None:
        raise NotApplicable(f"The scene {scene.name!r} slides, and this rig only presses.")
    if profile.kind != "ramp":
        raise NotApplicable(f"The scene {scene.name!r} states a path of forces, and this rig only raises one.")
    if profile.start.to("N") != 0 or not profile.end.to("N") > 0 or not profile.duration.to("s") > profile.hold_s:
        raise NotApplicable(f"The scene {scene.name!r} does not rise from 0 N, as this rig presses.")
    environment = scene.environment.model_copy(update={"force_filter": None})
    return scene.model_copy(update={"drive": None, "environment": environment})


class EmulatedPress:
    """A simulated scene under an emulated motor.

    Without load the sensor reads the unloaded hold of the recording, by the time since :meth:`start`, again and again.

    Parameters
    ----------
    simulated
        The scene of :func:`quiet` as the simulated rig has carried it out.
    scene
        The same scene.
    skin_m
        Position of the motor, as its drive counts, at which the indenter touches [m].
    largest_n
        The largest force of interest; beyond it the skin is a spring as stiff as there.
    rng
        Draws the force sensor's own noise.
    """

    def __init__(
        self, simulated: SimulatedPress, scene: Scene, *, skin_m: float, largest_n: float, rng: np.random.Generator
    ) -> None:
        profile = scene.profile
        self.skin_m = skin_m
        self._start_s = 0.0
        self._hold_s, self._duration_s = profile.hold_s, profile.duration.to("s")
        self._s_per_n = (self._duration_s - self._hold_s) / profile.end.to("N")
        self._corners = profile.corners
        depths_m, forces_n = simulated.press_curve(largest_n)
        even_m = np.linspace(0.0, float(depths_m[-1]), TABULATED)
        self._spacing_m = float(even_m[1])
        forces = np.interp(even_m, depths_m, forces_n)
        forces[0] = 0.0
        self._forces_n: list[float] = forces.tolist()
        # One for what the sensor reads, one for the noise of the force.
        self._sensor, self._force = (SceneSamples(simulated, self._duration_s, rest_s=self._hold_s) for _ in range(2))
        for samples in (self._sensor, self._force):
            samples.start(0.0)
        self._floor_n: list[float] = (FLOOR_N * rng.standard_normal(_FLOOR_DRAWS)).tolist()

    def start(self, at_s: float) -> None:
        """Let the scene's time begin, on the devices' clock."""
        self._start_s = at_s

    def force_n(self, position_m: float) -> float:
        """Return the force of the skin [N] at a position of the motor, as its drive counts [m]."""
        place = (position_m - self.skin_m) / self._spacing_m
        if place <= 0.0:
            return 0.0
        before = min(int(place), TABULATED - 2)
        here, there = self._forces_n[before : before + 2]
        return here + (place - before) * (there - here)

    def sensed(self, t_s: float, position_m: float) -> Mapping[str, float]:
        """Return the value of every channel, in its unit, at a second of the devices' clock and a motor's position."""
        force_n = self.force_n(position_m)
        since_s = (t_s - self._start_s) % self._duration_s
        load_n = float(np.interp(since_s, *self._corners))
        noise_n = self._force(since_s).get(FORCE, load_n) - load_n
        if force_n > 0.0:
            at_s = min(self._hold_s + force_n * self._s_per_n, self._duration_s - 1e-9)
        else:
            at_s = since_s % self._hold_s if self._hold_s else 0.0
        floor = self._floor_n[int(t_s * _FLOOR_HZ) % _FLOOR_DRAWS]
        return {**self._sensor(at_s), FORCE: force_n + noise_n + floor}
