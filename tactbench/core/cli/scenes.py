"""The options that say what is pressed on a sensor, and the scene they describe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import FiniteRange

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.parameter import Parameter
    from tactbench.core.spec.profile import ForceProfile
    from tactbench.core.spec.quantity import Quantity
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.scene import Indenter, Scene

_BY = "the command line"


_ABOVE_0 = FiniteRange(min=0, min_open=True)

PRESS = (
    click.option("--indenter", "indenter", metavar="NAME[:D=X,...]",
                 help="Another shape by name: cylinder:radius=4,angle=90, turned by 90 degrees about the press "
                      "axis; see `tactbench list indenters`."),
    click.option("--cap-mm", type=_ABOVE_0, metavar="R",
                 help="Radius of a spherical cap; without it the indenter is flat."),
    click.option("--force-n", type=_ABOVE_0, metavar="F", help="Force at the end; default 5."),
    click.option("--seconds", type=_ABOVE_0, metavar="T",
                 help="Duration; the ramp keeps its shape. Default 60."),
    click.option("--profile", "profile", metavar="NAME[:P=X,...]",
                 help="A force profile by name in place of the ramp: sine:mean=2,frequency=0.5; see "
                      "`tactbench list profiles`."),
)  # fmt: skip
"""Given to `indenter_of`, `profile_of` and `scene_of`."""


def scene_of(
    name: str,
    cap_mm: float | None,
    force_n: float | None,
    seconds: float | None,
    sensor: SensorDescriptor | None,
    shape: Indenter | None = None,
    profile: ForceProfile | None = None,
) -> Scene:
    """Return the scene the options describe; what they leave open is that of the paper. None: no sensor is pressed."""
    from tactbench.core.errors import UsageError
    from tactbench.core.spec.profile import ForceRamp
    from tactbench.core.spec.quantity import sourced
    from tactbench.core.spec.scene import Indenter, Scene

    ramp = ForceRamp()
    change: dict[str, Any] = {}
    if force_n is not None:
        change["end"] = sourced(force_n, "N", _BY)
    if seconds is not None:
        share = seconds / ramp.duration.to("s")
        change["duration"] = sourced(seconds, "s", _BY)
        change["hold"] = sourced(ramp.hold.to("s") * share, "s", f"{_BY}: the same share of the duration")
        change["samples"] = max(1, round(ramp.samples * share))
    if profile is not None and change:
        raise UsageError("--force-n and --seconds are of the ramp.", hint="Give them as parameters of --profile.")
    if shape is not None and cap_mm is not None:
        raise UsageError("--cap-mm and --indenter both say what is pressed.", hint="Leave one of them out.")
    indenter = shape or (Indenter() if cap_mm is None else Indenter(radius=sourced(cap_mm, "mm", _BY)))
    kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels())) if sensor else ("taxel",)
    labels: dict[str, str | float | int] = {}
    if indenter.radius is not None:
        labels["cap_radius_mm"] = indenter.radius.to("mm")
    elif indenter.shape is not None:
        labels["indenter"] = indenter.shape
    observe = ("taxel",) if "taxel" in kinds else kinds
    load = profile or ramp.model_copy(update=change)
    return Scene(name=name, indenter=indenter, profile=load, observe=observe, labels=labels)


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
    """Return the force path that --profile describes; None: it was not given. Raises as `indenter_of`."""
    from tactbench.core.plugins.force_profiles import force_path

    if text is None:
        return None
    name, given = _named(text)
    descriptor = registry.profiles[name]
    return force_path(descriptor, _in_units(given, descriptor.parameters), _BY)


def _named(text: str) -> tuple[str, dict[str, float]]:
    """Return the name and the numbers of ``NAME:A=1,B=2``; raises UsageError naming what is none."""
    from tactbench.core.errors import UsageError

    name, _, rest = text.partition(":")
    given: dict[str, float] = {}
    for part in filter(None, rest.split(",")):
        field, _, number = part.partition("=")
        try:
            given[field.strip()] = float(number)
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
