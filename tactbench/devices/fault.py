"""Something wrong with an emulated device, by name and time."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from tactbench.core.errors import UnknownNameError, UsageError


@dataclass(frozen=True)
class Fault:
    """A fault from `start_s` until before `end_s`, seconds of the clock that the emulator is given.

    A device's own faults are a frozen subclass with :attr:`known`, and fields of its own for their details.

    Raises
    ------
    UsageError
        For a name that the device does not have, or `every` below 1.
    """

    known: ClassVar[Mapping[str, str]] = {}
    """Names of a device's faults, and what they do."""

    name: str
    start_s: float = -math.inf
    end_s: float = math.inf
    every: int = 1
    """Of the words, frames, lines or datagrams that it could concern: each n-th."""

    def __post_init__(self) -> None:
        if self.name not in self.known:
            raise UnknownNameError("fault", self.name, self.known)
        if self.every < 1:
            raise UsageError(f"The fault {self.name!r} cannot concern every {self.every}.", hint="Give 1 or more.")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the fault that ``name`` or ``name:key=value,key=value`` describes, as a rig file writes it.

        Keys are the fields of the class, values are numbers or text; several values of one key are joined by ``+``.

        Raises
        ------
        UsageError
            If name or key is unknown, or a value is not what the field holds.
        """
        name, _, rest = text.partition(":")
        fields = {field.name: field for field in dataclasses.fields(cls) if field.name != "name"}
        given: dict[str, object] = {}
        for part in filter(None, rest.split(",")):
            key, _, value = part.partition("=")
            if key not in fields:
                raise UnknownNameError(f"key of the fault {name!r}", key, fields)
            try:
                given[key] = _value(str(fields[key].type), value)
            except ValueError:
                raise UsageError(
                    f"The fault {text!r} has {value!r} for {key}.", hint=f"{key} is {fields[key].type}."
                ) from None
        return cls(name, **given)  # type: ignore[arg-type]

    def active(self, now_s: float) -> bool:
        """Return whether it is on."""
        return self.start_s <= now_s < self.end_s


def _value(annotation: str, text: str) -> object:
    """Return a field's value from text, by the field's annotation; ValueError if it is none."""
    if annotation.startswith("frozenset"):
        return frozenset(text.split("+"))
    if annotation.startswith("float"):
        return float(text)
    return int(text, 0) if annotation.startswith("int") else text


def fault_concerns(faults: Iterable[Fault], name: str, now_s: float, seen: Counter[Fault]) -> bool:
    """Return whether a fault `name` concerns the next word, line or datagram; `seen` counts those it could concern."""
    hit = False
    for fault in faults:
        if fault.name == name and fault.active(now_s):
            seen[fault] += 1
            hit |= seen[fault] % fault.every == 0
    return hit
