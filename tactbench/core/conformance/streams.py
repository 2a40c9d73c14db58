"""What came of streams, from a rig, a driver or a file, looked at for what would spoil a recording."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tactbench.core.conformance.check import fail
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.samples import COLUMNS, Block, FloatArray, Quality, StreamData, join_blocks
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

BAD = Quality.MISSING | Quality.SUSPECT
RATE_SHARE, LEAST_ROWS = 0.02, 20  # a rate further off is a mistake (assumed: quartz is far better); rows that tell
OFF_S = 1.0  # how late the last row's time may be: of a device that sends once a second
FORCE_SHARE = 0.2  # by which a force at the end of a press may differ: newtons and gram-force differ a hundred times
UNITS_OF_TIME = {1e-9: "seconds", 1e-6: "milliseconds", 1e-3: "microseconds"}
UNITS_OF_FORCE = {102.0: "gram-force", 1000.0: "millinewtons"}  # by what a reading in newtons is multiplied


class Recorded(NamedTuple):
    """A recording that was read back."""

    meta: RecordingMeta
    came: Mapping[str, StreamData]
    """By stream."""
    wrong: str
    """The worst that `tactbench inspect` says of it; empty: nothing that ends an evaluation."""


def read_back(path: Path) -> Recorded:
    """Read a recording; raises TactbenchError if it cannot be."""
    from tactbench.core.recording.health import examine
    from tactbench.core.recording.reader import open_recording

    with open_recording(path) as recording:
        came = {name: recording.read(name) for name in recording.stream_names}
        wrong = [f"{one.stream}: {one.message}" for one in examine(recording) if one.severity == "error"]
        return Recorded(recording.meta, came, "".join(wrong[:1]))


def carried_out(
    rig: Any, sensor: SensorDescriptor, descriptor: RigDescriptor, scene: Scene, seed: int = 1,
    rig_file: RigFile | None = None, opened: Callable[[Any], None] | None = None,
) -> Recorded:  # fmt: skip
    """Record a scene as `tactbench record` does it, and read it back; raises what the rig raises."""
    from tactbench.core.acquisition import acquire

    with TemporaryDirectory() as folder:
        path = Path(folder) / "check.h5"
        request = RecordingRequest(sensor, descriptor, scene, path, seed, rig_file=rig_file)
        made = acquire(rig, request, clock=time.perf_counter, opened=opened)
        if made.excluded:
            fail("recording", f"it is {made.excluded}")
        recorded = read_back(path)
    if recorded.wrong:
        fail("recording", f"it is not healthy: {recorded.wrong}")
    for stream in recorded.came.values():
        are_finite("streams", stream)
    return recorded


def joined(where: str, streams: Sequence[StreamSpec], blocks: Iterable[Any]) -> dict[str, StreamData]:
    """Return what came of each stream, NaN where it means nothing; fail where blocks are not as blocks must be."""
    came: dict[str, list[Block]] = {spec.name: [] for spec in streams}
    for block in blocks:
        if block.stream not in came:
            fail(where, f"a block of {block.stream!r}, which is none of its streams")
        came[block.stream].append(replace(block, quality=marks_of(block)))
    found = {}
    for spec in streams:
        nothing = np.empty((0, len(spec.channels)))
        parts = came[spec.name] or [Block(spec.name, None, nothing, nothing.astype(np.uint8))]
        try:
            whole = join_blocks(parts)
        except ValueError as error:
            fail(f"{where}: {spec.name}", f"its blocks do not fit each other: {error}")
        shapes = {name: column.shape for name in COLUMNS if (column := getattr(whole, name)) is not None}
        if shapes["data"][1:] != nothing.shape[1:] or len({shape[0] for shape in shapes.values()}) > 1:
            fail(f"{where}: {spec.name}", f"its columns are {shapes}, for {len(spec.channels)} channels")
        found[spec.name] = StreamData(spec, whole.t_ns, whole.data, whole.quality, sequence=whole.sequence,
                                      device_ns=whole.device_ns)  # fmt: skip
        are_finite(where, found[spec.name])
    return found


def are_finite(where: str, stream: StreamData) -> None:
    """Fail where a sample is no number, and not marked so."""
    wrong = np.argwhere(~np.isfinite(stream.data) & ((marks_of(stream) & BAD) == 0))
    if len(wrong):
        channel = stream.spec.channels[wrong[0][1]].name
        fail(f"{where}: {stream.spec.name}.{channel}", "it is not finite, and not marked as MISSING")


def marks_of(stream: StreamData | Block) -> npt.NDArray[np.uint8]:
    """Return the (n, channels) marks; what has none is good."""
    return np.zeros(np.shape(stream.data), np.uint8) if stream.quality is None else stream.quality


def good(stream: StreamData | Block) -> FloatArray:
    """Return the (n, channels) samples, NaN where they mean nothing."""
    return np.where(marks_of(stream) & BAD, np.nan, stream.data.astype(np.float64))


def times_are_right(where: str, stream: StreamData, seconds: float, late: float, ended_ns: int | None = None) -> None:
    """Fail where times are not nanoseconds that go on, over `seconds` but for a share of `late`, at the stated rate.

    `ended_ns` is what the host's clock says when the last row has come; None: there is none.
    """
    t_ns = stream.t_ns
    if t_ns is None or len(t_ns) < 2:
        return
    spans = float(t_ns[-1] - t_ns[0]) * 1e-9
    for factor, unit in UNITS_OF_TIME.items():
        if 0.5 < spans / seconds / factor < 2:
            fail(f"{where}.t_ns", f"it is in {unit}, and nanoseconds are needed")
    if t_ns.dtype.kind != "i":
        fail(f"{where}.t_ns", f"it is {t_ns.dtype}, and int64 is needed")
    if (np.diff(t_ns) < 0).any():
        fail(f"{where}.t_ns", "it goes back")
    off_s = 0.0 if ended_ns is None else (float(t_ns[-1]) - ended_ns) * 1e-9
    if abs(off_s) > OFF_S:
        fail(f"{where}.t_ns", f"it is {off_s:+.3g} s off the host's clock; the device's own belongs into device_ns")
    late += 2 / (seconds * stream.spec.rate_hz) if stream.spec.rate_hz else 0.0  # a row at either end
    if not abs(spans / seconds - 1) <= late:
        fail(f"{where}.t_ns", f"it spans {spans:.3g} s, and {seconds:.3g} s have passed")
    rate_is_right(where, stream, stream.spec.rate_hz)


def rate_is_right(where: str, stream: StreamData, rate_hz: float | None) -> None:
    """Fail where times say another rate than the stated one."""
    if rate_hz is None or stream.t_ns is None or len(stream.t_ns) < LEAST_ROWS:
        return
    found_hz = (len(stream.t_ns) - 1) / (float(stream.t_ns[-1] - stream.t_ns[0]) * 1e-9)
    # Rows that come together have one time: as many may be missing at either end.
    if abs(found_hz / rate_hz - 1) > RATE_SHARE + 2 / len(np.unique(stream.t_ns)):
        fail(f"{where}.rate_hz", f"{rate_hz:g} Hz is stated, the times say {found_hz:.4g} Hz")


def limits_of(channel: ChannelSpec) -> tuple[float, float]:
    """Return a channel's lower and upper limit, infinite where none is stated."""
    return -math.inf if channel.lower is None else channel.lower, math.inf if channel.upper is None else channel.upper


def within_limits(where: str, channel: ChannelSpec, values: FloatArray) -> None:
    """Fail where a value is beyond a channel's limits."""
    low, high = limits_of(channel)
    beyond = values[(values < low) | (values > high)]
    if len(beyond):
        fail(where, f"it reads {beyond[0]:g}, beyond its limits {low:g} to {high:g}")


def pressing_force(came: Mapping[str, StreamData], streams: Sequence[StreamSpec]) -> tuple[StreamData, FloatArray]:
    """Return the stream and the readings of the pressing force among some streams; fail if there is none in newtons."""
    known = ((spec, column, one) for spec in streams for column, one in enumerate(spec.channels))
    found = [one for one in known if one[2].kind == "force" and one[2].name in ("fz", "normal")]
    if not found:
        fail("reference", "it has no channel of kind force called fz or normal")
    spec, column, channel = found[0]
    if channel.unit != "N":
        fail(f"reference: {spec.name}.{channel.name}.unit", f"{channel.unit!r}, and 'N' is needed")
    return came[spec.name], good(came[spec.name])[:, column]


def force_is(where: str, found_n: float, meant_n: float) -> None:
    """Fail where a force at the end of a press is another one, and say which mistake makes it so."""
    if abs(found_n - meant_n) > FORCE_SHARE * meant_n:
        fail(where, f"{found_n:.4g} N at the end of a press to {meant_n:g} N{likely(found_n / meant_n)}")


def likely(factor: float) -> str:
    """Return which mistake makes a force larger by a factor, as a question; empty: none that is known."""
    units = [unit for other, unit in UNITS_OF_FORCE.items() if 0.8 < factor / other < 1.25]
    return f": are these {units[0]}?" if units else ": is its sign turned?" if factor < 0 else ""
