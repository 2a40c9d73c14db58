"""Finds a task's channels in a recording and reads them on the clock of its features."""

from __future__ import annotations

from collections import Counter

import numpy as np

from tactbench.core.errors import DataError, NotApplicable, UsageError
from tactbench.core.evaluation.alignment import nearest_rows
from tactbench.core.recording.reader import Recording
from tactbench.core.samples import FloatArray, Quality, StreamData, StreamReadings
from tactbench.core.spec import units
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import ChannelSpec
from tactbench.core.spec.task import ChannelTarget, TaskSpec

_WORDS = {
    "taxel": "taxel", "dc_pressure": "static pressure", "ac_pressure": "vibration",
    "dc_temperature": "temperature", "ac_temperature": "heat flow",
}  # fmt: skip
"""How a reader calls what a kind of channel measures."""


def feature_streams(recording: Recording, task: TaskSpec) -> list[str]:
    """Return the sensor's streams that carry features; the first one's clock is that of the table."""
    meta = recording.meta
    own = {stream.name for stream in meta.sensor.streams}
    kinds = {
        name: {channel.kind for channel in recording.stream(name).spec.channels}
        for name in recording.stream_names
        if name in own
    }
    for kind in task.features:
        if not any(kind in there for there in kinds.values()):
            raise NotApplicable(
                f"Task {task.name!r} needs a {_WORDS.get(kind, kind)} stream; {meta.sensor.name} has none in "
                f"{meta.name!r}.",
                hint="See what the sensor has with `tactbench show`.",
            )
    return [name for name, there in kinds.items() if there & set(task.looks_at)]


def features_on(
    meta: RecordingMeta, clock: StreamData, stream: StreamData, task: TaskSpec, counts: Counter[str]
) -> tuple[list[str], FloatArray]:
    """Return names and (n, q) readings of one stream's features on the clock of another; NaN where there is none."""
    picked = [place for place, channel in enumerate(stream.spec.channels) if channel.kind in task.looks_at]
    names = [stream.spec.channels[place].name for place in picked]
    readings = numbers(stream)[:, picked]
    if stream.quality is not None:
        for flag in (Quality.SATURATED, Quality.SUSPECT):
            flagged = int(np.count_nonzero(stream.quality[:, picked] & flag))
            if flagged:
                counts[f"{str(flag.name).lower()} samples kept"] += flagged
        after_gap = int(np.count_nonzero((stream.quality[:, picked] & Quality.GAP).any(axis=1)))
        if after_gap:
            counts[f"rows of {stream.spec.name} kept, before which others were lost"] += after_gap
    if stream is clock:
        return names, readings
    rows = nearest_rows(clock, stream, meta.name)
    if not len(readings):
        return names, np.full((len(rows), len(picked)), np.nan)
    return names, np.where((rows >= 0)[:, None], readings[np.maximum(rows, 0)], np.nan)


def own_readings(clock: StreamData, stream: StreamData, task: TaskSpec, counts: Counter[str]) -> StreamReadings:
    """Return one stream's features on its own clock, in seconds since the first row of `clock`."""
    picked = [place for place, channel in enumerate(stream.spec.channels) if channel.kind in task.looks_at]
    data = numbers(stream)[:, picked]
    whole = np.asarray(~np.isnan(data).any(axis=1))
    if stream is not clock and not whole.all():
        counts[f"rows of {stream.spec.name} left out because a channel has no sample"] += int((~whole).sum())
    time_s = (stream.t_ns - clock.t_ns[0]) * 1e-9 if stream.t_ns is not None and clock.t_ns is not None else None
    steps = np.diff(time_s) if time_s is not None else np.zeros(0)
    step_s = float(np.median(steps)) if len(steps) else 0.0
    channels = [stream.spec.channels[place] for place in picked]
    return StreamReadings(
        stream=stream.spec.name,
        channels=tuple(channel.name for channel in channels),
        kinds=tuple(channel.kind for channel in channels),
        data=data[whole],
        time_s=None if time_s is None else time_s[whole],
        rate_hz=1.0 / step_s if step_s > 0 else stream.spec.rate_hz,
    )


def numbers(data: StreamData) -> FloatArray:
    """Return the samples as float64, with NaN where there is none."""
    numbers = data.data.astype(np.float64)
    if data.quality is not None:
        numbers[(data.quality & Quality.MISSING) != 0] = np.nan
    numbers[~np.isfinite(numbers)] = np.nan
    return numbers


def channel_on(recording: Recording, target: ChannelTarget, features: StreamData) -> FloatArray | None:
    """Return a channel on the clock of the features, in the unit of `target`; None if there is none."""
    found = channels_for(recording, target)
    if not found:
        return None
    if len(found) > 1:
        names = ", ".join(channel.name for _, _, channel in found)
        raise DataError(
            f"The recording {recording.meta.name!r} has several {target.kind} channels: {names}.",
            hint="Name one in the task's target.",
        )
    return on_clock(recording, features, *found[0]) * unit_factor(found[0][2], target.unit)


Found = tuple[str, int, ChannelSpec]
"""Stream, place in it, and what is there."""


def channels_for(recording: Recording, target: ChannelTarget) -> list[Found]:
    """Return the channels that could be meant; of several the one called ``normal``, else the one called ``fz``.

    One called ``shear`` must be asked for by name: it is a force, but not the one that presses.
    """
    found = [
        (name, place, channel)
        for name in recording.stream_names
        for place, channel in enumerate(recording.stream(name).spec.channels)
        if channel.kind == target.kind
        and (channel.name == target.name or (target.name is None and channel.name != "shear"))
    ]
    for name in ("normal", "fz"):
        plain = [one for one in found if one[2].name == name]
        if plain:
            return plain if len(plain) == 1 else found
    return found


def on_clock(recording: Recording, features: StreamData, name: str, place: int, channel: ChannelSpec) -> FloatArray:
    """Return (n,) samples of a channel on the clock of the features, as recorded; NaN where there is none."""
    data = features if name == features.spec.name else recording.read(name)
    column = numbers(data)[:, place]
    picked = nearest_rows(features, data, recording.meta.name)
    aligned = np.full(len(features.data), np.nan)
    aligned[picked >= 0] = column[picked[picked >= 0]]
    return aligned


def unit_factor(channel: ChannelSpec, unit: str) -> float:
    """Return what turns stored numbers into `unit`: by the channel's unit, or by its scale if that does not tell."""
    try:
        return units.conversion(channel.unit, unit)
    except UsageError:
        if channel.scale is not None:
            return channel.scale.to(unit)
        raise DataError(
            f"The channel {channel.name!r} is recorded in {channel.unit!r}, which is no {unit!r}.",
            hint="State its unit or its scale in the mapping.",
        ) from None
