"""Putting a value, drawn or given by a setting, where it stands in a scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.spec.calibration import CalibrationSpec, Fixed, Nuisance, Setting, Variation
from tactbench.core.spec.quantity import Quantity, assumed
from tactbench.core.spec.scene import Scene

M = TypeVar("M", bound=BaseModel)


def with_parameters(scene: Scene, spec: CalibrationSpec, sensor: str, values: Mapping[str, float]) -> Scene:
    """Return `scene` with every nuisance of `sensor` set to its drawn value.

    Raises
    ------
    UnknownNameError
        If a nuisance's path leads to no field of a scene.
    UsageError
        If what stands there is not a number, or refuses the value.
    """
    for nuisance in spec.nuisances:
        if not nuisance.sensors or sensor in nuisance.sensors:
            quantity = assumed(values[nuisance.name], nuisance.unit, f"drawn from the prior of {nuisance.name}")
            scene = _placed(scene, nuisance.path, tuple(nuisance.path.split(".")), quantity)
    return scene


def _placed(model: M, path: str, way: tuple[str, ...], quantity: Quantity) -> M:
    """Return a copy of `model` with the number at `way`, checked as any other."""
    name, rest = way[0], way[1:]
    if name not in type(model).model_fields:
        raise UnknownNameError(f"part of a scene ({path})", name, type(model).model_fields)
    inside = getattr(model, name)
    if rest:
        if not isinstance(inside, BaseModel):
            raise UsageError(
                f"The nuisance path {path!r} goes through {name!r}, which this scene does not have.",
                hint="Draw only what every scene of the task states.",
            )
        return model.model_copy(update={name: _placed(inside, path, rest, quantity)})
    allowed = str(type(model).model_fields[name].annotation)
    if "Quantity" in allowed:
        if isinstance(inside, Quantity):
            quantity.to(inside.unit)  # another dimension is refused here
        value: Quantity | float = quantity
    elif "float" in allowed:
        value = quantity.to("1")
    else:
        raise UsageError(f"The nuisance path {path!r} leads to {inside!r}, not to a number.", hint="Name a number.")
    try:
        return type(model).model_validate({**dict(model), name: value})
    except ValidationError as error:
        raise UsageError(
            f"{path} cannot be {quantity}: {error.errors()[0]['msg']}.", hint="Narrow the nuisance's prior."
        ) from error


def as_procedure(spec: CalibrationSpec, variation: Variation, setting: Setting) -> CalibrationSpec:
    """Return the procedure whose draws are the seeds of one setting: what it gives is fixed, nothing is drawn."""
    given = tuple(
        Nuisance(
            name=f"given_{place}", path=one.path, unit=one.unit, sensors=one.sensors,
            prior=Fixed(kind="fixed", value=one.value), reason=setting.label, source="assumed",
        )
        for place, one in enumerate(setting.given, start=1)
    )  # fmt: skip
    outputs = tuple(spec.output(name) for name in variation.outputs)
    return spec.model_copy(update={"nuisances": given, "outputs": outputs, "variations": ()})


def procedures(spec: CalibrationSpec) -> Iterator[CalibrationSpec]:
    """Yield the procedure of every setting."""
    for variation in spec.variations:
        for setting in variation.settings:
            yield as_procedure(spec, variation, setting)
