"""Scenes and simulations as described by options of the command line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import FiniteFloat, TypeAdapter, ValidationError

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.plugins.registry import Registry
from tactbench.core.plugins.rigs import force_path
from tactbench.core.spec.profile import ForceProfile, ForceRamp
from tactbench.core.spec.quantity import Quantity, sourced
from tactbench.core.spec.rig import Parameter, SensorDescriptor
from tactbench.core.spec.scene import NUISANCES, Indenter, Scene, Simulation

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
        wrong = f"{field.strip()} of {name!r} is given as {number!r} where a finite number is expected."
        given[field.strip()] = _number(number, wrong, f"Write, for example, radius=4; see `tactbench show {name}`.")
    return name.strip(), given


def _in_units(given: Mapping[str, float], parameters: Mapping[str, Parameter]) -> dict[str, Quantity]:
    """Return quantities in the units of `parameters`; unknown names get the unit 1 and are refused by the caller."""
    return {
        name: sourced(value, parameters[name].unit if name in parameters else "1", _BY) for name, value in given.items()
    }


_NAMED = ("rung", "scenario")


def simulation_of(
    registry: Registry, rig: str, sensors: Sequence[str], effects: str | None, settings: Iterable[str] = (),
    stated: Simulation = Simulation(),  # noqa: B008  (it never changes)
) -> Simulation:  # fmt: skip
    """Return the settings of a simulated rig: those `stated` in the matrix file, changed by --effects and --set.

    Raises
    ------
    UsageError
        If --effects or --set contains an unknown name, --set a value out of its range, or the rig is not
        simulated.
    """
    given = dict(map(_setting, settings))
    change: dict[str, Any] = {name: given.pop(name) for name in (*_NAMED, "tolerance") if name in given}
    if effects is not None:
        change["effects"] = tuple(word.strip() for word in effects.split(",") if word.strip())
    if not (change or given or stated.nuisances):
        return stated
    if not registry.rigs[rig].simulated:
        raise UsageError(f"--effects and --set need a simulated rig, not {rig}.", hint="Leave out both options.")
    scenarios = [name for sensor in registry.sensors for name in sensor.spec.scenarios]
    for key, what, known in (("scenario", "scenario", scenarios), ("rung", f"rung of {rig}", registry.rigs[rig].rungs)):
        if key in change and change[key] not in known:
            raise UnknownNameError(what, change[key], known)
    for word in change.get("effects", ()):
        _check_effect(registry, word)
    if "rung" in change or "tolerance" in change:  # one takes the other's place
        change = {"rung": None, "tolerance": None, **change}
    change["nuisances"] = {**dict(stated.nuisances), **given}
    try:
        simulation = Simulation.model_validate({**stated.model_dump(), **change})
    except ValidationError as error:
        raise UsageError(f"--set: {error.errors()[0]['msg']}.", hint="See `tactbench run --help`.") from error
    specs = [registry.sensors[name].spec for name in sensors]
    nuisances = dict.fromkeys([*NUISANCES, *(name for sensor in specs for name in sensor.settable())])
    for name, _ in simulation.nuisances:
        if name not in nuisances:
            raise UnknownNameError("nuisance", name, nuisances)
    for sensor in specs:
        sensor.with_nuisances(dict(simulation.nuisances))
    return simulation


def _setting(text: str) -> tuple[str, Any]:
    """Return the name and value of a --set option; raises UsageError if a number is expected and not given."""
    name, _, value = text.partition("=")
    if name in _NAMED and value:
        return name, value
    wrong = f"--set {text!r} is not NAME=NUMBER."
    return name, _number(value, wrong, "Write, for example, --set placement_scatter_mm=0.3.")


def _number(text: str, wrong: str, hint: str) -> float:
    """Return `text` as a number; raises UsageError with the message `wrong` if it is no finite number."""
    try:
        return TypeAdapter(FiniteFloat).validate_python(text)
    except ValueError as error:
        raise UsageError(wrong, hint=hint) from error


def _check_effect(registry: Registry, word: str) -> None:
    """Raise UsageError if a word of --effects is not the name of an effect, or lacks its sign + or -."""
    name = word.lstrip("+-")
    effects = {name for effect in registry.effects for name in (effect.name, *effect.groups)} | {"all"}
    if name not in effects:
        raise UnknownNameError("effect", name, effects)
    if word == name and (name not in registry.effects or registry.effects.owned(name).ours):
        raise UsageError(f"--effects {word!r} lacks its sign + or -.", hint=f"Write +{word} or -{word}.")
