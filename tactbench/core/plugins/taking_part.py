"""Which simulation effects take part in a scene.

The effects of this package are candidates for every scene. An effect of another package is a candidate only where the
sensor's descriptor or the scene names it: what is merely installed is not imported into a run, and stands in no key.
"""

from __future__ import annotations

from typing import Any

from tactbench.core.plugins.interfaces import RigContext
from tactbench.core.plugins.registry import Owned, Registry
from tactbench.core.spec.rig import EffectDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Scene


def taking_part(registry: Registry, sensor: SensorDescriptor, scene: Scene) -> list[Owned[EffectDescriptor]]:
    """Return the effects that are candidates for a scene with a sensor, with their owners, sorted by name."""
    named = effect_names(sensor, scene)
    return [one for one in registry.effects.all_owned() if one.ours or one.descriptor.name in named]


def effect_names(sensor: SensorDescriptor, scene: Scene) -> set[str]:
    """Return the names of effects, and of groups of them, that the sensor's descriptor or the scene names.

    A simulated rig considers those of its context's `named_effects` that are among them.
    """
    return {*sensor.effects, *(word.lstrip("+-") for word in scene.simulation.effects)}


def rig_context(registry: Registry, **given: Any) -> RigContext:
    """Return what a rig is built from: the registry's effects and indenters, and what else is `given`."""
    owned = registry.effects.all_owned()
    return RigContext(
        effects=tuple(one.descriptor for one in owned if one.ours),
        named_effects=tuple(one.descriptor for one in owned if not one.ours),
        indenters=tuple(registry.indenters),
        **given,
    )
