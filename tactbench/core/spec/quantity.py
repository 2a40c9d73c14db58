"""A number that says its unit and where it comes from."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from tactbench.core.errors import UsageError
from tactbench.core.spec import units

Tag = Literal["sourced", "measured", "derived", "assumed"]
"""How far a fact may be trusted: stated in a document, measured on real devices, computed from others, guessed."""


class Frozen(BaseModel):
    """A value object: immutable, no unknown fields, no NaN and no infinity but in quantities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


def _known(unit: str) -> str:
    units.parse(unit)
    return unit


Unit = Annotated[str, AfterValidator(_known)]
"""A unit of :mod:`tactbench.core.spec.units`."""


class Source(Frozen):
    """Where a fact comes from."""

    tag: Tag
    """`assumed` means that nobody has stated it: treat it as a parameter."""
    reference: str
    """Document, file or reason."""


class Quantity(Frozen):
    """One number with its unit and its source."""

    value: float = Field(allow_inf_nan=True)
    """The number as the source states it: a flat surface has an infinite radius."""
    unit: Unit
    source: Source
    """Why this number may be believed."""

    def to(self, unit: str) -> float:
        """Return the number in `unit`; raises UsageError when the dimensions differ."""
        return self.value * units.conversion(self.unit, unit)

    def __str__(self) -> str:
        return f"{self.value:g} {self.unit}"


def _measuring(unit: str) -> AfterValidator:
    """Return what refuses a quantity that cannot be turned into `unit`; pydantic then names the field."""

    def checked(given: Quantity) -> Quantity:
        try:
            given.to(unit)
        except UsageError as error:
            raise ValueError(f"{error.message} A quantity in {unit}, or a unit like it, is needed.") from error
        return given

    return AfterValidator(checked)


Length = Annotated[Quantity, _measuring("mm")]
Mass = Annotated[Quantity, _measuring("kg")]
Power = Annotated[Quantity, _measuring("W")]
Pressure = Annotated[Quantity, _measuring("MPa")]
Stiffness = Annotated[Quantity, _measuring("MPa/mm")]
"""Pressure per length."""
Tension = Annotated[Quantity, _measuring("N/mm")]
BendingStiffness = Annotated[Quantity, _measuring("N*mm")]
Time = Annotated[Quantity, _measuring("s")]
Share = Annotated[Quantity, _measuring("1")]


def sourced(value: float, unit: str, reference: str) -> Quantity:
    """Return a number that a document states."""
    return Quantity(value=value, unit=unit, source=Source(tag="sourced", reference=reference))


def measured(value: float, unit: str, reference: str) -> Quantity:
    """Return a number measured on real devices."""
    return Quantity(value=value, unit=unit, source=Source(tag="measured", reference=reference))


def derived(value: float, unit: str, reference: str) -> Quantity:
    """Return a number computed from others; `reference` says how."""
    return Quantity(value=value, unit=unit, source=Source(tag="derived", reference=reference))


def assumed(value: float, unit: str, reference: str) -> Quantity:
    """Return a number nobody has stated; `reference` says why it was chosen."""
    return Quantity(value=value, unit=unit, source=Source(tag="assumed", reference=reference))
