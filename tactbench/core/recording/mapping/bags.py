"""Reader of MCAP bags, as ROS 2 and Foxglove write them; it needs the extra ``[mcap]``."""

from __future__ import annotations

import json
import struct
from array import array
from collections.abc import Callable, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.mapping.formats import extra, whole
from tactbench.core.recording.mapping.model import Bag, Column, Time
from tactbench.core.recording.mapping.table import Table, Used, nanoseconds_per

MESSAGE_TIMES = ("log_time", "publish_time")
"""Columns that every message has beside its fields: when it was written and when it was sent, in nanoseconds."""

Topic = tuple[Bag, Used, Time | None]
"""A topic with its columns that are used, and its clock."""


def read_bag(path: Path, shown: str, topics: Mapping[str, Topic]) -> dict[str, Table]:
    """Return tables by their name, of topics that are read in one pass of a bag.

    Raises
    ------
    MappingError
        If the extra is missing, the bag is damaged or cut short or has no such topic, messages lack a field, or the
        mapping gives another unit for a time in nanoseconds.
    """
    values: dict[str, dict[Column, Any]] = {
        name: {column: array("d") if is_reading else [] for column, is_reading in used.items()}
        for name, (_, used, _) in topics.items()
    }
    counts = dict.fromkeys(topics, 0)
    decoders: dict[int, tuple[list[str], Any]] = {}
    schemas: dict[int, Any] = {}
    seen: set[str] = set()
    stream, ros = extra("mcap", shown, "mcap.stream_reader", "mcap_ros2.decoder")
    damaged = whole(
        shown, "bag", "A recorder that was killed leaves such a bag: `mcap recover` keeps what can be read."
    )
    with damaged, path.open("rb") as opened:
        # The records end at the bag's footer alone: a bag that was cut short has none.
        for record in stream.StreamReader(opened, validate_crcs=True).records:
            kind = type(record).__name__
            if kind == "Message":
                names, decode = decoders.get(record.channel_id, ((), None))
                for name in names:
                    _take(record, decode, topics[name], values[name], f"{shown}, message {counts[name]} of {name}")
                    counts[name] += 1
            elif kind == "Schema":
                schemas[record.id] = record
            elif kind == "Channel" and record.id not in decoders:
                seen.add(record.topic)
                names = [name for name, (how, *_) in topics.items() if how.topic == record.topic]
                decoders[record.id] = names, names and _decoder(ros, record, schemas.get(record.schema_id), shown)
    tables = {}
    for name, (how, used, time) in topics.items():
        topic = how.topic
        if not counts[name]:
            hint = f"{did_you_mean(topic, seen - {topic})}It has: {', '.join(sorted(seen))}."
            raise MappingError(f"{shown} has no message of topic {topic!r}.", hint=hint)
        if time is not None and isinstance(values[name][time.column][0], int) and nanoseconds_per(time) != 1:
            raise MappingError(
                f"{shown} {topic}: {time.column} is in nanoseconds.", hint="Write `unit: ns` under `time`."
            )
        tables[name] = Table(f"{shown} {topic}", tuple(used), range(counts[name]), values[name], ", message ")
    return tables


def _decoder(ros: Any, channel: Any, schema: Any, shown: str) -> Callable[[bytes], Any]:
    """Return the decoder of a topic's messages; raises MappingError for an encoding that cannot be read."""
    if channel.message_encoding == "json":
        return json.loads
    found: Callable[[bytes], Any] | None = ros.DecoderFactory().decoder_for(channel.message_encoding, schema)
    if found is None:
        raise MappingError(
            f"{shown}: topic {channel.topic!r} is encoded as {channel.message_encoding} "
            f"({schema.encoding if schema else 'no schema'}).",
            hint="ROS 2 messages (cdr, ros2msg) and JSON are read; `rosbags-convert` makes ROS 2 of ROS 1.",
        )
    return found


def _take(record: Any, decode: Any, topic: Topic, values: dict[Column, Any], where: str) -> None:
    """Add the columns of one message to `values`."""
    column: Column | None = None
    try:
        message = decode(record.data)
        for column, is_reading in topic[1].items():
            value = getattr(record, str(column)) if column in MESSAGE_TIMES else _field(message, str(column))
            if topic[2] is not None and column == topic[2].column:
                value = _stamp(value)
            values[column].append(float(value) if is_reading else value)
    except (AttributeError, KeyError, IndexError, TypeError, ValueError, struct.error) as error:
        what = "cannot be decoded" if column is None else f"has no {column!r} of the kind that the mapping expects"
        raise MappingError(
            f"{where} {what} ({type(error).__name__}: {error}).",
            hint="Fields are named by their path: header.stamp, wrench.force.z, data.0; or log_time.",
        ) from error


def _field(message: Any, path: str) -> Any:
    """Return the value at a path like ``data.0``: of fields of ROS 2 messages, keys of JSON and places in arrays."""
    for part in path.split("."):
        if part.isdecimal():
            message = message[int(part)]
        else:
            message = message[part] if isinstance(message, dict) else getattr(message, part)
    return message


def _stamp(value: Any) -> Any:
    """Return a stamp in whole nanoseconds, `builtin_interfaces/Time` in either spelling, or the number that it is."""
    if isinstance(value, int | float):
        return value if isinstance(value, float) else Decimal(value)
    fields = value if isinstance(value, dict) else {name: getattr(value, name) for name in value.__slots__}
    return int(fields["sec"]) * 10**9 + int(fields["nanosec"] if "nanosec" in fields else fields["nsec"])
