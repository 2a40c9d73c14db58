"""Find a task's channels in a recording and put them on one clock: samples are looked up, never interpolated."""

from __future__ import annotations

import numpy as np

from tactbench.core.errors import DataError, NotApplicable, UsageError
from tactbench.core.recording.reader import Recording
from tactbench.core.samples import FloatArray, IntArray, Quality, StreamData
from tactbench.core.spec import units
from tactbench.core.spec.sensor import ChannelSpec
from tactbench.core.spec.task import ChannelTarget, TaskSpec

_WORDS = {
    "taxel": "taxel", "dc_pressure": "static pressure", "ac_pressure": "vibration",
    "dc_temperature": "temperature", "ac_temperature": "heat flow",
}  # fmt: skip
"""Readers' words for the kinds of channels."""


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


def numbers(data: StreamData) -> FloatArray:
    """Return the samples as float64, with NaN where there is none."""
    numbers = data.data.astype(np.float64)
    if data.quality is not None:
        numbers[(data.quality & Quality.MISSING) != 0] = np.nan
    numbers[~np.isfinite(numbers)] = np.nan
    return numbers


Found = tuple[str, int, ChannelSpec]
"""Stream, column in it, and the channel."""


def channel_on(recording: Recording, target: ChannelTarget, clock: StreamData) -> FloatArray:
    """Return a channel on the clock of a stream, in the unit of `target`; all NaN if there is none."""
    found = channels_for(recording, target)
    if not found:
        return np.full(len(clock.data), np.nan)
    if len(found) > 1:
        names = ", ".join(channel.name for _, _, channel in found)
        raise DataError(
            f"The recording {recording.meta.name!r} has several {target.kind} channels: {names}.",
            hint="Name one in the task's target.",
        )
    return read_channel(recording, clock, found[0]) * unit_factor(found[0][2], target.unit)


def channels_for(recording: Recording, target: ChannelTarget) -> list[Found]:
    """Return the channels that could be meant; of several the one called ``normal``, else the one called ``fz``.

    One called ``shear`` must be named by the task: it is a force, but not the one that presses.
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


def read_channel(recording: Recording, clock: StreamData, found: Found) -> FloatArray:
    """Return (n,) samples of a channel on the clock of a stream, as recorded; NaN where there is none."""
    name, place, _ = found
    data = clock if name == clock.spec.name else recording.read(name)
    return on_clock(numbers(data)[:, [place]], data, clock, recording.meta.name)[:, 0]


def on_clock(values: FloatArray, stream: StreamData, clock: StreamData, recording: str) -> FloatArray:
    """Return (n, q) of (m, q) values of a stream on the clock of another; NaN where it has no sample."""
    if stream is clock:
        return values
    rows = nearest_rows(clock, stream, recording)
    out = np.full((len(rows), values.shape[1]), np.nan)
    out[rows >= 0] = values[rows[rows >= 0]]
    return out


def never_meeting(recording: Recording, target: ChannelTarget, clock: StreamData) -> str:
    """Return the spans of `clock` and of a channel with samples, none of which is near; empty where that is not so."""
    found = channels_for(recording, target)
    if len(found) != 1:
        return ""
    name, place, channel = found[0]
    other = recording.read(name)
    if clock.t_ns is None or other.t_ns is None or np.isnan(numbers(other)[:, place]).all():
        return ""
    (start, end), (first, last) = (times[[0, -1]] / 1e9 for times in (clock.t_ns, other.t_ns))
    later = first - start
    return (
        f"{clock.spec.name} runs from {start:.3f} to {end:.3f} s, and {channel.name} from {first:.3f} to {last:.3f} s: "
        f"it begins {abs(later):.3f} s {'later' if later > 0 else 'earlier'}"
    )


def unit_factor(channel: ChannelSpec, unit: str) -> float:
    """Return the factor from stored numbers to `unit`: by the channel's unit, else by its scale."""
    try:
        return units.conversion(channel.unit, unit)
    except UsageError:
        if channel.scale is not None:
            return channel.scale.to(unit)
        raise DataError(
            f"The channel {channel.name!r} is recorded in {channel.unit!r}, which is no {unit!r}.",
            hint="State its unit or its scale in the mapping.",
        ) from None


def require_forward(data: StreamData, recording: str) -> None:
    """Raise DataError if time runs backwards in a stream, or stands still: nothing can be aligned or filtered then."""
    if data.t_ns is None or len(data.t_ns) < 2:
        return
    steps = np.diff(data.t_ns)
    backward = int((steps < 0).sum())
    if backward or not steps.any():
        what = f"runs backwards {backward} times" if backward else "stands still"
        raise DataError(
            f"In recording {recording!r}, the time of {data.spec.name} {what}.",
            hint="See where with `tactbench inspect`. Rows of a counter that begins at 0 again are imported with "
            "`wraps_at` under `time`; sort others before they are imported.",
        )


def nearest_rows(features: StreamData, other: StreamData, recording: str) -> IntArray:
    """Return (n,) which row of `other` belongs to each row of `features`.

    It is the nearest in time; -1 where that is further away than half a median step of the slower clock. Without a
    clock, rows belong together if they are equally many.
    """
    n, m = len(features.data), len(other.data)
    if features.t_ns is None or other.t_ns is None:
        if n != m:
            raise DataError(
                f"In recording {recording!r}, {features.spec.name} has {n} rows and {other.spec.name} {m}, and there "
                "is no clock to align them by.",
                hint="Give the mapping a time column, or tables of equal length.",
            )
        return np.arange(n, dtype=np.int64)
    if n == m and np.array_equal(features.t_ns, other.t_ns):
        return np.arange(n, dtype=np.int64)
    if m == 0:
        return np.full(n, -1, dtype=np.int64)
    require_forward(other, recording)
    times = other.t_ns
    after = np.clip(np.searchsorted(times, features.t_ns), 0, m - 1)
    before = np.maximum(after - 1, 0)
    earlier = np.abs(features.t_ns - times[before]) <= np.abs(times[after] - features.t_ns)
    nearest = np.where(earlier, before, after)
    steps = [float(np.median(np.diff(t))) for t in (features.t_ns, times) if len(t) > 1]
    reach = max(steps, default=0.0) / 2
    near = np.abs(times[nearest] - features.t_ns) <= reach
    return np.where(near, nearest, -1).astype(np.int64)
