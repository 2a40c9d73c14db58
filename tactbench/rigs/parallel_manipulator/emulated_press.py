"""What emulated devices of this rig sense: an emulated motor presses the sensor of a simulated scene.

Quasi-static. The motor's position gives the depth of the indenter, the simulated rig's press curve the force at that
depth, and the sensor reads what it read in the simulated recording of the same scene at the moment at which the ramp
had that force. So what depends on force is exact on a slow ramp, and what depends on time (drift, creep, noise) is that
of the simulated recording as long as the force keeps to its profile. Left out: the machine's own compliance, the mass
between motor and force sensor, what a quicker press would do to a skin with memory, anything sideways.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tactbench.plugin import Block, NotApplicable, Scene
from tactbench.plugin.simulation import SimulatedPress

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

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
        self._hold_ns = round(1e9 * profile.hold_s)
        self._duration_ns = round(1e9 * profile.duration.to("s"))
        self._ns_per_n = (self._duration_ns - self._hold_ns) / profile.end.to("N")
        depths_m, forces_n = simulated.press_curve(largest_n)
        even_m = np.linspace(0.0, float(depths_m[-1]), TABULATED)
        self._spacing_m = float(even_m[1])
        forces = np.interp(even_m, depths_m, forces_n)
        forces[0] = 0.0
        self._forces_n: list[float] = forces.tolist()
        self._tracks = _tracks(simulated)
        self._last: tuple[int, ...] = ()
        self._values: dict[str, float] = {}
        self._noise_ns, self._noise_n = _force_noise(simulated, scene)
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
        since_ns = round(1e9 * (t_s - self._start_s))
        if force_n > 0.0:
            at_ns = self._hold_ns + round(force_n * self._ns_per_n)
        else:
            at_ns = since_ns % self._hold_ns if self._hold_ns else 0
        rows = tuple([max(bisect_right(times, at_ns) - 1, 0) for times, _, _ in self._tracks])
        if rows != self._last:
            self._last = rows
            self._values = {}
            for row, (_, names, samples) in zip(rows, self._tracks, strict=True):
                self._values.update(zip(names, samples[row], strict=True))
        noise = self._noise_n[max(bisect_right(self._noise_ns, since_ns % self._duration_ns) - 1, 0)]
        floor = self._floor_n[int(t_s * _FLOOR_HZ) % _FLOOR_DRAWS]
        self._values[FORCE] = force_n + noise + floor
        return self._values


_Track = tuple[list[int], tuple[str, ...], list[list[float]]]


def _tracks(simulated: SimulatedPress) -> list[_Track]:
    """Return times [ns], channels and rows of samples of each of the sensor's streams."""
    blocks: dict[str, list[Block]] = {stream.name: [] for stream in simulated.streams}
    for block in simulated:
        if block.stream in blocks and block.t_ns is not None:
            blocks[block.stream].append(block)
    return [
        (
            np.concatenate([block.t_ns for block in blocks[stream.name]]).tolist(),
            tuple(channel.name for channel in stream.channels),
            np.concatenate([block.data for block in blocks[stream.name]]).tolist(),
        )
        for stream in simulated.streams
        if blocks[stream.name]
    ]


def _force_noise(simulated: SimulatedPress, scene: Scene) -> tuple[list[int], list[float]]:
    """Return times [ns] of the simulated force, and by how much it is off the load [N]."""
    for stream in simulated.reference:
        names = [channel.name for channel in stream.channels]
        if FORCE in names:
            own = [block for block in simulated if block.stream == stream.name and block.t_ns is not None]
            t_ns = np.concatenate([block.t_ns for block in own])
            measured: FloatArray = np.concatenate([block.data[:, names.index(FORCE)] for block in own])
            load = np.interp(1e-9 * t_ns, *scene.profile.corners)
            return t_ns.tolist(), (measured - load).tolist()
    return [0], [0.0]
