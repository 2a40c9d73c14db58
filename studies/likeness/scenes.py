"""The scenes by which the simulation answers: those of the real recordings, as far as they are known."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from studies.likeness.figures import States
from tactbench.core.spec.scene import Slide
from tactbench.plugin import (
    ChannelKind,
    ForceRamp,
    Indenter,
    Placement,
    Scene,
    SensorDescriptor,
    assumed,
    load_object,
    load_registry,
)
from tactbench.plugin.simulation import FluidBackedShell, rig_context
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.shell import with_core
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import Contact, around_mm, gap_mm, skin_grid
from tactbench.rigs.twin.rig import build

SEED, RATE_HZ, WHY = 3, 100.0, "scene of the comparison with real recordings"
TILTS_DEG, AZIMUTHS_DEG = (10.0, 20.0, 29.0, 40.0, 51.0), (-40.0, 0.0, 40.0)
"""10th to 90th percentile of the hand-held plate's tilt, mostly towards the tip."""
LEVEL_DEG = ((0.0, 0.0), *((tilt, azimuth) for tilt in (6.5, 13.0) for azimuth in (0.0, 90.0, 180.0, -90.0)))
PLATE_N = (0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.5, 8.0, 10.0, 13.0, 16.0, 20.0, 25.0)
"""No real recording has a force: states are ordered by the fluid's pressure, and these reach its range."""
CAPS_MM, GRASP_N, LOADED = (10.0, 20.0, 40.0, math.inf), (0.5, 1.0, 2.0, 5.0), 10.0
"""Caps, loads, and the change of a taxel from which a fingertip counts as loaded."""


class Bench:
    """One sensor, ready for static presses without noise."""

    def __init__(self, sensor: SensorDescriptor) -> None:
        self.skin, self.sheet = sensor.spec.skin, sensor.spec.skin.sheet
        self.grid = skin_grid(self.sheet)
        self.channels = tuple(channel.name for channel in sensor.spec.channels("taxel"))
        self.normals = np.array([channel.normal for channel in sensor.spec.channels("taxel")])
        pressure = [channel.name for channel in sensor.spec.channels("dc_pressure")]
        self._read = load_object(sensor.transducer)(sensor.spec, self.grid, [*self.channels, *pressure])

    def press(self, gap: np.ndarray, forces_n: Sequence[float]) -> np.ndarray:
        """Return the (forces, channels) changes from rest; the fluid's pressure last, where there is one."""
        core = (lambda medium: with_core(medium, self.skin)) if isinstance(self.skin, FluidBackedShell) else None
        press = Press(medium_of(self.skin, self.grid), gap, Contact(math.inf, 0.0, 0.0), core=core)
        rest = np.asarray(self._read(press(0.0)))
        return np.stack([np.asarray(self._read(press(force))) - rest for force in forces_n])

    def cap(self, radius_mm: float, x_mm: float, s_mm: float) -> np.ndarray:
        """Return the gap to a cap, or a flat surface of infinite radius, at a place of the sheet."""
        return gap_mm(self.grid, Contact(radius_mm, x_mm, s_mm), self.sheet)

    def plate(self, normal: np.ndarray) -> np.ndarray:
        """Return the gap to a flat plate that faces the finger from a direction, measured along that."""
        # On the cylinder the tangent plane at the midline is level: `below` is a height but for a constant.
        surface = around_mm(self.grid, Contact(math.inf, 0.0, 0.0), self.sheet)
        height = sum(component * place for component, place in zip(normal, surface, strict=True))
        return np.max(height) - height


def direction(tilt_deg: float, azimuth_deg: float) -> np.ndarray:
    """Return the direction from the finger to a plate: tilted from the pad's normal, azimuth 0 towards the tip."""
    tilt, azimuth = math.radians(tilt_deg), math.radians(azimuth_deg)
    return np.array([math.sin(tilt) * math.cos(azimuth), math.sin(tilt) * math.sin(azimuth), -math.cos(tilt)])


def plates(sensor: SensorDescriptor, orientations_deg: Sequence[tuple[float, float]]) -> States:
    """Press flat plates of several orientations with all loads."""
    bench, changes, angles = Bench(sensor), [], []
    for orientation in orientations_deg:
        normal = direction(*orientation)
        changes.append(bench.press(bench.plate(normal), PLATE_N))
        angles.append(np.tile(np.degrees(np.arccos(np.clip(bench.normals @ normal, -1, 1))), (len(PLATE_N), 1)))
    found = np.concatenate(changes)
    return States(bench.channels, change=found[:, :-1], pressure=found[:, -1], angle_deg=np.concatenate(angles))


def grasps(sensor: SensorDescriptor) -> States:
    """Press caps and flats where a grasp happens to put them, 2 mm (sd) about the nominal place."""
    bench, rng, changes = Bench(sensor), np.random.default_rng(SEED), []
    x, s = (sensor.spec.parameters[name].to("mm") for name in ("contact_x", "contact_s"))
    for radius in CAPS_MM:
        for _ in range(4):
            off_x, off_s = 2.0 * rng.standard_normal(2)
            changes.append(bench.press(bench.cap(radius, x + off_x, s + off_s), GRASP_N))
    found = np.round(np.concatenate(changes))
    return States(bench.channels, change=found[np.abs(found).max(axis=1) >= LOADED])


def recorded(sensor: SensorDescriptor, scene: Scene, seeds: Sequence[int]) -> list[dict[str, np.ndarray]]:
    """Carry out a scene with several seeds; return (n,) samples by channel of the sensor."""
    twin, found = build(rig_context(load_registry())), []
    for seed in seeds:
        columns: dict[str, list[np.ndarray]] = {}
        with twin.open(sensor, scene, seed=seed) as acquisition:
            specs = {stream.name: stream.channels for stream in acquisition.streams}
            for block in acquisition:
                for column, channel in enumerate(specs.get(block.stream, ())):
                    columns.setdefault(channel.name, []).append(block.data[:, column].astype(float))
        found.append({name: np.concatenate(parts) for name, parts in columns.items()})
    return found


def _scene(kinds: tuple[ChannelKind, ...], force_n: float, seconds: float, **more: object) -> Scene:
    q = assumed(force_n, "N", WHY)
    profile = ForceRamp(start=q, end=q, hold=assumed(0.0, "s", WHY), duration=assumed(seconds, "s", WHY),
                        samples=round(seconds * RATE_HZ))  # fmt: skip
    return Scene(name="likeness", placement=Placement(scatter=assumed(0.0, "mm", WHY)), profile=profile,
                 observe=kinds, **more)  # fmt: skip


def rest(sensor: SensorDescriptor) -> States:
    """Leave the sensor alone for eight seconds, with several seeds."""
    names = [channel.name for channel in sensor.spec.channels("taxel")]
    found = recorded(sensor, _scene(("taxel", "ac_pressure"), 0.0, 8.0), range(1, 9))
    levels = np.array([[whole[name].mean() for name in names] for whole in found])
    return States(tuple(names), rest=levels, vibration=tuple(whole["PAC"] for whole in found), vibration_hz=2200.0)


def slide(sensor: SensorDescriptor) -> States:
    """Slide a blunt cap lightly over the pad: speed, shape and force of the real slides are not known."""
    motion = Slide(speed=assumed(50.0, "mm/s", WHY), start=assumed(0.0, "s", WHY))
    scene = _scene(("ac_pressure",), 0.5, 7.0, slide=motion, indenter=Indenter(radius=assumed(20.0, "mm", WHY)))
    # What sliding begins with is not looked at.
    rows = tuple(whole["PAC"][2200:] for whole in recorded(sensor, scene, range(1, 9)))
    return States((), vibration=rows, vibration_hz=2200.0)


CONDITIONS = {
    "rest": rest,
    "plate": lambda sensor: plates(sensor, [(tilt, azimuth) for tilt in TILTS_DEG for azimuth in AZIMUTHS_DEG]),
    "level plate": lambda sensor: plates(sensor, LEVEL_DEG),
    "slide": slide,
    "grasp": grasps,
}
