"""Which effects of the rig's own force a scene calls for."""

from __future__ import annotations

from tactbench.plugin import Scene, SensorSpec
from tactbench.plugin.simulation import Reason


def force_loop(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether a motor has to bring the force about."""
    drive = scene.drive
    if drive is None:
        return Reason(False, "the scene declares no drive: the force follows its profile, 0 N off", 0.0, "N")
    if sensor.skin is None:
        return Reason(False, f"{sensor.name} declares no skin to press on", 0.0, "N")
    if not scene.profile.largest_n > 0:
        return Reason(False, "the scene has no load: 0 N throughout", 0.0, "N")
    filtered = "unfiltered" if drive.cutoff is None else f"behind a low-pass at {drive.cutoff}"
    steps = "a step per sample" if drive.rate is None else f"steps at {drive.rate}"
    return Reason(True, f"a motor presses by the measured force, {filtered}, {drive.delay} late, {steps}", None, "N")


def force_filter(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether the reference force is recorded behind a low-pass."""
    cutoff = scene.environment.force_filter
    if cutoff is None:
        return Reason(False, "the force is recorded unfiltered: no cut-off, 0 N off", 0.0, "N")
    return Reason(True, f"recorded behind a low-pass at {cutoff}", None, "N")
