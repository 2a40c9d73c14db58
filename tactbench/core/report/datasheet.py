"""Comparison of sensors: rows as in the paper's Table I, data sheets and parameters, with their sources."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from tactbench.core.spec.quantity import Quantity, Source
from tactbench.core.spec.sensor import ChannelKind, PhysicalRange, SensorSpec, Statement
from tactbench.core.spec.skin import SheetTable
from tactbench.core.tables.text_table import TextTable

ABSENT = "-"
UNKNOWN = "unknown"
"""Text for a property, such as the mass of a device, that no source states."""
OF_DEVICES = ("force_range", "length", "width", "height", "mass", "interface", "power", "availability")
"""Fields of a sensor's data sheet, in the order of the table."""

# Rows of Table I of Karl et al. 2016: title, kind of channel, and whether its range or its band is meant.
_TABLE_ONE: tuple[tuple[str, ChannelKind, str], ...] = (
    ("DC Pressure Range", "dc_pressure", "measures"),
    ("DC Temp. Range", "dc_temperature", "measures"),
    ("AC Pressure spectrum", "ac_pressure", "band"),
    ("AC Temp. spectrum", "ac_temperature", "band"),
)


class Fact(NamedTuple):
    """One field of a comparison of sensors: a text, with the tag and the reference of its source."""

    text: str
    tag: str = ""
    reference: str = ""


Comparison = dict[str, list[Fact]]
"""Rows of a comparison of sensors by title, with one fact for each sensor."""


def table_one(sensors: Sequence[SensorSpec]) -> Comparison:
    """Return the rows of the paper's Table I (taxels, principle, ranges and bandwidths) for `sensors`."""
    found = {
        "# taxels": list(map(_number_of_taxels, sensors)),
        "measurement principle": [_fact(sensor.principle, sensor.principle_source) for sensor in sensors],
    }
    return found | {title: [_range(one, kind, which) for one in sensors] for title, kind, which in _TABLE_ONE}


def data_sheets(sensors: Sequence[SensorSpec]) -> Comparison:
    """Return the properties of the sensors as devices: force range, size, mass, interface, power, availability."""
    return {name.replace("_", " "): [_of_device(sensor, name) for sensor in sensors] for name in OF_DEVICES}


def readings(sensors: Sequence[SensorSpec]) -> Comparison:
    """Return the properties of the sensors' readings: streams with their rates, delay, range of the converter."""
    rows = {"streams": _streams, "delay of a reading": _delay, "taxel reading": _reading}
    return {title: list(map(row, sensors)) for title, row in rows.items()}


def quantities(sensors: Sequence[SensorSpec]) -> Comparison:
    """Return every quantity that the sensors' specs state: skin, parameters, noise, nuisances."""
    tables = list(map(_quantities, sensors))
    titles = dict.fromkeys(title for table in tables for title in table)
    return {title: [_sourced(table.get(title)) for table in tables] for title in titles}


def sensor_table(title: str, sensors: Sequence[SensorSpec], rows: Comparison, *, with_source: bool) -> TextTable:
    """Return a comparison as a table with a column for each sensor, and a column for its sources if `with_source`."""
    columns = [name for one in sensors for name in (one.title, *([f"{one.title}: source"] if with_source else []))]
    lines = []
    for name, facts in rows.items():
        line = [name]
        for fact in facts:
            source = ": ".join(filter(None, (fact.tag, fact.reference)))
            line += [fact.text, source] if with_source else [fact.text]
        lines.append(tuple(line))
    return TextTable(title, ("", *columns), tuple(lines))


def _fact(stated: object, source: Source | None = None) -> Fact:
    text = ABSENT if stated is None else str(stated)
    return Fact(text, source.tag, source.reference) if source else Fact(text)


def _sourced(stated: Quantity | PhysicalRange | None) -> Fact:
    return _fact(stated, stated.source if stated else None)


def _range(sensor: SensorSpec, kind: ChannelKind, which: str) -> Fact:
    return _sourced(next((one for one in (getattr(channel, which) for channel in sensor.channels(kind)) if one), None))


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
    """Return the parts of an answer's delay due to the sensor: sampling interval of each stream, and link delay."""
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
