"""Quantities: numbers with a unit and a source."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from tactbench.core.errors import UsageError
from tactbench.core.spec import units

Tag = Literal["sourced", "measured", "derived", "assumed"]
"""Trust in a fact: stated in a document, measured on real devices, derived from other facts, or assumed."""


class Frozen(BaseModel):
    """An immutable model without unknown fields, and without NaN and infinity except in quantities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


def _known(unit: str) -> str:
    units.parse(unit)
    return unit


Unit = Annotated[str, AfterValidator(_known)]
"""Name of a unit of :mod:`tactbench.core.spec.units`."""


class Source(Frozen):
    """Source of a fact; a fact that is `assumed` has none, and is treated as a parameter."""

    tag: Tag
    reference: str
    """Document, file, or reason of an assumption."""


class Quantity(Frozen):
    """A number with its unit and its source."""

    value: float = Field(allow_inf_nan=True)
    """The number as the source states it: a flat surface has an infinite radius."""
    unit: Unit
    source: Source

    def to(self, unit: str) -> float:
        """Return the number in `unit`; raises UsageError when the dimensions differ."""
        return self.value * units.conversion(self.unit, unit)

    def __str__(self) -> str:
        return f"{self.value:g} {self.unit}"


def _measuring(unit: str) -> AfterValidator:
    """Return a validator that refuses a quantity which cannot be converted to `unit`."""

    def checked(given: Quantity) -> Quantity:
        try:
            given.to(unit)
        except UsageError as error:
            raise ValueError(error.message) from error
        return given

    return AfterValidator(checked)


Length = Annotated[Quantity, _measuring("mm")]
Mass = Annotated[Quantity, _measuring("kg")]
Power = Annotated[Quantity, _measuring("W")]
Pressure = Annotated[Quantity, _measuring("MPa")]
Stiffness = Annotated[Quantity, _measuring("MPa/mm")]
"""A pressure for each length."""
Tension = Annotated[Quantity, _measuring("N/mm")]
BendingStiffness = Annotated[Quantity, _measuring("N*mm")]
Time = Annotated[Quantity, _measuring("s")]
Share = Annotated[Quantity, _measuring("1")]


def sourced(value: float, unit: str, reference: str) -> Quantity:
    """Return a quantity that a document states."""
    return Quantity(value=value, unit=unit, source=Source(tag="sourced", reference=reference))


def measured(value: float, unit: str, reference: str) -> Quantity:
    """Return a quantity that was measured on real devices."""
    return Quantity(value=value, unit=unit, source=Source(tag="measured", reference=reference))


def derived(value: float, unit: str, reference: str) -> Quantity:
    """Return a quantity that is computed from others; `reference` states how."""
    return Quantity(value=value, unit=unit, source=Source(tag="derived", reference=reference))


def assumed(value: float, unit: str, reference: str) -> Quantity:
    """Return a quantity that no source states; `reference` gives the reason for its value."""
    return Quantity(value=value, unit=unit, source=Source(tag="assumed", reference=reference))
