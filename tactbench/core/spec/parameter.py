"""Parameters of indenter shapes and force profiles that plugins define."""

from __future__ import annotations

import math
from collections.abc import Mapping

from pydantic import Field, model_validator

from tactbench.core.errors import UsageError
from tactbench.core.spec.quantity import Frozen, Quantity, Unit


class Parameter(Frozen):
    """A parameter of a shape or of a force profile."""

    default: float
    """Value that is taken where a scene gives none, in `unit`."""
    unit: Unit
    """Unit in which the plugin's code receives the value."""
    text: str = Field(pattern=r"^\S[^\n]*$")
    """Description in one line."""
    least: float = 0.0
    """Smallest value that may be given, in `unit`."""
    most: float | None = None
    """Largest value that may be given, in `unit`; None: there is no such limit."""

    @model_validator(mode="after")
    def _default_may_be_given(self) -> Parameter:
        if not self.allows(self.default):
            raise ValueError(f"default: {self.default:g} is given, and {self.range} is expected")
        return self

    def allows(self, value: float) -> bool:
        """Return whether `value`, in `unit`, may be given."""
        return math.isfinite(value) and self.least <= value and (self.most is None or value <= self.most)

    @property
    def range(self) -> str:
        """The range of values in words: ``0.5 to 3 mm``."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        upper = "" if self.most is None else f" to {self.most:g}"
        return f"{self.least:g}{upper}{unit}{'' if upper else ' or more'}"


def values_of(what: str, parameters: Mapping[str, Parameter], given: Mapping[str, Quantity]) -> dict[str, float]:
    """Return the value of each of `parameters` in its own unit: `given`, or its default.

    Raises UsageError, which begins with `what` (``The indenter 'pin'``), for a name that is not among `parameters`, a
    unit of another dimension, or a value out of range.
    """
    for name in sorted(given.keys() - parameters.keys()):
        known = ", ".join(f"{known} [{one.unit}]" for known, one in parameters.items()) or "nothing"
        raise UsageError(f"{what}: {name!r} is given, which it does not have.", hint=f"It has: {known}.")
    values = {}
    for name, parameter in parameters.items():
        try:
            value = given[name].to(parameter.unit) if name in given else parameter.default
        except UsageError as error:
            raise UsageError(f"{what}: {name}: {error.message}", hint=f"It is: {parameter.text}") from error
        if not parameter.allows(value):
            raise UsageError(
                f"{what}: {name} is given as {given[name]}, and {parameter.range} is expected.",
                hint=f"It is: {parameter.text}",
            )
        values[name] = value
    return values
