"""Parameters of indenter shapes and force profiles that plugins define."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

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

    Parameters
    ----------
    what
        Whose they are, for messages: ``The indenter 'pin'``.

    Raises
    ------
    UsageError
        Naming the first that `what` does not have, whose unit is another one, or whose value is out of range.
    """
    check_names(what, parameters, given)
    values = {}
    for name, parameter in parameters.items():
        try:
            value = given[name].to(parameter.unit) if name in given else parameter.default
        except UsageError as error:
            raise UsageError(
                f"{what}: {name} is given as {given[name]}, and a number in {parameter.unit} is expected.",
                hint=f"It is: {parameter.text}",
            ) from error
        if not parameter.allows(value):
            raise UsageError(
                f"{what}: {name} is given as {given.get(name, value)}, and {parameter.range} is expected.",
                hint=f"It is: {parameter.text}",
            )
        values[name] = value
    return values


def check_names(what: str, parameters: Mapping[str, Parameter], given: Iterable[str]) -> None:
    """Raise UsageError for the first of the names `given` that is not one of `parameters`."""
    for name in given:
        if name not in parameters:
            known = ", ".join(f"{known} [{one.unit}]" for known, one in parameters.items()) or "nothing"
            raise UsageError(f"{what}: {name!r} is given, which it does not have.", hint=f"It has: {known}.")
