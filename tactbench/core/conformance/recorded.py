"""Checks of a recording against the sensor that it is said to be of: no code of the plugin runs, nothing is opened."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import Subject, check, fail, skip
from tactbench.core.conformance.press import RATE_SHARE, pressing_channel
from tactbench.core.errors import TactbenchError
from tactbench.core.samples import Quality, StreamData

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray

LARGEST_N = 1000.0
"""No fingertip is pressed with more; a press of 10 N in gram-force reads 1020."""
CLEAR = 0.5
"""Correlation of a taxel with the force from which on its sign can be told."""


@lru_cache(maxsize=2)
def _read(subject: Subject) -> tuple[Any, dict[str, StreamData], list[str]]:
    """Return meta, streams, and what is wrong with the file."""
    from tactbench.core.recording.health import examine
    from tactbench.core.recording.reader import open_recording

    if subject.recording is None:
        skip("no recording is given: `--recording FILE` reads one")
    try:
        with open_recording(subject.recording) as recording:
            data = {name: recording.read(name) for name in recording.stream_names}
            wrong = [f"{one.stream}: {one.message}" for one in examine(recording) if one.severity == "error"]
            return recording.meta, data, wrong if recording.complete else ["it was cut short by a crash", *wrong]
    except TactbenchError as error:
        fail(str(subject.recording), str(error))


def _good(stream: StreamData, column: int) -> FloatArray:
    """Return the samples of a channel, NaN where they mean nothing."""
    import numpy as np

    values = stream.data[:, column].astype(np.float64)
    if stream.quality is not None:
        values[(stream.quality[:, column] & (Quality.MISSING | Quality.SUSPECT)) != 0] = np.nan
    return np.asarray(values)


@check("sensor", mode="recording")
def recording_is_of_this_sensor(subject: Subject) -> None:
    """A recording proves something about the sensor that it is of, if it is healthy.

    Give a recording of this sensor; `tactbench inspect FILE` says whose it is and what is wrong with it.
    """
    meta, _, wrong = _read(subject)
    spec = subject.registry.sensors[subject.name].spec
    if meta.sensor.name != spec.name:
        fail("meta.sensor.name", f"it is of {meta.sensor.name!r}")
    own = {stream.name: {one.name for one in stream.channels} for stream in spec.streams}
    for stream in meta.sensor.streams:
        strange = {one.name for one in stream.channels} - own.get(stream.name, set())
        if strange:
            fail(f"meta.sensor.streams[{stream.name}]", f"the sensor has no channel {min(strange)} there")
    if wrong:
        fail("file", wrong[0])


@check("sensor", mode="recording", needs=("recording-is-of-this-sensor",))
def recording_fits_the_spec(subject: Subject) -> None:
    """A real unit shows another rate or range than the spec states where the spec or the decoding is wrong.

    Correct rate_hz, lower and upper of the spec, the type and byte order of the decoding, or how the device is set up.
    """
    import numpy as np

    meta, data, _ = _read(subject)
    for stated in subject.registry.sensors[subject.name].spec.streams:
        if stated.name not in data:
            continue
        stream = data[stated.name]
        t_ns = stream.t_ns
        own = meta.own_rates_hz.get(stated.name) is not None or (meta.simulated and meta.emulation is None)
        if stated.rate_hz is not None and t_ns is not None and len(t_ns) > 20 and not own:
            rate = (len(t_ns) - 1) / (float(t_ns[-1] - t_ns[0]) * 1e-9)
            if abs(rate / stated.rate_hz - 1) > RATE_SHARE:
                text = f"{stated.rate_hz:g} Hz is stated, the recording has {rate:.4g} Hz"
                fail(f"spec.streams[{stated.name}].rate_hz", text)
        limits = {one.name: one for one in stated.channels}
        for column, channel in enumerate(stream.spec.channels):
            one, values = limits[channel.name], _good(stream, column)
            low, high = float(np.nanmin(values)), float(np.nanmax(values))
            if (one.lower is not None and low < one.lower) or (one.upper is not None and high > one.upper):
                text = f"{one.lower} to {one.upper} is stated, {stated.name} holds {low:g} to {high:g}"
                fail(f"spec channel {channel.name}: lower, upper", text)


@check("sensor", mode="recording", needs=("recording-is-of-this-sensor",))
def recording_shows_a_response(subject: Subject) -> None:
    """Estimators are taught the recorded force: gram-force for newtons makes every error a hundred times as large.

    State the force's unit in the mapping (1 gf is 0.00981 N), and the sign of response as the unit shows it.
    """
    import numpy as np

    meta, data, _ = _read(subject)
    found = pressing_channel([stream for stream in meta.reference if stream.name in data])
    signs = {one.name: one.sign for one in subject.registry.sensors[subject.name].spec.channels("taxel")}
    pressing = None if found is None else data[found[0].name]
    force = None if pressing is None or found is None else _good(pressing, found[1])
    if found is not None and force is not None:
        channel = found[0].channels[found[1]]
        if channel.unit != "N":
            fail(f"reference channel {channel.name}: unit", f"{channel.unit!r}, and 'N' is needed")
        if np.nanmax(np.abs(force)) > LARGEST_N:
            text = f"it reaches {np.nanmax(np.abs(force)):.4g} N: are these gram-force?"
            fail(f"reference channel {channel.name}", text)
    taxels = [
        (stream, channel.name, _good(stream, column))
        for stream in data.values()
        for column, channel in enumerate(stream.spec.channels)
        if channel.kind == "taxel"
    ]
    for stream, name, values in taxels:
        if not signs.get(name) or force is None or stream.t_ns is None or pressing is None or pressing.t_ns is None:
            continue
        felt = np.interp(stream.t_ns, pressing.t_ns, force)
        there = np.isfinite(values) & np.isfinite(felt)
        if there.any() and np.ptp(values[there]) > 0 and np.ptp(felt[there]) > 0:
            likeness = float(np.corrcoef(values[there], felt[there])[0, 1])
            if likeness * signs[name] < -CLEAR:
                text = f"{signs[name]:+d} is stated, its correlation with the force is {likeness:+.2f}"
                fail(f"spec channel {name}: sign", text)


@check("sensor", mode="recording", needs=("recording-is-of-this-sensor",))
def recording_is_of_a_real_unit(subject: Subject) -> None:
    """Only a real unit shows what a sensor is; a simulation shows what somebody believes it to be.

    Record a real unit, or import recordings of one.
    """
    if _read(subject)[0].simulated:
        skip("it is simulated, or its devices are emulated")
