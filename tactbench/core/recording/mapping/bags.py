"""Reading topics of MCAP bags, as ROS 2 and Foxglove write them, into tables; the extra ``[mcap]``."""

from __future__ import annotations

import importlib
import json
import struct
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.mapping.model import Column
from tactbench.core.recording.mapping.table import MESSAGE_TIMES, ColumnTable, plain


@dataclass(frozen=True)
class Topic:
    """What the mapping uses of a table, and the topic that the table is in a bag."""

    name: str
    numbers: tuple[Column, ...]
    texts: tuple[Column, ...]
    time: Column | None

    @property
    def columns(self) -> tuple[Column, ...]:
        """All columns that are used, each once."""
        return tuple(dict.fromkeys((*self.numbers, *self.texts, *([] if self.time is None else [self.time]))))


def read_bag(path: Path, shown: str, topics: Mapping[str, Topic]) -> dict[str, ColumnTable]:
    """Read topics of one bag in one pass, by the name of their table.

    Raises
    ------
    MappingError
        If the extra is missing, the bag is damaged or cut short, has no such topic, or messages lack a field.
    """
    tables = {name: ColumnTable(f"{shown} {topic.name}") for name, topic in topics.items()}
    takers: dict[int, list[Callable[[Any], None]]] = {}
    schemas: dict[int, Any] = {}
    seen: set[str] = set()
    for record in _records(path, shown):
        kind = type(record).__name__
        if kind == "Message":
            for take in takers.get(record.channel_id, ()):
                take(record)
        elif kind == "Schema":
            schemas[record.id] = record
        elif kind == "Channel" and record.id not in takers:
            seen.add(record.topic)
            asked = [name for name, topic in topics.items() if topic.name == record.topic]
            decode = _decoder(record, schemas.get(record.schema_id), shown) if asked else None
            takers[record.id] = [_taker(tables[name], topics[name], decode) for name in asked]
    for name, topic in topics.items():
        if not len(tables[name]):
            hint = f"{did_you_mean(topic.name, seen - {topic.name})}It has: {', '.join(sorted(seen))}."
            raise MappingError(f"{shown} has no message of topic {topic.name!r}.", hint=hint)
    return tables


def _records(path: Path, shown: str) -> Iterator[Any]:
    try:
        stream: Any = importlib.import_module("mcap.stream_reader")
    except ModuleNotFoundError as error:
        raise MappingError(f"{shown} is a bag.", hint="Install the extra: pip install 'tactbench[mcap]'.") from error
    with path.open("rb") as opened:
        records = iter(stream.StreamReader(opened, validate_crcs=True).records)
        while True:
            try:
                record = next(records)  # ends at the bag's footer alone: one that was cut short has none
            except StopIteration:
                return
            except Exception as error:  # whatever a damaged file makes of the library
                raise MappingError(
                    f"{shown} is no whole bag: {type(error).__name__}{f': {error}' if str(error) else ''}.",
                    hint="A recorder that was killed leaves such a bag: `mcap recover` keeps what can be read.",
                ) from error
            yield record


def _decoder(channel: Any, schema: Any, shown: str) -> Callable[[bytes], Any]:
    """Return what turns the bytes of a message into fields; raises MappingError for an encoding that is not read."""
    if channel.message_encoding == "json":
        return json.loads
    ros: Any = importlib.import_module("mcap_ros2.decoder")
    found: Callable[[bytes], Any] | None = ros.DecoderFactory().decoder_for(channel.message_encoding, schema)
    if found is None:
        raise MappingError(
            f"{shown}: topic {channel.topic!r} is encoded as {channel.message_encoding} "
            f"({schema.encoding if schema else 'no schema'}).",
            hint="ROS 2 messages (cdr, ros2msg) and JSON are read; `rosbags-convert` makes ROS 2 of ROS 1.",
        )
    return found


def _taker(table: ColumnTable, topic: Topic, decode: Any) -> Callable[[Any], None]:
    """Return what adds one message to `table`."""
    numbers = [(table.found.setdefault(column, array("d")), _path(column), column) for column in topic.numbers]
    texts = [(table.words.setdefault(column, []), _path(column), column) for column in topic.texts]
    time = topic.time
    time_path = () if time is None or time in MESSAGE_TIMES else _path(time)

    def take(record: Any) -> None:
        table.rows.append(len(table.rows))
        column: Column | None = None
        try:
            message = decode(record.data)
            for column_values, path, column in numbers:  # noqa: B007  (named where it fails)
                column_values.append(float(_field(message, path)))
            for column_texts, path, column in texts:  # noqa: B007
                column_texts.append(plain(_field(message, path)))
            if time is not None:
                column = time
                table.stamps.append(_stamp(_field(message, time_path)) if time_path else getattr(record, str(time)))
        except (AttributeError, KeyError, IndexError, TypeError, ValueError, struct.error) as error:
            what = "cannot be decoded" if column is None else f"has no {column!r} of the kind that is asked for"
            raise MappingError(
                f"{table.where(-1)} {what} ({type(error).__name__}: {error}).",
                hint="Fields are named by their path: header.stamp, wrench.force.z, data.0; or log_time.",
            ) from error

    return take


def _path(column: Column) -> tuple[str | int, ...]:
    return tuple(int(part) if part.isdecimal() else part for part in str(column).split("."))


def _field(message: Any, path: tuple[str | int, ...]) -> Any:
    """Return what lies at a path: fields of ROS 2 messages, keys of JSON, places in arrays."""
    for part in path:
        message = message[part] if isinstance(part, int) or isinstance(message, dict) else getattr(message, part)
    return message


def _stamp(value: Any) -> Any:
    """Return a stamp in whole nanoseconds, `builtin_interfaces/Time` in either spelling, or the number that it is."""
    if isinstance(value, int | float):
        return value if isinstance(value, float) else Decimal(value)
    fields = value if isinstance(value, dict) else {name: getattr(value, name) for name in value.__slots__}
    return int(fields["sec"]) * 10**9 + int(fields["nanosec"] if "nanosec" in fields else fields["nsec"])
