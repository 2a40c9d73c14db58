"""Compares sensors side by side: the rows of the paper's Table I, data sheets and parameters, with their sources."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from tactbench.core.spec.quantity import Quantity, Source
from tactbench.core.spec.sensor import ChannelKind, SensorSpec, Statement
from tactbench.core.spec.skin import SheetTable
from tactbench.core.tables.text_table import TextTable

ABSENT = "-"
UNKNOWN = "unknown"
"""Text for a fact that every device has and that no source states."""
OF_DEVICES = ("force_range", "length", "width", "height", "mass", "interface", "power", "availability")
"""Fields of a data sheet, in the order in which they are shown."""

# Rows of Table I of Karl et al. 2016: title, kind of channel, and whether its range or its band is meant.
_TABLE_ONE: tuple[tuple[str, ChannelKind, str], ...] = (
    ("DC Pressure Range", "dc_pressure", "measures"),
    ("DC Temp. Range", "dc_temperature", "measures"),
    ("AC Pressure spectrum", "ac_pressure", "band"),
    ("AC Temp. spectrum", "ac_temperature", "band"),
)


class Fact(NamedTuple):
    """One field of the comparison: a text, with the tag and the reference of its source."""

    text: str
    tag: str = ""
    reference: str = ""


class Property(NamedTuple):
    """A row of the comparison: a title, and one fact for each sensor."""

    title: str
    facts: tuple[Fact, ...]


def table_one(sensors: Sequence[SensorSpec]) -> list[Property]:
    """Return the paper's Table I for any sensors."""
    looks: dict[str, Callable[[SensorSpec], Fact]] = {
        "# taxels": _number_of_taxels,
        "measurement principle": lambda sensor: _fact(sensor.principle, sensor.principle_source),
    }
    looks |= {title: partial(_range, kind=kind, which=which) for title, kind, which in _TABLE_ONE}
    return _properties(sensors, looks)


def data_sheets(sensors: Sequence[SensorSpec]) -> list[Property]:
    """Return the sensors as devices: range, size, mass, interface, power, availability."""
    return _properties(sensors, {name.replace("_", " "): partial(_of_device, name=name) for name in OF_DEVICES})


def readings(sensors: Sequence[SensorSpec]) -> list[Property]:
    """Return what the specs state of readings: clocks, delay, range of a converter."""
    return _properties(sensors, {"streams": _streams, "delay of a reading": _delay, "taxel reading": _reading})


def quantities(sensors: Sequence[SensorSpec]) -> list[Property]:
    """Return every quantity that the specs state: skin, parameters, noise, nuisances."""
    tables = list(map(_quantities, sensors))
    titles = dict.fromkeys(title for table in tables for title in table)
    rows = ((title, [table.get(title) for table in tables]) for title in titles)
    return [Property(title, tuple(_fact(one, one.source if one else None) for one in row)) for title, row in rows]


def sensor_table(
    title: str, sensors: Sequence[SensorSpec], properties: Iterable[Property], *, with_source: bool
) -> TextTable:
    """Return properties as a table with a column for each sensor, and one for its sources if wanted."""
    columns = [name for one in sensors for name in (one.title, *([f"{one.title}: source"] if with_source else []))]
    lines = []
    for row in properties:
        line = [row.title]
        for fact in row.facts:
            source = ": ".join(filter(None, (fact.tag, fact.reference)))
            line += [fact.text, source] if with_source else [fact.text]
        lines.append(tuple(line))
    return TextTable(title, ("", *columns), tuple(lines))


def _properties(sensors: Sequence[SensorSpec], looks: Mapping[str, Callable[[SensorSpec], Fact]]) -> list[Property]:
    return [Property(title, tuple(map(look, sensors))) for title, look in looks.items()]


def _fact(stated: object, source: Source | None = None) -> Fact:
    text = ABSENT if stated is None else str(stated)
    return Fact(text, source.tag, source.reference) if source else Fact(text)


def _range(sensor: SensorSpec, kind: ChannelKind, which: str) -> Fact:
    found = next((one for one in (getattr(channel, which) for channel in sensor.channels(kind)) if one), None)
    return _fact(found, found.source if found else None)


def _number_of_taxels(sensor: SensorSpec) -> Fact:
    sites, channels = len(sensor.sites("taxel")), len(sensor.channels("taxel"))
    return Fact(str(sites) if sites == channels else f"{sites}, of {channels} channels")


def _of_device(sensor: SensorSpec, name: str) -> Fact:
    stated = getattr(sensor.data_sheet, name)
    if stated is None:
        return Fact(UNKNOWN if sensor.data_sheet.exists else ABSENT)
    return _fact(stated.text if isinstance(stated, Statement) else stated, stated.source)


def _streams(sensor: SensorSpec) -> Fact:
    parts = []
    for stream in sensor.streams:
        rate = f"{stream.rate_hz:g} Hz" if stream.rate_hz else "rate not stated"
        parts.append(f"{stream.name}: {len(stream.channels)} ch., {rate}")
    return _fact("; ".join(parts), sensor.streams[0].rate_source)


def _delay(sensor: SensorSpec) -> Fact:
    """Return the parts of an answer's delay that are the sensor's own: an interval of each stream, and the link."""
    parts = [f"{stream.name} {1e3 / stream.rate_hz:.3g} ms" for stream in sensor.streams if stream.rate_hz]
    sampling = f"sampling interval {', '.join(parts) or 'not stated'}"
    link = sensor.link_delay
    return _fact(f"{sampling}; link {link or 'not stated'}", link.source if link else None)


def _reading(sensor: SensorSpec) -> Fact:
    for one in sensor.channels("taxel"):  # they are alike
        return Fact(one.unit if one.lower is None or one.upper is None else f"{one.lower:g}–{one.upper:g} {one.unit}")
    return Fact(ABSENT)


def _quantities(sensor: SensorSpec) -> dict[str, Quantity]:
    found: dict[str, Quantity] = {}
    if sensor.link_delay is not None:
        found["link delay"] = sensor.link_delay
    if sensor.skin is not None:
        found.update(_named("skin", sensor.skin))
    found.update({name.replace("_", " "): quantity for name, quantity in sensor.parameters.items()})
    usual = sensor.settable()
    found.update(usual)
    for scenario in sensor.scenarios:
        other = sensor.handled(scenario).settable()
        found.update((f"{name}, {scenario}", amount) for name, amount in other.items() if usual.get(name) != amount)
    return found


def _named(prefix: str, model: object) -> Iterable[tuple[str, Quantity]]:
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
