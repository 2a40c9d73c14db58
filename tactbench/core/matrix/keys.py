"""Keys: what decides a recording or a result, and nothing else, in one digest."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.source import SourceDigests
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.scene import Role, Scene

RELEVANT = ("numpy", "scipy", "scikit-learn")
"""Distributions whose version may change a number."""

_TOLD_OTHERWISE = {"published", "equivalence", "reference_score", "title", "question", "scenes", "campaigns"}
"""Of a task: what changes no number, and what its recordings say themselves, by their content."""


def recording_key(
    sensor: str, rig: str, scene: Scene, role: Role, seed: int, registry: Registry, sources: SourceDigests
) -> str:
    """Return the key of a recording that `rig` is to make of `scene`."""
    maker, carrier = registry.sensors.owned(sensor), registry.rigs.owned(rig)
    effects = [registry.effects.owned(effect.name) for effect in registry.effects]
    return _digest(
        {
            "sensor": maker.descriptor.model_dump(mode="json"),
            "rig": carrier.descriptor.model_dump(mode="json"),
            "effects": [owner.descriptor.model_dump(mode="json") for owner in effects],
            "scene": scene.model_dump(mode="json"),
            "role": role,
            "seed": seed,
            "source": _sources([maker.module, carrier.module, *(owner.module for owner in effects)], sources),
            "versions": versions(),
        }
    )


def cell_key(cell: Cell, data: Sequence[str], registry: Registry, sources: SourceDigests) -> str:
    """Return the key of a cell's result; `data` are the content digests of its recordings, in order."""
    task = registry.tasks.owned(cell.task)
    estimator = registry.estimators.owned(cell.estimator)
    return _digest(
        {
            "sensor": cell.sensor,
            "task": task.descriptor.model_dump(mode="json", exclude={"spec": _TOLD_OTHERWISE}),
            "protocol": cell.protocol,
            "split": cell.split,
            "estimator": estimator.descriptor.model_dump(mode="json", exclude={"title", "linear"}),
            "params": dict(cell.params),
            "seed": cell.seed,
            "data": list(data),
            "source": _sources([task.module, estimator.module, estimator.descriptor.where], sources),
            "versions": versions(estimator.descriptor.distributions),
        }
    )


def _sources(modules: Sequence[str], sources: SourceDigests) -> Mapping[str, str]:
    packages = sorted({module.partition(":")[0].partition(".")[0] for module in modules} | {"tactbench"})
    return {package: sources.package(package) for package in packages}


@lru_cache(maxsize=8)
def versions(more: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the versions that may change a number: Python's, those of `RELEVANT` and of the distributions `more`."""
    found = {"python": f"{sys.version_info.major}.{sys.version_info.minor}"}
    for name in (*RELEVANT, *more):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found


def _digest(facts: Mapping[str, Any]) -> str:
    canonical = json.dumps(facts, sort_keys=True, separators=(",", ":"), allow_nan=True)
    return hashlib.sha256(canonical.encode()).hexdigest()[:32]
