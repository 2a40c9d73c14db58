"""Creation of a scene's force path from a named force profile."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import ValidationError

from tactbench.core.errors import PluginContractError, complaint
from tactbench.core.plugins.registry import load_object
from tactbench.core.spec.profile import ForcePath
from tactbench.core.spec.quantity import Quantity, Source
from tactbench.core.spec.rig import ProfileDescriptor


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
            hint="Its times must ascend from 0 s, and its forces must be finite and 0 N or more.",
        ) from error
    if not isinstance(made, ForcePath):
        raise PluginContractError(
            f"{what} returned a {type(made).__name__}, and a ForcePath is expected.",
            hint=f"Correct {descriptor.where}.",
        )
    listed = ", ".join(f"{name} {value:g} {descriptor.parameters[name].unit}" for name, value in values.items())
    source = Source(tag="assumed", reference=f"{by}: force profile {descriptor.name} ({listed})")
    return made.model_copy(update={"source": source})
