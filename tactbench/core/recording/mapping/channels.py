"""Channels from the groups of columns in a mapping file, with ranges and name patterns expanded."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from pydantic import ValidationError

from tactbench.core.errors import MappingError, complaint
from tactbench.core.recording.mapping.model import ChannelGroup, Column, StreamSource
from tactbench.core.recording.mapping.model import Mapping as MappingFile
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec, StreamSpec

_RANGE = re.compile(r"^(?P<before>.*?)(?P<first>\d+)\.\.(?P<last>\d+)$")
_WORD = re.compile(r"\{([^{}]*)\}")


@dataclass(frozen=True)
class MappedChannel:
    """A channel, the column that it is read from, and the group with the rules for reading it."""

    spec: ChannelSpec
    column: Column
    group: ChannelGroup


@dataclass(frozen=True)
class MappedStream:
    """A stream, and the columns that its channels are read from."""

    spec: StreamSpec
    source: StreamSource
    channels: tuple[MappedChannel, ...]


def fill(pattern: str, words: Mapping[str, Scalar], what: str) -> str:
    """Return `pattern` with each ``{word}`` replaced by its value; raises MappingError for an unknown word."""

    def word(match: re.Match[str]) -> str:
        name = match.group(1)
        if name not in words:
            raise MappingError(
                f"{what}: {pattern!r} has the unknown word {name!r}; known words: "
                f"{', '.join(sorted(words)) or 'none'}.",
                hint="Words come from named groups of `path`, from `split_by`, `per_recording`, `words` and `over`.",
            )
        return str(words[name])

    return _WORD.sub(word, pattern)


def no_translation(where: str, text: str, word: str, known: Mapping[str, str]) -> MappingError:
    """Return the error for a text that is not among the `known` translations of a word or label."""
    return MappingError(
        f"{where} {text!r} has no translation for {word!r}; translated are: {', '.join(known)}.",
        hint="Add the text to `values`; translate texts that mean 'no label' to an empty text.",
    )


def expand(text: Scalar) -> Iterator[Scalar]:
    """Yield the members of a range: ``1..3`` gives 1, 2, 3; ``e_1..3`` gives e_1, e_2, e_3; other text is unchanged."""
    match = _RANGE.match(text) if isinstance(text, str) else None
    if match is None:
        yield text
        return
    before, first, last = match["before"], int(match["first"]), int(match["last"])
    if last < first:
        raise MappingError(f"The range {text!r} runs backwards.", hint="Write the smaller number first.")
    for number in range(first, last + 1):
        yield f"{before}{number}" if before else number


def sensor_of(mapping: MappingFile) -> tuple[SensorSpec, dict[str, MappedStream]]:
    """Return the sensor, and all streams with their columns; ``{word}`` in the sensor's name is not replaced yet.

    Raises MappingError if names collide, or columns and names differ in number.
    """
    streams: dict[str, MappedStream] = {}
    try:
        for name, source in mapping.streams.items():
            channels = tuple(channel for group in source.channels for channel in _channels(name, group))
            spec = StreamSpec(
                name=name, rate_hz=source.rate_hz, rate_source=source.rate_source, dtype=source.dtype,
                channels=tuple(channel.spec for channel in channels),
            )  # fmt: skip
            streams[name] = MappedStream(spec, source, channels)
        described = mapping.sensor.model_dump()
        sensor = SensorSpec(
            **described | {"name": _WORD.sub("x", described["name"])},  # until its words are known
            streams=tuple(stream.spec for stream in streams.values() if stream.source.of == "sensor"),
        )
    except ValidationError as error:
        raise MappingError(
            f"The sensor of the mapping is not valid: {complaint(error)}.", hint="Correct its streams and channels."
        ) from error
    return sensor, streams


def columns_of(group: ChannelGroup) -> list[Column]:
    """Return the columns of a group, with ranges like ``1..3`` expanded."""
    given = group.columns if isinstance(group.columns, tuple) else (group.columns,)
    return [one if isinstance(one, int) else str(one) for text in given for one in expand(text)]


def _channels(stream: str, group: ChannelGroup) -> Iterator[MappedChannel]:
    columns = columns_of(group)
    ways = [[*expand(values)] if isinstance(values, str) else values for values in group.over.values()]
    combinations = [*itertools.product(*ways)] if ways else [()] * len(columns)
    if len(combinations) != len(columns):
        raise MappingError(
            f"Stream {stream}: {len(columns)} columns, but `over` makes {len(combinations)} names.",
            hint="Correct `columns` or `over`.",
        )
    rest = {"value": group.rest, "unit": group.unit, "source": group.rest_source}
    shared = {
        **group.model_dump(include={"kind", "unit", "lower", "upper", "sign"}),
        "rest": None if group.rest is None else rest,
    }
    for column, values in zip(columns, combinations, strict=True):
        words = {"column": column, **dict(zip(group.over, values, strict=True))}
        name = fill(group.name, words, f"stream {stream}")
        yield MappedChannel(ChannelSpec.model_validate({**shared, "name": name}), column, group)
