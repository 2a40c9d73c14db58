"""One scene, on one rig, into one recording."""

from __future__ import annotations

import importlib
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

from tactbench.core.errors import RigError
from tactbench.core.plugins.interfaces import Acquisition, Rig
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tactbench.core.spec.recording import Emulation, RecordingMeta, StreamClock, StreamCounts
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.thread_limit import thread_limit


class Acquired(NamedTuple):
    """A finished recording."""

    meta: RecordingMeta
    content_digest: str


def acquire(
    rig: Rig,
    sensor: SensorDescriptor,
    descriptor: RigDescriptor,
    scene: Scene,
    *,
    role: Role | None,
    seed: int,
    path: Path,
    clock: Callable[[], float],
    provenance: Mapping[str, Any],
    watch: Callable[[Block], None] | None = None,
    name: str = "",
    replace: bool = False,
    complete_interrupted: bool = False,
) -> Acquired:
    """Carry out `scene` and write what the rig yields to `path`.

    Parameters
    ----------
    rig, descriptor
        The rig, and what it says about itself. If its acquisition is one of devices (DeviceAcquisition), what it says
        of clocks, counts and emulation is recorded too. If something moves in it (MovingAcquisition), it is stopped
        before an interrupted recording is completed.
    role
        What the recording is for, or None.
    clock
        Seconds, monotonic; its difference over the scene becomes ``provenance["sim_s"]`` for a simulated rig and
        ``provenance["acquisition_s"]`` otherwise. Writing the file is not counted.
    watch
        Called with every block, once it is written.
    name
        Of the recording; empty: that of the scene.
    replace
        Whether a recording that is there already is replaced.
    complete_interrupted
        Whether a recording that was cut short on a real rig is completed, excluded from every evaluation, before the
        error goes on. Otherwise its journal stays, and the error names the command that makes a recording of it. Of a
        simulation nothing is left behind.

    Raises
    ------
    RigError, NotApplicable, LinkError
        If the rig cannot carry out the scene, or ended before its time, or a device sent nothing.
    KeyboardInterrupt
        If it was interrupted.
    RecordingError
        If the file cannot be written.
    """
    began = clock()
    with (
        _one_thread(descriptor),
        _one_interrupt() as ignore_interrupts,
        rig.open(sensor, scene, seed=seed) as acquisition,
    ):
        meta = _meta(acquisition, sensor, descriptor, scene, role, seed, name or scene.name)
        spent = clock() - began
        key = "sim_s" if descriptor.simulated else "acquisition_s"
        with RecordingWriter(path, meta, replace=replace) as writer:
            try:
                blocks = iter(acquisition)
                while True:
                    began = clock()
                    block = next(blocks, None)
                    spent += clock() - began
                    if block is None:
                        break
                    writer.append(block)
                    if watch is not None:
                        watch(block)
                ended = str(getattr(acquisition, "ended", ""))
                if ended:
                    raise RigError(
                        f"The scene {scene.name!r} ended before its time: {ended}.",
                        hint="Look at the rig, and record it again.",
                    )
                _check_not_silent(acquisition, writer.rows)
            except BaseException as error:
                ignore_interrupts()
                alarm = _stopped(acquisition, error)
                if not descriptor.simulated and any(writer.rows.values()):
                    _conclude(writer, acquisition, descriptor, {**provenance, key: spent}, _why(error))
                    if complete_interrupted:
                        writer.complete()
                if alarm and isinstance(error, KeyboardInterrupt):
                    raise RigError(f"It was interrupted, and the rig is not as it should be: {alarm}.") from error
                raise
            _conclude(writer, acquisition, descriptor, {**provenance, key: spent})
    return Acquired(writer.meta, writer.content_digest)


def _check_not_silent(acquisition: Acquisition, rows: Mapping[str, int]) -> None:
    """Raise RigError if devices were read, and nothing came of the sensor or nothing of the reference."""
    if not hasattr(acquisition, "stream_counts"):
        return
    for streams in (acquisition.streams, acquisition.reference):
        names = [stream.name for stream in streams]
        if names and not any(rows.get(name) for name in names):
            raise RigError(
                f"Nothing came of {', '.join(names)} in the whole scene.",
                hint="Is the device on, connected and set to the same speed? `tactbench doctor` asks it.",
            )


def _one_thread(descriptor: RigDescriptor) -> AbstractContextManager[Any]:
    """Return a context in which a simulation makes the same bytes whatever number of threads BLAS was started with."""
    if not descriptor.simulated:
        return nullcontext()
    importlib.import_module("scipy.linalg")  # it brings a BLAS of its own: only what is loaded can be held
    return thread_limit(1)


@contextmanager
def _one_interrupt() -> Iterator[Callable[[], None]]:
    """Raise KeyboardInterrupt for the first Ctrl-C and ignore further ones: what it leaves time to keep is kept.

    Yields what ignores them from then on. Other threads, and who has a handler of their own, are left alone.
    """

    def ignore() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    def first(_number: int, _frame: FrameType | None) -> None:
        ignore()
        raise KeyboardInterrupt

    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield lambda: None
        return
    signal.signal(signal.SIGINT, first)
    try:
        yield ignore
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _conclude(
    writer: RecordingWriter,
    acquisition: Acquisition,
    descriptor: RigDescriptor,
    provenance: dict[str, Any],
    why: str = "",
) -> None:
    """Write down what is known at the end; `why` it was cut short, if it was."""
    remarks = tuple(str(text) for name, text in acquisition.drawn.items() if name.startswith("remark "))
    writer.revise(
        plan=tuple(acquisition.plan),
        assumptions=dict(acquisition.assumptions),
        drawn=dict(acquisition.drawn),
        remarks=(*remarks, f"Interrupted, and not whole: {why}") if why else remarks,
        excluded=f"interrupted: {why}" if why else "",
        provenance=provenance,
        **_of_devices(acquisition, descriptor, writer.rows, cut_short=bool(why)),
    )


def _stopped(acquisition: Acquisition, error: BaseException) -> str:
    """End what moves before anything is written; return what is to be done where it cannot be ended."""
    stop: Callable[[str], str] | None = getattr(acquisition, "stop", None)
    return "" if stop is None else stop(_why(error))


def _why(error: BaseException) -> str:
    return "stopped by hand" if isinstance(error, KeyboardInterrupt) else str(error) or type(error).__name__


def _settled(counts: StreamCounts, written: int, cut_short: bool) -> StreamCounts:
    """Return counts with what is written; rows that were on their way when it was cut short are dropped."""
    left = counts.received - written - counts.dropped - counts.duplicates - counts.late
    dropped = counts.dropped + max(0, left) if cut_short else counts.dropped
    return counts.model_copy(update={"written": written, "dropped": dropped})


def _of_devices(
    acquisition: Acquisition, descriptor: RigDescriptor, rows: Mapping[str, int], *, cut_short: bool = False
) -> dict[str, Any]:
    """Return the fields of the meta that an acquisition of devices knows; of another one, whose clock it is."""
    emulation: Emulation | None = getattr(acquisition, "emulation", None)
    clocks: Mapping[str, StreamClock] = getattr(acquisition, "clocks", {})
    counts: Mapping[str, StreamCounts] = getattr(acquisition, "stream_counts", {})
    sources = {one.source for one in clocks.values()}
    simulated = descriptor.simulated or (emulation is not None and emulation.time == "virtual")
    return {
        "simulated": descriptor.simulated or emulation is not None,
        "emulation": emulation,
        "clock": "simulated" if simulated else "device" if sources == {"device"} else "host",
        "clocks": dict(clocks),
        "streams": {name: _settled(one, rows.get(name, 0), cut_short) for name, one in counts.items()},
        "counts": dict(getattr(acquisition, "counts", {})),
    }


def _meta(
    acquisition: Acquisition,
    sensor: SensorDescriptor,
    descriptor: RigDescriptor,
    scene: Scene,
    role: Role | None,
    seed: int,
    name: str,
) -> RecordingMeta:
    recorded_hz = {stream.name: stream.rate_hz for stream in acquisition.streams}
    own_hz = {stream.name: stream.rate_hz for stream in sensor.spec.streams if stream.rate_hz is not None}
    return RecordingMeta(
        name=name,
        sensor=sensor.spec.model_copy(update={"streams": tuple(acquisition.streams)}),
        own_rates_hz={name: rate for name, rate in own_hz.items() if recorded_hz.get(name, rate) != rate},
        reference=tuple(acquisition.reference),
        rig=descriptor.name,
        session=scene.session,
        role=role,
        scene=scene,
        labels=dict(scene.labels),
        seed=seed,
        **_of_devices(acquisition, descriptor, {}),
    )
