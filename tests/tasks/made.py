"""Recordings of a task's own scenes, as the twin carries them out."""

import functools
import time

from tactbench.core.acquisition import acquire
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
        acquire(
            twin(), REGISTRY.sensors[sensor], REGISTRY.rigs["twin"], item.scene, role=item.role, seed=1,
            path=paths[-1], clock=time.perf_counter, provenance={},
        )  # fmt: skip
    return paths
