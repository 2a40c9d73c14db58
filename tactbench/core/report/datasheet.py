"""Comparison of sensors: rows as in the paper's Table I, data sheets and parameters, with their sources."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from tactbench.core.spec.quantity import Quantity, Source
from tactbench.core.spec.sensor import ChannelKind, DataSheet, PhysicalRange, SensorSpec, Statement
from tactbench.core.spec.skin import SheetTable
from tactbench.core.tables.text import TextTable

UNKNOWN = "unknown"
"""Text for a property, such as the mass of a device, that no source states."""
OF_DEVICES = tuple(name for name in DataSheet.model_fields if name != "exists")
"""Fields of a sensor's data sheet, in the order of the table."""

# Rows of Table I of Karl et al. 2016: title, kind of channel, and whether its range or its band is meant.
_TABLE_ONE: tuple[tuple[str, ChannelKind, str], ...] = (
    ("DC Pressure Range", "dc_pressure", "measures"),
    ("DC Temp. Range", "dc_temperature", "measures"),
    ("AC Pressure spectrum", "ac_pressure", "band"),
    ("AC Temp. spectrum", "ac_temperature", "band"),
)


class Fact(NamedTuple):
    """One field of a comparison of sensors, with its source."""

    text: str = "-"
    source: str = ""
    """Tag and reference: ``sourced: data sheet``."""


Facts = dict[str, Fact]
"""Fields of one sensor by title."""


def table_one(sensor: SensorSpec) -> Facts:
    """Return the fields of the paper's Table I: taxels, principle, ranges and bandwidths."""
    sites, channels = len(sensor.sites("taxel")), len(sensor.channels("taxel"))
    found = {
        "# taxels": Fact(str(sites) if sites == channels else f"{sites}, of {channels} channels"),
        "measurement principle": Fact(sensor.principle, _source(sensor.principle_source)),
    }
    for title, kind, which in _TABLE_ONE:
        stated: list[PhysicalRange | None] = [getattr(channel, which) for channel in sensor.channels(kind)]
        found[title] = next(map(_fact, filter(None, stated)), Fact())
    return found


def data_sheet(sensor: SensorSpec) -> Facts:
    """Return the properties of the sensor as a device: force range, size, mass, interface, power, availability."""
    unknown = Fact(UNKNOWN) if sensor.data_sheet.exists else Fact()
    stated = {name.replace("_", " "): getattr(sensor.data_sheet, name) for name in OF_DEVICES}
    return {name: unknown if one is None else _fact(one) for name, one in stated.items()}


def readings(sensor: SensorSpec) -> Facts:
    """Return the properties of the sensor's readings: streams with their rates, delay, range of the converter."""
    streams = [
        f"{one.name}: {len(one.channels)} ch., {f'{one.rate_hz:g} Hz' if one.rate_hz else 'rate not stated'}"
        for one in sensor.streams
    ]
    waits = [f"{one.name} {1e3 / one.rate_hz:.3g} ms" for one in sensor.streams if one.rate_hz]
    link = sensor.link_delay
    delay = f"sampling interval {', '.join(waits) or 'not stated'}; link {link or 'not stated'}"
    found = {
        "streams": Fact("; ".join(streams), _source(sensor.streams[0].rate_source)),
        "delay of a reading": Fact(delay, _source(link.source if link else None)),
    }
    for one in sensor.channels("taxel")[:1]:  # they are alike
        limits = "" if one.lower is None or one.upper is None else f"{one.lower:g}–{one.upper:g} "
        found["taxel reading"] = Fact(f"{limits}{one.unit}")
    return found


def quantities(sensor: SensorSpec) -> Facts:
    """Return every quantity that the sensor's spec states: link delay, skin, parameters, noise, nuisances."""
    found: dict[str, Quantity] = {}
    if sensor.link_delay is not None:
        found["link delay"] = sensor.link_delay
    if sensor.skin is not None:
        found.update(_named("skin", sensor.skin))
    usual = sensor.settable()
    found |= {name.replace("_", " "): quantity for name, quantity in sensor.parameters.items()} | usual
    for scenario in sensor.scenarios:
        other = sensor.handled(scenario).settable()
        found.update((f"{name}, {scenario}", amount) for name, amount in other.items() if usual.get(name) != amount)
    return {name: _fact(one) for name, one in found.items()}


def sensor_table(
    title: str, sensors: Sequence[SensorSpec], facts: Callable[[SensorSpec], Facts], *, with_source: bool
) -> TextTable:
    """Return the `facts` of sensors as a table with a column for each, and one for its sources if `with_source`."""
    known = list(map(facts, sensors))
    columns = [name for one in sensors for name in (one.title, f"{one.title}: source")[: 1 + with_source]]
    lines = [
        (name, *(text for own in known for text in own.get(name, Fact())[: 1 + with_source]))
        for name in dict.fromkeys(name for own in known for name in own)
    ]
    return TextTable(title, ("", *columns), tuple(lines))


def _source(stated: Source | None) -> str:
    return f"{stated.tag}: {stated.reference}" if stated else ""


def _fact(stated: Quantity | PhysicalRange | Statement) -> Fact:
    return Fact(stated.text if isinstance(stated, Statement) else str(stated), _source(stated.source))


def _named(prefix: str, model: object) -> Iterator[tuple[str, Quantity]]:
    """Yield every quantity in a model of a skin with its place in words."""
    for name in getattr(type(model), "model_fields", {}):
        value = getattr(model, name)
        words = name.replace("_", " ")
        if isinstance(value, Quantity):
            yield f"{prefix}: {words}", value
        elif isinstance(value, SheetTable):
            for end, length in (("least", value.least_mm), ("most", value.most_mm)):
                yield f"{prefix}: {words}, {end}", Quantity(value=length, unit="mm", source=value.source)
        elif isinstance(value, tuple):
            for place, item in enumerate(value, start=1):
                yield from _named(f"{prefix} {words} {place}", item)
        else:
            yield from _named(f"{prefix} {words}", value)
