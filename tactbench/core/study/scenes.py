"""Construction of the scene described by the options ``--indenter`` and ``--profile`` of ``tactbench record``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import FiniteFloat, TypeAdapter

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.plugins.registry import Registry
from tactbench.core.plugins.rigs import force_path
from tactbench.core.spec.profile import ForceProfile, ForceRamp
from tactbench.core.spec.quantity import Quantity, sourced
from tactbench.core.spec.rig import Parameter, SensorDescriptor
from tactbench.core.spec.scene import Indenter, Scene

_BY = "the command line"


def scene_of(registry: Registry, sensor: SensorDescriptor, indenter: str | None, profile: str | None) -> Scene:
    """Return the scene of one press with the given indenter and force profile; by default those of the paper.

    Raises
    ------
    UnknownNameError
        If no shape or profile of the given name is installed.
    UsageError
        If a dimension or parameter is unknown, not a number, or out of its range.
    """
    pressed = Indenter() if indenter is None else _indenter(registry, indenter)
    labels: dict[str, str | float | int] = {}
    if pressed.radius is not None:
        labels["cap_radius_mm"] = pressed.radius.to("mm")
    elif pressed.shape is not None:
        labels["indenter"] = pressed.shape
    kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels()))
    # The name of a scene decides its random draws: a constant name leaves that to the seed.
    return Scene(
        name="press", indenter=pressed, profile=ForceRamp() if profile is None else _profile(registry, profile),
        observe=("taxel",) if "taxel" in kinds else kinds, labels=labels,
    )  # fmt: skip


def _indenter(registry: Registry, text: str) -> Indenter:
    """Return the indenter described by `text`, with a value for every dimension of its shape."""
    name, given = _named(text)
    descriptor = registry.indenters[name]
    turned = {"angle": sourced(given.pop("angle"), "deg", _BY)} if "angle" in given else {}
    stated = _in_units(given, descriptor.dimensions)
    sizes = {
        one: stated.get(one, sourced(size, descriptor.dimensions[one].unit, f"the default of the shape {name}"))
        for one, size in descriptor.sizes(stated).items()
    }
    return Indenter(shape=name, dimensions=sizes, **turned)


def _profile(registry: Registry, text: str) -> ForceProfile:
    name, given = _named(text)
    if name != "ramp":
        descriptor = registry.profiles[name]
        return force_path(descriptor, _in_units(given, descriptor.parameters), _BY)
    ramp = ForceRamp()
    for parameter, value in given.items():
        if parameter not in ("force", "duration"):
            raise UnknownNameError("parameter of the ramp", parameter, ("force", "duration"))
        if not value > 0:
            raise UsageError(f"{parameter} of the ramp must be above 0, not {value:g}.", hint="Give a number above 0.")
    change: dict[str, Any] = {"end": sourced(given["force"], "N", _BY)} if "force" in given else {}
    if "duration" in given:
        share = given["duration"] / ramp.duration.to("s")
        change["duration"] = sourced(given["duration"], "s", _BY)
        change["hold"] = sourced(ramp.hold.to("s") * share, "s", f"{_BY}: the same share of the duration")
        change["samples"] = max(1, round(ramp.samples * share))
    return ramp.model_copy(update=change)


def _named(text: str) -> tuple[str, dict[str, float]]:
    """Return the name and the numbers of ``NAME:A=1,B=2``; raises UsageError for a value that is not a number."""
    name, _, rest = text.partition(":")
    given: dict[str, float] = {}
    for part in filter(None, rest.split(",")):
        field, _, number = part.partition("=")
        try:
            given[field.strip()] = TypeAdapter(FiniteFloat).validate_python(number)
        except ValueError as error:
            raise UsageError(
                f"{field.strip()} of {name!r} is given as {number!r}; a finite number is expected.",
                hint=f"Write, for example, radius=4; `tactbench show {name}` shows the units.",
            ) from error
    return name.strip(), given


def _in_units(given: Mapping[str, float], parameters: Mapping[str, Parameter]) -> dict[str, Quantity]:
    """Return quantities in the units of `parameters`; unknown names get the unit 1 and are refused by the caller."""
    return {
        name: sourced(value, parameters[name].unit if name in parameters else "1", _BY) for name, value in given.items()
    }
