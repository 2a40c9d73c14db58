"""Recorded streams of a rig, a driver or a file, and comparisons for use in several checks."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tactbench.core.acquisition import acquire
from tactbench.core.conformance.check import fail
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.recording.health import examine
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Block, FloatArray, Quality, StreamData, join_blocks
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

BAD = Quality.MISSING | Quality.SUSPECT
RATE_SHARE, LEAST_ROWS = 0.02, 20  # tolerance of a rate (assumed: quartz is far better), and rows that determine it
OFF_S = 1.0  # largest delay of the last row's time: of a device that sends once a second
FORCE_SHARE = 0.2  # tolerance of the force at the end of a press: newtons and gram-force differ a hundred times
UNITS_OF_TIME = {1e-9: "seconds", 1e-6: "milliseconds", 1e-3: "microseconds"}  # factors on nanoseconds
UNITS_OF_FORCE = {102.0: "gram-force", 1000.0: "millinewtons"}  # factors on newtons


class Recorded(NamedTuple):
    """A recording as read back from its file."""

    meta: RecordingMeta
    came: Mapping[str, StreamData]
    """Data of each stream, by the stream's name."""
    wrong: str
    """First error that `tactbench inspect` reports for the recording; empty: there is no error."""

    @property
    def arrays(self) -> dict[str, list[Any]]:
        """Samples by name of the stream, as input of `differing`."""
        return {name: [stream.data] for name, stream in self.came.items()}


def differing(one: Mapping[str, Sequence[Any]], other: Mapping[str, Sequence[Any]]) -> list[str]:
    """Return the names for which two runs gave different arrays; NaN equals NaN."""
    same = partial(np.array_equal, equal_nan=True)
    return [name for name in one if not all(map(same, one[name], other[name]))]


def read_back(path: Path) -> Recorded:
    """Read a recording; raise TactbenchError if it cannot be read."""
    with open_recording(path) as recording:
        came = {name: recording.read(name) for name in recording.stream_names}
        wrong = [f"{one.stream}: {one.message}" for one in examine(recording) if one.severity == "error"]
        return Recorded(recording.meta, came, "".join(wrong[:1]))


def carried_out(
    rig: Any, sensor: SensorDescriptor, descriptor: RigDescriptor, scene: Scene, seed: int = 1,
    opened: Callable[[Any], None] | None = None,
) -> Recorded:  # fmt: skip
    """Record a scene as `tactbench record` does, and read it back; raise any error of the rig."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "check.h5"
        request = RecordingRequest(sensor, descriptor, scene, path, seed)
        acquire(rig, request, clock=time.perf_counter, opened=opened)
        recorded = read_back(path)
    if recorded.wrong:
        fail("recording", f"the recording has an error: {recorded.wrong}")
    for stream in recorded.came.values():
        are_finite("streams", stream)
    return recorded


def joined(where: str, streams: Sequence[StreamSpec], blocks: Iterable[Any]) -> dict[str, StreamData]:
    """Return the data of each stream; fail if a block belongs to no stream, or if its columns do not fit."""
    came: dict[str, list[Block]] = {spec.name: [] for spec in streams}
    for block in blocks:
        if block.stream not in came:
            fail(where, f"a block belongs to {block.stream!r}, which is not a stream of the device")
        came[block.stream].append(replace(block, quality=marks_of(block)))
    found = {}
    for spec in streams:
        nothing = np.empty((0, len(spec.channels)))
        whole = join_blocks(came[spec.name] or [Block(spec.name, None, nothing, nothing.astype(np.uint8))])
        if {whole.data.shape, marks_of(whole).shape} != {(len(whole.data), len(spec.channels))}:
            fail(f"{where}: {spec.name}", f"the data have shape {whole.data.shape}, for {len(spec.channels)} channels")
        found[spec.name] = StreamData(spec, whole.t_ns, whole.data, whole.quality, sequence=whole.sequence,
                                      device_ns=whole.device_ns)  # fmt: skip
        are_finite(where, found[spec.name])
    return found


def are_finite(where: str, stream: StreamData) -> None:
    """Fail if a sample is not finite without being marked as MISSING."""
    if (~np.isfinite(stream.data) & ((marks_of(stream) & BAD) == 0)).any():
        fail(f"{where}: {stream.spec.name}", "a sample is not finite, and not marked as MISSING")


def marks_of(stream: StreamData | Block) -> npt.NDArray[np.uint8]:
    """Return the (n, channels) quality flags; all good if no flags are stored."""
    return np.zeros(np.shape(stream.data), np.uint8) if stream.quality is None else stream.quality


def good(stream: StreamData | Block) -> FloatArray:
    """Return the (n, channels) samples, with NaN for samples of bad quality."""
    return np.where(marks_of(stream) & BAD, np.nan, stream.data.astype(np.float64))


def times_are_right(where: str, stream: StreamData, seconds: float, late: float, ended_ns: int | None = None) -> None:
    """Fail unless times are ascending int64 nanoseconds at the stated rate that span `seconds`, up to a share `late`.

    `ended_ns` is the host's time at which the last row was read, if known.
    """
    t_ns = stream.t_ns
    if t_ns is None or len(t_ns) < 2:
        return
    spans = float(t_ns[-1] - t_ns[0]) * 1e-9
    units = [unit for factor, unit in UNITS_OF_TIME.items() if math.isclose(spans / seconds, factor, rel_tol=0.5)]
    if units or t_ns.dtype.kind != "i":
        fail(f"{where}.t_ns", f"times are in {units[0] if units else t_ns.dtype}, and int64 nanoseconds are needed")
    if (np.diff(t_ns) < 0).any():
        fail(f"{where}.t_ns", "times must ascend, but a time goes back")
    off_s = 0.0 if ended_ns is None else (float(t_ns[-1]) - ended_ns) * 1e-9
    if abs(off_s) > OFF_S:
        fail(f"{where}.t_ns", f"times are {off_s:+.3g} s off the host's clock; give the device's times as device_ns")
    late += 2 / (seconds * stream.spec.rate_hz) if stream.spec.rate_hz else 0.0  # a row at either end
    if not abs(spans / seconds - 1) <= late:
        fail(f"{where}.t_ns", f"times span {spans:.3g} s, but {seconds:.3g} s have passed")
    rate_is_right(where, stream, stream.spec.rate_hz)


def rate_is_right(where: str, stream: StreamData, rate_hz: float | None) -> None:
    """Fail if the rate computed from the times differs from the stated rate."""
    if rate_hz is None or stream.t_ns is None or not (seconds := np.ptp(stream.t_ns) * 1e-9):
        return
    found_hz = (len(stream.t_ns) - 1) / seconds
    # Rows that come together have one time: as many may be missing at either end.
    if abs(found_hz / rate_hz - 1) > RATE_SHARE + 2 / len(np.unique(stream.t_ns)):
        fail(f"{where}.rate_hz", f"{rate_hz:g} Hz is stated, but the times give {found_hz:.4g} Hz")


def limits_of(channel: ChannelSpec) -> tuple[float, float]:
    """Return the lower and upper limit of a channel, infinite if not stated."""
    return -math.inf if channel.lower is None else channel.lower, math.inf if channel.upper is None else channel.upper


def within_limits(where: str, channel: ChannelSpec, values: FloatArray) -> None:
    """Fail if a value is outside the limits of its channel."""
    low, high = limits_of(channel)
    beyond = values[(values < low) | (values > high)]
    if len(beyond):
        fail(where, f"a reading is {beyond[0]:g}, outside the limits {low:g} to {high:g}")


def pressing_force(came: Mapping[str, StreamData], streams: Sequence[StreamSpec]) -> tuple[StreamData, FloatArray]:
    """Return the stream and the readings of the pressing force among `streams`; fail without one in newtons."""
    found = [(spec.name, column) for spec in streams for column, one in enumerate(spec.channels)
             if one.kind == "force" and one.name in ("fz", "normal") and one.unit == "N"]  # fmt: skip
    if not found:
        fail("reference", "a channel of kind force, called fz or normal, with the unit N, is needed")
    name, column = found[0]
    return came[name], good(came[name])[:, column]


def force_is(where: str, found_n: float, meant_n: float) -> None:
    """Fail if the force at the end of a press differs from the commanded force."""
    if abs(found_n - meant_n) > FORCE_SHARE * meant_n:
        fail(where, f"{found_n:.4g} N at the end of a press to {meant_n:g} N{likely(found_n / meant_n)}")


def likely(factor: float) -> str:
    """Return the likely cause of a wrong factor on a force, as a question, or an empty text."""
    units = [unit for other, unit in UNITS_OF_FORCE.items() if math.isclose(factor, other, rel_tol=0.2)]
    return f": are these {units[0]}?" if units else ": is the sign reversed?" if factor < 0 else ""
