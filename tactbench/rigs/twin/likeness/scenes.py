"""The scenes by which the twin answers: comparable with those of the real recordings, as far as they are known."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from tactbench.plugin import (
    ChannelKind,
    FloatArray,
    ForceRamp,
    Indenter,
    NotApplicable,
    Placement,
    Scene,
    SensorDescriptor,
    SensorSpec,
    assumed,
    load_registry,
)
from tactbench.plugin.simulation import Environment, FluidBackedShell, Slide, rig_context
from tactbench.rigs.twin.geometry import finger_surface_mm
from tactbench.rigs.twin.likeness.evidence import LOADED_FROM, Evidence
from tactbench.rigs.twin.likeness.plate import plate_gap_mm, plate_normal
from tactbench.rigs.twin.likeness.pressing import Bench
from tactbench.rigs.twin.rig import Twin, build

_REST_KINDS: tuple[ChannelKind, ...] = ("taxel", "dc_pressure", "ac_pressure")
SEED = 3
RATE_HZ = 100.0
_WHY = "scene of the comparison with real recordings"

TILTS_DEG = (10.0, 20.0, 29.0, 40.0, 51.0)
"""10th percentile to 90th of the hand-held plate's tilt; median 29."""
AZIMUTHS_DEG = (-40.0, 0.0, 40.0)
"""Mostly towards the tip."""
LEVEL_TILTS_DEG = (0.0, 6.5, 13.0)
LEVEL_AZIMUTHS_DEG = (0.0, 90.0, 180.0, -90.0)
"""Plates within 13 degrees of the pad's normal, to all sides."""
PLATE_N = (0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.5, 8.0, 10.0, 13.0, 16.0, 20.0, 25.0)
"""No real recording has a force: states are ordered by the fluid's pressure, and these reach its range."""
POINT_N = (2.0, 6.0, 10.0, 16.0, 20.0, 25.0, 30.0)
POINT_RADIUS_MM = 3.0
"""Nobody says what was pointed; sharper ones let the fluid's pressure stay below what was recorded."""
CAPS_MM = (10.0, 20.0, 40.0, math.inf)
GRASP_N = (0.5, 1.0, 2.0, 5.0)
GRASPS = 4
"""Placements of each cap and force."""
GRASP_SCATTER_MM = 2.0
SLIDES = 8
SLIDE_RADIUS_MM, SLIDE_N, SLIDE_MM_S, SLIDE_S = 20.0, 0.5, 50.0, 6.0
"""The same as those by which the surface's roughness was set; none is known of the real slides."""
SLIDE_AFTER_S = 1.0
"""What sliding begins with is not looked at."""


def evidence(sensor: SensorDescriptor, condition: str) -> Evidence:
    """Carry out the scenes of one condition with the twin.

    Raises
    ------
    NotApplicable
        If the twin has no such scene for this sensor.
    """
    if condition not in CONDITIONS:
        raise NotApplicable(f"the twin carries out no scene of the kind {condition!r}")
    return CONDITIONS[condition](sensor)


def _rest(sensor: SensorDescriptor) -> Evidence:
    return _untouched(sensor, recordings=16, duration_s=8.0, since_power_on_s=600.0)


def _long_rest(sensor: SensorDescriptor) -> Evidence:
    """Rest for twelve minutes from power-on: as long as the real records, whose first temperature nobody knows."""
    return _untouched(sensor, recordings=1, duration_s=720.0, since_power_on_s=0.0)


def _untouched(sensor: SensorDescriptor, *, recordings: int, duration_s: float, since_power_on_s: float) -> Evidence:
    twin = build(rig_context(load_registry()))
    kinds = tuple(kind for kind in _REST_KINDS if kind == "taxel" or gives(sensor, kind))
    rest: list[FloatArray] = []
    pressure: list[FloatArray] = []
    vibration: list[FloatArray] = []
    for number in range(recordings):
        scene = _untouched_scene(f"rest-{number}", kinds, duration_s, since_power_on_s)
        whole = _channels(twin, sensor, scene, SEED)
        rest.append(np.stack([whole[channel.name] for channel in sensor.spec.channels("taxel")], axis=1))
        pressure.extend(whole[channel.name] for channel in sensor.spec.channels("dc_pressure") if channel.name in whole)
        vibration.extend(
            whole[channel.name] for channel in sensor.spec.channels("ac_pressure") if channel.name in whole
        )
    return Evidence(
        _names(sensor.spec), tuple(rest), tuple(pressure), tuple(vibration), _vibration_hz(sensor), dt_s=1.0 / RATE_HZ
    )


def _channels(twin: Twin, sensor: SensorDescriptor, scene: Scene, seed: int) -> dict[str, FloatArray]:
    """Carry out a scene; return (n,) samples of every channel of the sensor, by name."""
    columns: dict[str, list[FloatArray]] = {}
    with twin.open(sensor, scene, seed=seed) as acquisition:
        specs = {stream.name: stream for stream in acquisition.streams}
        for block in acquisition:
            for column, channel in enumerate(specs[block.stream].channels if block.stream in specs else ()):
                columns.setdefault(channel.name, []).append(block.data[:, column].astype(np.float64))
    return {name: np.concatenate(parts) for name, parts in columns.items()}


def _vibration_hz(sensor: SensorDescriptor) -> float | None:
    for stream in sensor.spec.streams:
        if any(channel.kind == "ac_pressure" for channel in stream.channels):
            return stream.rate_hz
    return None


def _slide(sensor: SensorDescriptor) -> Evidence:
    """Slide a blunt cap lightly over the pad: speed, shape and force of the real slides are not known."""
    twin = build(rig_context(load_registry()))
    (name,) = (channel.name for channel in sensor.spec.channels("ac_pressure"))
    scene = Scene(
        name="slide",
        indenter=Indenter(radius=assumed(SLIDE_RADIUS_MM, "mm", _WHY)),
        placement=Placement(scatter=assumed(0.0, "mm", _WHY)),
        profile=ForceRamp(
            start=assumed(SLIDE_N, "N", _WHY),
            end=assumed(SLIDE_N, "N", _WHY),
            hold=assumed(0.0, "s", _WHY),
            duration=assumed(SLIDE_S + SLIDE_AFTER_S, "s", _WHY),
            samples=round((SLIDE_S + SLIDE_AFTER_S) * RATE_HZ),
        ),
        slide=Slide(speed=assumed(SLIDE_MM_S, "mm/s", _WHY), start=assumed(0.0, "s", _WHY)),
        observe=("ac_pressure",),
    )
    rate = _vibration_hz(sensor) or RATE_HZ
    settled = round(SLIDE_AFTER_S * rate)
    vibration = tuple(_channels(twin, sensor, scene, seed)[name][settled:] for seed in range(1, 1 + SLIDES))
    return Evidence(_names(sensor.spec), vibration=vibration, vibration_hz=rate)


def _untouched_scene(
    name: str, kinds: tuple[ChannelKind, ...], duration_s: float = 1.0, since_power_on_s: float = 600.0
) -> Scene:
    return Scene(
        name=name,
        placement=Placement(scatter=assumed(0.0, "mm", _WHY)),
        profile=ForceRamp(
            end=assumed(0.0, "N", _WHY),
            hold=assumed(0.0, "s", _WHY),
            duration=assumed(duration_s, "s", _WHY),
            samples=round(duration_s * RATE_HZ),
        ),
        environment=Environment(since_power_on=assumed(since_power_on_s, "s", _WHY)),
        observe=kinds,
    )


def gives(sensor: SensorDescriptor, kind: ChannelKind) -> bool:
    """Answer whether the sensor has such channels and the installed effects give them; nothing is solved."""
    if not sensor.spec.channels(kind):
        return False
    try:
        build(rig_context(load_registry())).explain(sensor, _untouched_scene("rest", (kind,)))
    except NotApplicable:
        return False
    return True


def _plate(sensor: SensorDescriptor) -> Evidence:
    """Press flat plates, tilted towards the tip as a hand held them."""
    return _plates(sensor, [(tilt, azimuth) for tilt in TILTS_DEG for azimuth in AZIMUTHS_DEG])


def _level_plate(sensor: SensorDescriptor) -> Evidence:
    """Press flat plates that lie nearly along the pad."""
    return _plates(sensor, [(0.0, 0.0)] + [(t, a) for t in LEVEL_TILTS_DEG if t for a in LEVEL_AZIMUTHS_DEG])


def _plates(sensor: SensorDescriptor, orientations_deg: Sequence[tuple[float, float]]) -> Evidence:
    bench, outer = Bench(sensor), _shell_radius_mm(sensor.spec)
    surface = finger_surface_mm(bench.grid, outer, bench.sheet.dome, bench.sheet.relief)
    normals = np.array([channel.normal for channel in sensor.spec.channels("taxel")])
    changes, pressures, angles = [], [], []
    for tilt, azimuth in orientations_deg:
        normal = plate_normal(math.radians(tilt), math.radians(azimuth))
        change, pressure = bench.press(plate_gap_mm(surface, normal), PLATE_N)
        changes.append(change)
        pressures.append(pressure)
        angles.append(np.tile(np.degrees(np.arccos(np.clip(normals @ normal, -1.0, 1.0))), (len(change), 1)))
    return Evidence(
        _names(sensor.spec),
        change=np.concatenate(changes),
        pressure=np.concatenate(pressures),
        angle_deg=np.concatenate(angles),
    )


def _pointed(sensor: SensorDescriptor) -> Evidence:
    """Press a blunt point over electrode 1, radially above it: it lies on the cylinder."""
    bench, outer = Bench(sensor), _shell_radius_mm(sensor.spec)
    place = sensor.spec.channels("taxel")[0].position_m
    if place is None:
        raise NotApplicable(f"the first taxel of {sensor.name} has no place")
    x, y, z = (1e3 * component for component in place)
    change, pressure = bench.press_cap(POINT_RADIUS_MM, x, outer * math.atan2(y, -z), POINT_N)
    return Evidence(_names(sensor.spec), change=change, pressure=pressure)


def _release(sensor: SensorDescriptor) -> Evidence:
    """Hold plates for ten seconds and release them: what creep leaves one second later, with the spec's own terms."""
    bench, outer = Bench(sensor), _shell_radius_mm(sensor.spec)
    surface = finger_surface_mm(bench.grid, outer, bench.sheet.dome, bench.sheet.relief)
    held, after_s, loads = 10.0, 1.0, (2.0, 5.0, 10.0)
    share = sum(
        term.fraction.to("1") * -math.expm1(-held / term.tau.to("s")) * math.exp(-after_s / term.tau.to("s"))
        for term in sensor.spec.nuisances["taxel"].creep
    )
    changes, left = [], []
    for tilt in TILTS_DEG:
        gap = plate_gap_mm(surface, plate_normal(math.radians(tilt), 0.0))
        change, _ = bench.press(gap, tuple(sorted({*loads, *(share * load for load in loads)})))
        left.append(change[: len(loads)])
        changes.append(change[-len(loads) :])
    return Evidence(_names(sensor.spec), change=np.concatenate(changes), released=np.concatenate(left))


def _grasp(sensor: SensorDescriptor) -> Evidence:
    """Press caps and flats where a grasp happens to put them; only states that count as loaded."""
    bench = Bench(sensor)
    generator = np.random.default_rng(SEED)
    x0, s0 = (sensor.spec.parameters[name].to("mm") for name in ("contact_x", "contact_s"))
    changes = []
    for radius in CAPS_MM:
        for _ in range(GRASPS):
            off_x, off_s = GRASP_SCATTER_MM * generator.standard_normal(2)
            change, _ = bench.press_cap(radius, x0 + off_x, s0 + off_s, GRASP_N)
            changes.append(change)
    states = np.round(np.concatenate(changes))
    return Evidence(_names(sensor.spec), change=states[np.abs(states).max(axis=1) >= LOADED_FROM])


def _names(spec: SensorSpec) -> tuple[str, ...]:
    return tuple(channel.name for channel in spec.channels("taxel"))


def _shell_radius_mm(spec: SensorSpec) -> float:
    if not isinstance(spec.skin, FluidBackedShell) or spec.skin.sheet.outer_radius is None:
        raise NotApplicable(f"{spec.name} is no finger over a fluid: the twin has no such scene for it")
    return spec.skin.sheet.outer_radius.to("mm")


CONDITIONS: Mapping[str, Callable[[SensorDescriptor], Evidence]] = {
    "rest": _rest,
    "long-rest": _long_rest,
    "plate": _plate,
    "level-plate": _level_plate,
    "pointed": _pointed,
    "release": _release,
    "slide": _slide,
    "grasp": _grasp,
}
