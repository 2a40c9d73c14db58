"""Find a task's channels in a recording, and the slip that its reference sensors of force and position measured.

Channels are put on one clock by taking nearest samples, without interpolation.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable, UsageError
from tactbench.core.events.alarms import GroundTruth
from tactbench.core.events.labels import UNDECIDED, SlipLabels, slip_labels
from tactbench.core.recording.reader import Recording
from tactbench.core.samples import FloatArray, IntArray, Quality, StreamData
from tactbench.core.spec import units
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.sensor import ChannelSpec
from tactbench.core.spec.task import ChannelTarget, TaskSpec

_WORDS = {
    "taxel": "taxel", "dc_pressure": "static pressure", "ac_pressure": "vibration",
    "dc_temperature": "temperature", "ac_temperature": "heat flow",
}  # fmt: skip
"""Words for kinds of channels, for messages to the user."""


def feature_streams(recording: Recording, task: TaskSpec) -> list[str]:
    """Return names of the sensor's streams with features for `task`; a table's rows are the first stream's samples."""
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
                f"Task {task.name!r} needs a {_WORDS.get(kind, kind)} stream; {meta.sensor.name} has no such stream in "
                f"recording {meta.name!r}.",
                hint="List the sensor's streams with `tactbench show`.",
            )
    return [name for name, there in kinds.items() if there & set(task.looks_at)]


def numbers(data: StreamData) -> FloatArray:
    """Return the (n, channels) samples of a stream as float64; NaN for missing or infinite samples."""
    numbers = data.data.astype(np.float64)
    if data.quality is not None:
        numbers[(data.quality & Quality.MISSING) != 0] = np.nan
    numbers[~np.isfinite(numbers)] = np.nan
    return numbers


Found = tuple[str, int, ChannelSpec]
"""Name of a stream, index of a column in the stream, and the channel in that column."""


def channel_on(recording: Recording, target: ChannelTarget, clock: StreamData) -> FloatArray:
    """Return the (n,) samples of the target channel at the times of `clock`, in the target's unit; NaN if absent."""
    found = channels_for(recording, target)
    if not found:
        return np.full(len(clock.data), np.nan)
    if len(found) > 1:
        names = ", ".join(channel.name for _, _, channel in found)
        raise DataError(
            f"The recording {recording.meta.name!r} has several {target.kind} channels: {names}.",
            hint="Name one of these channels in the task's target.",
        )
    return read_channel(recording, clock, found[0]) * unit_factor(found[0][2], target.unit)


def channels_for(recording: Recording, target: ChannelTarget) -> list[Found]:
    """Return the channels that match `target`; of several, only that called ``normal``, or else ``fz``, if present.

    A channel called ``shear`` is returned only if the task names it, since it is not the force of the press.
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
    """Return the (n,) samples of a channel at the times of `clock`, in the recorded unit; NaN where there is none."""
    name, place, _ = found
    data = recording.read(name)
    return on_clock(numbers(data)[:, [place]], data, clock, recording.meta.name)[:, 0]


def on_clock(values: FloatArray, stream: StreamData, clock: StreamData, recording: str) -> FloatArray:
    """Return the (m, q) `values` of `stream` at the n times of `clock`, (n, q); NaN where no sample is near."""
    rows = nearest_rows(clock, stream, recording)
    out = np.full((len(rows), values.shape[1]), np.nan)
    out[rows >= 0] = values[rows[rows >= 0]]
    return out


def unit_factor(channel: ChannelSpec, unit: str) -> float:
    """Return the factor from stored numbers to `unit`, from the channel's unit or else from the channel's scale."""
    try:
        return units.conversion(channel.unit, unit)
    except UsageError:
        if channel.scale is not None:
            return channel.scale.to(unit)
        raise DataError(
            f"The channel {channel.name!r} is recorded in {channel.unit!r}, which cannot be converted to {unit!r}.",
            hint="State the channel's unit or scale in the mapping.",
        ) from None


def require_forward(data: StreamData, recording: str) -> None:
    """Raise DataError if times of a stream decrease or are all equal, so that rows cannot be aligned or filtered."""
    if data.t_ns is None or len(data.t_ns) < 2:
        return
    steps = np.diff(data.t_ns)
    backward = int((steps < 0).sum())
    if backward or not steps.any():
        what = f"runs backwards {backward} times" if backward else "stands still"
        raise DataError(
            f"In recording {recording!r}, the time of {data.spec.name} {what}.",
            hint="Find the rows with `tactbench inspect`. If the time is a counter that returns to 0, set `wraps_at` "
            "under `time` and import again; otherwise sort the rows by time before the import.",
        )


def nearest_rows(features: StreamData, other: StreamData, recording: str) -> IntArray:
    """Return (n,) indices of the row of `other` nearest in time to each row of `features`.

    The index is -1 where the nearest row is further away than half the median step of the slower clock. Without a
    clock, row i belongs to row i, and both streams must have equally many rows.
    """
    n, m = len(features.data), len(other.data)
    if features.t_ns is None or other.t_ns is None:
        if n != m:
            raise DataError(
                f"In recording {recording!r}, {features.spec.name} has {n} rows and {other.spec.name} {m}, and there "
                "is no clock to align the rows by.",
                hint="State a time column in the mapping, or import tables of equal length.",
            )
        return np.arange(n, dtype=np.int64)
    if n == m and np.array_equal(features.t_ns, other.t_ns):
        return np.arange(n, dtype=np.int64)
    if m == 0:
        return np.full(n, -1, dtype=np.int64)
    require_forward(other, recording)
    times = other.t_ns
    nearest = np.searchsorted(times[1:] + times[:-1], 2 * features.t_ns)  # the earlier one of two equally near rows
    steps = [float(np.median(np.diff(t))) for t in (features.t_ns, times) if len(t) > 1]
    reach = max(steps, default=0.0) / 2
    near = np.abs(times[nearest] - features.t_ns) <= reach
    return np.where(near, nearest, -1).astype(np.int64)


_CHANNELS = (
    ChannelTarget(kind="force", name="normal", unit="N"),
    ChannelTarget(kind="force", name="tangential", unit="N"),
    ChannelTarget(kind="position", name="slip", unit="m"),
)


@dataclass(frozen=True)
class SlipReference:
    """Samples of the slip reference of one recording, and their slip labels."""

    t_ns: IntArray
    """(n,) times [ns] since the first row of the sensor's clock"""
    force_share: FloatArray
    """(n,) ratio of tangential force to friction coefficient times normal force; 0 without contact"""
    normal_n: FloatArray
    """(n,) normal force [N]"""
    labels: SlipLabels
    disturbance: bool
    """True if the whole recording is a disturbance without slip"""

    def at(self, ends_ns: IntArray, values: npt.NDArray[Any], missing: float = np.nan) -> npt.NDArray[Any]:
        """Return (k,) values of the last sample at or before each of (k,) times [ns], from (n,) `values` of samples.

        The value is `missing` before the first sample, and later than one interval after the last sample.
        """
        place = np.searchsorted(self.t_ns, ends_ns, side="right") - 1
        step = int(np.median(np.diff(self.t_ns))) if self.t_ns.size > 1 else 0
        there = (place >= 0) & (ends_ns <= self.t_ns[-1] + step)
        return np.where(there, values[np.maximum(place, 0)], missing)

    def state(self, ends_ns: IntArray) -> IntArray:
        """Return the (k,) slip states at (k,) times [ns]; ``UNDECIDED`` where the reference has no sample."""
        return self.at(ends_ns, self.labels.state, UNDECIDED)

    def truth(self, ends_ns: IntArray) -> GroundTruth:
        """Return the events from the first frame on, for frames that end at (n,) times [ns]."""
        begin, close = int(ends_ns[0]), int(ends_ns[-1]) + 1
        onset = self.labels.gross_ns[:, 0]
        events = self.labels.gross_ns[(onset >= begin) & (onset < close)]
        return GroundTruth(events, self.disturbance, (begin, close))


def slip_reference(recording: Recording, target: SlipTarget, first_ns: int, counts: Counter[str]) -> SlipReference:
    """Read the slip reference of a recording and label its samples; times are counted from `first_ns`.

    Samples left out are counted in `counts`. Raises NotApplicable if a channel or the coefficient of friction is
    missing, DataError if the coefficient is not a positive number or the surface is never at rest.
    """
    name = recording.meta.name
    found = {str(one.name): channels_for(recording, one) for one in _CHANNELS}
    missing = [called for called, there in found.items() if not there]
    if target.friction not in recording.meta.labels:
        missing.append(f"label {target.friction}")
    if missing:
        raise NotApplicable(
            f"Slip labels need the reference channels normal, tangential and slip, and the label {target.friction}; "
            f"recording {name!r} has no {', '.join(missing)}.",
            hint="State what is missing in the mapping, or choose another task.",
        )
    clock = recording.read(found["slip"][0][0])
    require_forward(clock, name)
    if clock.t_ns is None:
        raise NotApplicable(f"The reference of recording {name!r} has no clock.", hint="State a clock in the mapping.")
    columns = np.array([channel_on(recording, one, clock) for one in _CHANNELS])
    whole = ~np.isnan(columns).any(axis=0)
    if not whole.all():
        counts["samples of the reference left out because a channel has no sample"] += int((~whole).sum())
    normal, tangential, slip = columns[:, whole]
    t_ns = clock.t_ns[whole] - first_ns
    try:
        friction = float(recording.meta.labels[target.friction])
    except ValueError:
        friction = np.nan
    if not 0 < friction < np.inf:
        raise DataError(
            f"Label {target.friction} of recording {name!r} is {recording.meta.labels[target.friction]!r}.",
            hint="State the coefficient of friction, a number above 0.",
        )
    try:
        labels = slip_labels(t_ns, slip, tangential, normal, friction, target.thresholds)
    except DataError as error:
        raise DataError(f"Recording {name!r}: {error.message}", hint=error.hint) from error
    contact = normal >= target.thresholds.contact_force_n
    share = np.divide(np.abs(tangential), friction * normal, out=np.zeros_like(normal), where=contact)
    label, value = target.disturbance
    return SlipReference(t_ns, share, normal, labels, str(recording.meta.labels.get(label)) == value)
