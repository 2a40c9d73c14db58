"""Building of rigs from their descriptors, rig files and effects, and of force paths from named profiles.

The effects of this package are candidates for every scene; those of another package only if the sensor's descriptor or
the scene names them, so that a package that is merely installed is not imported into a run and is in no key.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tactbench.core.errors import PluginContractError, RigError, TactbenchError, complaint, error_text
from tactbench.core.plugins.interfaces import Operator, ReplayRig, Rig, RigContext
from tactbench.core.plugins.registry import Owned, Registry, load_object
from tactbench.core.spec.profile import ForcePath
from tactbench.core.spec.quantity import Quantity, Source
from tactbench.core.spec.rig import EffectDescriptor, ProfileDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.scene import Scene


def load_rig_file(path: Path, registry: Registry) -> RigFile:
    """Return the rig file at `path`; its settings are checked by the model of its rig, if there is a model.

    Raises ConfigError, which names the line, if it is not valid, and UnknownNameError if the rig is not installed.
    """
    from tactbench.core.spec.yaml_file import load_yaml

    file = load_yaml(path, RigFile)
    where = registry.rigs[file.rig].file
    if where is not None:
        load_yaml(path, load_object(where))
    physics = file.emulation.physics or registry.first_rig("simulated")
    return file.model_copy(update={"emulation": file.emulation.model_copy(update={"physics": physics})})


def rig_of(
    name: str,
    registry: Registry,
    recordings: Path | None = None,
    rig_file: RigFile | None = None,
    operator: Operator | None = None,
) -> Rig | ReplayRig:
    """Return the rig called `name`, built with its rig file.

    Raises UsageError if the rig file is for another rig, and RigError if the rig's own code fails.
    """
    descriptor = registry.rigs[name]
    if rig_file is not None:
        rig_file.checked_for(name)
    context = rig_context(registry, recordings=recordings, rig_file=rig_file, operator=operator)
    with failing_as(f"The rig {name!r} could not be built"):
        built: Rig | ReplayRig = load_object(descriptor.where)(context)
    return built


@contextmanager
def failing_as(what: str) -> Iterator[None]:
    """Return a context that converts other errors of a rig's code to RigError with a message starting with `what`."""
    try:
        yield
    except TactbenchError:
        raise
    except (Exception, SystemExit) as error:
        raise RigError(
            f"{what}: {error_text(error)}.", hint="`tactbench list plugins` shows the rig's plugin."
        ) from error


def taking_part(registry: Registry, sensor: SensorDescriptor, scene: Scene) -> list[Owned[EffectDescriptor]]:
    """Return the effects that are candidates for a scene with a sensor, with their plugins, sorted by name."""
    named = effect_names(sensor, scene)
    return [one for one in registry.effects.all_owned() if one.ours or one.descriptor.name in named]


def effect_names(sensor: SensorDescriptor, scene: Scene) -> set[str]:
    """Return the names of effects, and of groups of effects, that the sensor's descriptor and the scene contain.

    Of its context's `named_effects`, a simulated rig considers only the effects with such names.
    """
    return {*sensor.effects, *(word.lstrip("+-") for word in scene.simulation.effects)}


def rig_context(registry: Registry, **given: Any) -> RigContext:
    """Return the context for building a rig: the registry's effects and indenters, and the fields `given`."""
    owned = registry.effects.all_owned()
    return RigContext(
        effects=tuple(one.descriptor for one in owned if one.ours),
        named_effects=tuple(one.descriptor for one in owned if not one.ours),
        indenters=tuple(registry.indenters),
        **given,
    )


def force_path(descriptor: ProfileDescriptor, given: Mapping[str, Quantity], by: str) -> ForcePath:
    """Return the path of a force profile, with the parameters `given` and defaults for all others.

    The path's source names `by` (the option or file that selects the profile), the profile and every parameter. Raises
    UsageError for a parameter that is not valid, and PluginContractError if the plugin returns no force path.
    """
    values = descriptor.values(given)
    what = f"The force profile {descriptor.name!r}"
    try:
        made = load_object(descriptor.where)(**values)
    except ValidationError as error:
        raise PluginContractError(
            f"{what} gives no valid force path for {values}: {complaint(error)}.",
            hint="The path's times must ascend from 0 s, and its forces must be finite and 0 N or more.",
        ) from error
    if not isinstance(made, ForcePath):
        raise PluginContractError(
            f"{what} returned a {type(made).__name__} where a ForcePath is expected.",
            hint=f"Correct {descriptor.where}.",
        )
    listed = ", ".join(f"{name} {value:g} {descriptor.parameters[name].unit}" for name, value in values.items())
    source = Source(tag="assumed", reference=f"{by}: force profile {descriptor.name} ({listed})")
    return made.model_copy(update={"source": source})
