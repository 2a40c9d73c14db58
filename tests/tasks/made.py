"""Recordings of a task's own scenes, as the twin carries them out."""

import functools
import time

from tactbench.core.acquisition import acquire
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.plugin import RigContext, load_object, load_registry

REGISTRY = load_registry()


@functools.cache
def twin():
    return load_object(REGISTRY.rigs["twin"].where)(RigContext(effects=tuple(REGISTRY.effects)))


def recorded(sensor, folder, planned):
    """Record planned scenes on the twin, and return the paths of their files."""
    paths = []
    for item in planned:
        paths.append(folder / f"{item.scene.name}.h5")
        request = RecordingRequest(
            REGISTRY.sensors[sensor], REGISTRY.rigs["twin"], item.scene, paths[-1], seed=1, role=item.role
        )
        acquire(twin(), request, clock=time.perf_counter)
    return paths
