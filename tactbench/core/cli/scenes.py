"""Which scene the options of a verb describe: what is pressed on a sensor, and how."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.parameter import Parameter
    from tactbench.core.spec.profile import ForceProfile
    from tactbench.core.spec.quantity import Quantity
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.scene import Indenter, Scene

_BY = "the command line"

PROFILE = click.option(
    "--profile", metavar="NAME[:P=X,...]",
    help="Force profile with its parameters: ramp:force=5,duration=60 (the default), sine:mean=2,frequency=0.5.",
)  # fmt: skip
"""Given to `profile_of`."""


def scene_of(
    name: str, sensor: SensorDescriptor | None, *, indenter: Indenter | None = None, profile: ForceProfile | None = None
) -> Scene:
    """Return a press; what is left open is that of the paper. None: no sensor is pressed."""
    from tactbench.core.spec.profile import ForceRamp
    from tactbench.core.spec.scene import Indenter, Scene

    indenter = indenter or Indenter()
    labels: dict[str, str | float | int] = {}
    if indenter.radius is not None:
        labels["cap_radius_mm"] = indenter.radius.to("mm")
    elif indenter.shape is not None:
        labels["indenter"] = indenter.shape
    kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels())) if sensor else ("taxel",)
    observe = ("taxel",) if "taxel" in kinds else kinds
    return Scene(name=name, indenter=indenter, profile=profile or ForceRamp(), observe=observe, labels=labels)


def indenter_of(registry: Registry, text: str | None) -> Indenter | None:
    """Return the indenter that --indenter describes, with every dimension of its shape; None: it was not given.

    Raises
    ------
    UnknownNameError
        If no such shape is installed.
    UsageError
        If a dimension is none of its own, no number, or out of its range.
    """
    from tactbench.core.spec.quantity import sourced
    from tactbench.core.spec.scene import Indenter

    if text is None:
        return None
    name, given = _named(text)
    descriptor = registry.indenters[name]
    turned = {"angle": sourced(given.pop("angle"), "deg", _BY)} if "angle" in given else {}
    stated = _in_units(given, descriptor.dimensions)
    sizes = {
        one: stated.get(one, sourced(size, descriptor.dimensions[one].unit, f"the default of the shape {name}"))
        for one, size in descriptor.sizes(stated).items()
    }
    return Indenter(shape=name, dimensions=sizes, **turned)


def profile_of(registry: Registry, text: str | None) -> ForceProfile | None:
    """Return the force profile that --profile describes; None: it was not given. Raises as `indenter_of`."""
    from tactbench.core.plugins.force_profiles import force_path

    if text is None:
        return None
    name, given = _named(text)
    if name == "ramp":
        return _ramp(given)
    descriptor = registry.profiles[name]
    return force_path(descriptor, _in_units(given, descriptor.parameters), _BY)


def _ramp(given: Mapping[str, float]) -> ForceProfile:
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.spec.profile import ForceRamp
    from tactbench.core.spec.quantity import sourced

    ramp = ForceRamp()
    change: dict[str, Any] = {}
    for name, value in given.items():
        if name not in ("force", "duration"):
            raise UnknownNameError("parameter of the ramp", name, ("force", "duration"))
        if not value > 0:
            raise UsageError(f"{name} of the ramp is {value:g}.", hint="Give a number above 0.")
    if "force" in given:
        change["end"] = sourced(given["force"], "N", _BY)
    if "duration" in given:
        share = given["duration"] / ramp.duration.to("s")
        change["duration"] = sourced(given["duration"], "s", _BY)
        change["hold"] = sourced(ramp.hold.to("s") * share, "s", f"{_BY}: the same share of the duration")
        change["samples"] = max(1, round(ramp.samples * share))
    return ramp.model_copy(update=change)


def _named(text: str) -> tuple[str, dict[str, float]]:
    """Return the name and the numbers of ``NAME:A=1,B=2``; raises UsageError naming what is none."""
    from pydantic import FiniteFloat, TypeAdapter

    from tactbench.core.errors import UsageError

    name, _, rest = text.partition(":")
    given: dict[str, float] = {}
    for part in filter(None, rest.split(",")):
        field, _, number = part.partition("=")
        try:
            given[field.strip()] = TypeAdapter(FiniteFloat).validate_python(number)
        except ValueError as error:
            raise UsageError(
                f"{field.strip()} of {name!r} is given as {number!r}, and a number is expected.",
                hint="Write it as radius=4; `tactbench show` with the name says in which unit.",
            ) from error
    return name.strip(), given


def _in_units(given: Mapping[str, float], parameters: Mapping[str, Parameter]) -> dict[str, Quantity]:
    """Return numbers in the units of `parameters`; names that are none of them are left for whoever refuses them."""
    from tactbench.core.spec.quantity import sourced

    return {
        name: sourced(value, parameters[name].unit if name in parameters else "1", _BY) for name, value in given.items()
    }
