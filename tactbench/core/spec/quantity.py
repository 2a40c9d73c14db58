"""Quantities: numbers with a unit and a source."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from tactbench.core.errors import UsageError
from tactbench.core.spec import units

Tag = Literal["sourced", "measured", "derived", "assumed"]
"""Trust in a value: stated in a document, measured on real devices, derived from other values, or assumed."""


class Frozen(BaseModel):
    """An immutable model, which refuses unknown fields; NaN and infinity are refused except in quantities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


def _known(unit: str) -> str:
    units.parse(unit)
    return unit


Unit = Annotated[str, AfterValidator(_known)]
"""Name of a unit, for example ``mm`` or ``N/mm``, from :mod:`tactbench.core.spec.units`."""


class Source(Frozen):
    """Source of a value; an `assumed` value has no source, and is treated as a parameter."""

    tag: Tag
    reference: str
    """Document or file that states the value, or the reason for an assumption."""


class Quantity(Frozen):
    """A number with its unit and the source of its value."""

    value: float = Field(allow_inf_nan=True)
    """The number as the source states it; infinity is allowed, as for the radius of a flat surface."""
    unit: Unit
    source: Source

    def to(self, unit: str) -> float:
        """Return the number converted to `unit`; raise UsageError if the dimensions differ."""
        return self.value * units.conversion(self.unit, unit)

    def __str__(self) -> str:
        return f"{self.value:g} {self.unit}"


def _measuring(unit: str) -> AfterValidator:
    """Return a pydantic validator that refuses a quantity which cannot be converted to `unit`."""

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
"""A quantity with the dimension of pressure / length."""
Tension = Annotated[Quantity, _measuring("N/mm")]
BendingStiffness = Annotated[Quantity, _measuring("N*mm")]
Time = Annotated[Quantity, _measuring("s")]
Share = Annotated[Quantity, _measuring("1")]


def sourced(value: float, unit: str, reference: str) -> Quantity:
    """Return a quantity that is stated in the document `reference`."""
    return Quantity(value=value, unit=unit, source=Source(tag="sourced", reference=reference))


def measured(value: float, unit: str, reference: str) -> Quantity:
    """Return a quantity that was measured on real devices, as `reference` states."""
    return Quantity(value=value, unit=unit, source=Source(tag="measured", reference=reference))


def derived(value: float, unit: str, reference: str) -> Quantity:
    """Return a quantity computed from other quantities; `reference` states the computation."""
    return Quantity(value=value, unit=unit, source=Source(tag="derived", reference=reference))


def assumed(value: float, unit: str, reference: str) -> Quantity:
    """Return a quantity for which there is no source; `reference` gives the reason for its value."""
    return Quantity(value=value, unit=unit, source=Source(tag="assumed", reference=reference))
