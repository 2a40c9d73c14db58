"""Checks of a recording against the sensor that it is said to be of: no code of the plugin runs, nothing is opened."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import check, fail, skip
from tactbench.core.conformance.subject import Subject
from tactbench.core.errors import TactbenchError
from tactbench.core.samples import Quality, StreamData

if TYPE_CHECKING:
    from tactbench.core.recording.health import Finding
    from tactbench.core.samples import FloatArray
    from tactbench.core.spec.recording import RecordingMeta

RATE_SHARE = 0.05
LARGEST_N = 1000.0
"""No fingertip is pressed with more; a press of 10 N in gram-force reads 1020."""
CLEAR = 0.5
"""Correlation of a taxel with the force from which on its sign can be told."""


@lru_cache(maxsize=2)
def _read(subject: Subject) -> tuple[RecordingMeta, dict[str, StreamData], list[Finding], bool]:
    from tactbench.core.recording.health import examine
    from tactbench.core.recording.reader import open_recording

    if subject.recording is None:
        skip("no recording is given: `--recording FILE` reads one")
    try:
        with open_recording(subject.recording) as recording:
            data = {name: recording.read(name) for name in recording.stream_names}
            return recording.meta, data, examine(recording), recording.complete
    except TactbenchError as error:
        fail(str(subject.recording), str(error))


@check("sensor", mode="recording", level="gold")
def recording_is_of_this_sensor(subject: Subject) -> None:
    """A recording proves something about the sensor that it is of.

    Give a recording of this sensor; `tactbench inspect FILE` says whose it is.
    """
    meta, data, _, complete = _read(subject)
    spec = subject.registry.sensors[subject.name].spec
    if meta.sensor.name != spec.name:
        fail("meta.sensor.name", f"it is of {meta.sensor.name!r}")
    if not complete:
        fail("file", "it was cut short by a crash")
    own = {stream.name: stream for stream in spec.streams}
    for stream in meta.sensor.streams:
        if stream.name not in own:
            fail(f"meta.sensor.streams[{stream.name}]", f"the sensor has no such stream; it has {', '.join(own)}")
        strange = {one.name for one in stream.channels} - {one.name for one in own[stream.name].channels}
        if strange:
            fail(f"meta.sensor.streams[{stream.name}]", f"the sensor has no channel {sorted(strange)[0]}")
    if not any(name in own for name in data):
        fail("streams", "it holds none of the sensor's streams")


@check("sensor", mode="recording", level="gold", needs=("recording-is-of-this-sensor",))
def recording_is_healthy(subject: Subject) -> None:
    """What `tactbench inspect` calls an error would fail an evaluation, or make it wrong.

    Record it again, or correct the mapping that it was imported with.
    """
    wrong = [finding for finding in _read(subject)[2] if finding.severity == "error" and finding.check != "backward"]
    if wrong:
        fail(f"streams[{wrong[0].stream}]", wrong[0].message)


@check("sensor", mode="recording", level="gold", needs=("recording-is-of-this-sensor",))
def recording_clock_goes_forward(subject: Subject) -> None:
    """Rows are put on one clock by their times.

    Look at what stamps the samples; a counter that wraps is counted on.
    """
    import numpy as np

    for name, stream in _read(subject)[1].items():
        if stream.t_ns is None:
            continue
        back = np.flatnonzero(np.diff(stream.t_ns) < 0)
        if len(back):
            fail(f"streams[{name}].t_ns", f"time goes back at row {int(back[0]) + 1}")


@check("sensor", mode="recording", level="gold", needs=("recording-clock-goes-forward",))
def recording_has_the_rate(subject: Subject) -> None:
    """A sensor that comes at another rate than its spec states gives other delays, windows and bands.

    Correct rate_hz of the stream, or how the device is set up.
    """
    meta, data, _, _ = _read(subject)
    if meta.simulated and meta.emulation is None:
        skip("a simulation samples on the scene's clock")
    stated = {stream.name: stream.rate_hz for stream in subject.registry.sensors[subject.name].spec.streams}
    looked = False
    for name, stream in data.items():
        rate = stated.get(name)
        if rate is None or stream.t_ns is None or len(stream.t_ns) < 20:
            continue
        looked = True
        found = (len(stream.t_ns) - 1) / (float(stream.t_ns[-1] - stream.t_ns[0]) * 1e-9)
        own = meta.own_rates_hz.get(name)
        if abs(found / rate - 1) > RATE_SHARE and own is None:
            fail(f"spec.streams[{name}].rate_hz", f"{rate:g} Hz is stated, the recording has {found:.4g} Hz")
    if not looked:
        skip("nobody states a rate, or the recording has no clock")


@check("sensor", mode="recording", level="gold", needs=("recording-is-of-this-sensor",))
def recording_keeps_the_limits(subject: Subject) -> None:
    """A real converter never leaves its range: where it does, the stated range or the decoding is wrong.

    Correct lower and upper, or the type and byte order of the decoding.
    """
    import numpy as np

    limits = {one.name: (one.lower, one.upper) for one in subject.registry.sensors[subject.name].spec.channels()}
    for name, stream in _read(subject)[1].items():
        for column, channel in enumerate(stream.spec.channels):
            low, high = limits.get(channel.name, (None, None))
            values = _good(stream, column)
            for field, limit, beyond in (
                ("lower", low, values < (-math.inf if low is None else low)),
                ("upper", high, values > (math.inf if high is None else high)),
            ):
                if limit is not None and np.any(beyond):
                    fail(
                        f"spec channel {channel.name}: {field}",
                        f"{limit:g} is stated, {name} holds {values[beyond][0]:g}",
                    )


@check("sensor", mode="recording", level="gold", needs=("recording-is-of-this-sensor",))
def recording_force_is_in_newtons(subject: Subject) -> None:
    """Estimators are taught the recorded force: gram-force for newtons makes every error a hundred times as large.

    State the unit in the mapping; 1 gf is 0.00981 N.
    """
    found = False
    for stream in _reference(subject):
        for column, channel in enumerate(stream.spec.channels):
            if channel.kind != "force":
                continue
            found = True
            if channel.unit != "N":
                fail(f"reference channel {channel.name}: unit", f"{channel.unit!r}, and 'N' is needed")
            most = float(abs(_good(stream, column)).max(initial=0.0))
            if most > LARGEST_N:
                fail(f"reference channel {channel.name}", f"it reaches {most:.4g} N: are these gram-force?")
    if not found:
        skip("it has no reference force")


@check("sensor", mode="recording", level="gold", needs=("recording-is-of-this-sensor",))
def recording_shows_a_response(subject: Subject) -> None:
    """A recording of a sensor that did not change tells nothing of it.

    Record a press, and look at the wiring of taxels that never change.
    """
    import numpy as np

    taxels = [
        _good(stream, column)
        for stream in _read(subject)[1].values()
        for column, channel in enumerate(stream.spec.channels)
        if channel.kind == "taxel"
    ]
    if not taxels:
        skip("it holds no taxels")
    if not any(len(one) and np.ptp(one) > 0 for one in taxels):
        fail("streams", "no taxel changes in the whole recording")


@check("sensor", mode="recording", level="gold", needs=("recording-shows-a-response",))
def recording_has_the_sign(subject: Subject) -> None:
    """The stated sign of response is what a real unit shows, or it is wrong.

    Correct sign of the channel; 0 where it does either.
    """
    import numpy as np

    signs = {one.name: one.sign for one in subject.registry.sensors[subject.name].spec.channels("taxel")}
    forces = [
        (stream, column)
        for stream in _reference(subject)
        for column, channel in enumerate(stream.spec.channels)
        if channel.kind == "force" and channel.name in ("fz", "normal")
    ]
    if not any(signs.values()) or len(forces) != 1 or forces[0][0].t_ns is None:
        skip("no sign is stated, or there is no single pressing force with a clock")
    pressing, column = forces[0]
    for stream in _read(subject)[1].values():
        if stream.t_ns is None or stream is pressing:
            continue
        force = np.interp(stream.t_ns, pressing.t_ns, pressing.data[:, column].astype(np.float64))  # type: ignore[arg-type]
        for place, channel in enumerate(stream.spec.channels):
            values = stream.data[:, place].astype(np.float64)
            if (
                not signs.get(channel.name)
                or not np.isfinite(values).all()
                or np.ptp(values) == 0
                or np.ptp(force) == 0
            ):
                continue
            likeness = float(np.corrcoef(values, force)[0, 1])
            if likeness * signs[channel.name] < -CLEAR:
                stated = signs[channel.name]
                fail(
                    f"spec channel {channel.name}: sign",
                    f"{stated:+d} is stated, its correlation with the force is {likeness:+.2f}",
                )


@check("sensor", mode="recording", level="gold", needs=("recording-is-of-this-sensor",), may_skip=True)
def recording_is_of_a_real_unit(subject: Subject) -> None:
    """Only a real unit shows what a sensor is; a simulation shows what somebody believes it to be.

    Record a real unit, or import recordings of one.
    """
    meta = _read(subject)[0]
    if meta.simulated:
        skip("it is simulated, or its devices are emulated")


def _reference(subject: Subject) -> list[StreamData]:
    meta, data, _, _ = _read(subject)
    return [data[stream.name] for stream in meta.reference if stream.name in data]


def _good(stream: StreamData, column: int) -> FloatArray:
    """Return the samples of a channel that mean something."""
    import numpy as np

    values: Any = stream.data[:, column].astype(np.float64)
    there = np.isfinite(values)
    if stream.quality is not None:
        there &= (stream.quality[:, column] & (Quality.MISSING | Quality.SUSPECT)) == 0
    return np.asarray(values[there])


CHECKS = (
    recording_is_of_this_sensor, recording_is_healthy, recording_clock_goes_forward, recording_has_the_rate,
    recording_keeps_the_limits, recording_force_is_in_newtons, recording_shows_a_response, recording_has_the_sign,
    recording_is_of_a_real_unit,
)  # fmt: skip
