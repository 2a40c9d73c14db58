"""One scene, on one rig, into one recording."""

from __future__ import annotations

import importlib
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from types import FrameType
from typing import Any

from tactbench.core.errors import RigError
from tactbench.core.plugins.interfaces import Acquisition, Rig
from tactbench.core.recording.completeness import INCOMPLETE, Completeness
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tactbench.core.spec.recording import Emulation, RecordingMeta, StreamCounts
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import Allowed, RigFile
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.thread_limit import thread_limit


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
    opened: Callable[[Acquisition], None] | None = None,
    watch: Callable[[Block], None] | None = None,
    name: str = "",
    complete_interrupted: bool = False,
    rig_file: RigFile | None = None,
) -> RecordingMeta:
    """Carry out `scene` and write what the rig yields to `path`; return what the recording says of itself.

    A recording of devices that ended before its time, or that lacks more than the rig file allows, is kept as an
    incomplete one: `excluded` begins with ``incomplete: `` and says why.

    Parameters
    ----------
    rig, descriptor
        The rig, and what it says about itself. If its acquisition is one of devices (DeviceAcquisition), what it says
        of its counts is recorded too. Where something moves in it by itself, it has ``stop(why)``, which is called
        before an interrupted recording is completed: it ends that at once, and returns what is to be done where it
        could not be ended, or an empty text.
    role
        What the recording is for, or None.
    clock
        Seconds, monotonic; its difference over the scene becomes ``provenance["sim_s"]`` for a simulated rig and
        ``provenance["acquisition_s"]`` otherwise. Writing the file is not counted.
    opened
        Called with the acquisition before its first block.
    watch
        Called with every block, once it is written.
    name
        Of the recording; empty: that of the scene.
    complete_interrupted
        Whether a recording that was cut short on a real rig is completed, excluded from every evaluation, before the
        error goes on. Otherwise its journal stays, and the error names the command that makes a recording of it. Of a
        simulation nothing is left behind.
    rig_file
        The devices: what is emulated is marked so, whatever the rig says of it.

    Raises
    ------
    RigError, NotApplicable, LinkError
        If the rig cannot carry out the scene, a device sent nothing in all of it, or what moves cannot be stopped.
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
        if opened is not None:
            opened(acquisition)
        meta = _meta(acquisition, sensor, descriptor, scene, role, seed, name or scene.name, rig_file)
        spent = clock() - began
        allowed = Allowed() if rig_file is None else rig_file.allowed
        whole = Completeness(allowed, acquisition.streams, acquisition.reference)
        has_devices = hasattr(acquisition, "stream_counts")
        began_s = time.perf_counter()

        def of_devices(rows: Mapping[str, int], *, cut_short: bool) -> dict[str, Any]:
            factor = whole.seconds / (time.perf_counter() - began_s)
            return _of_devices(acquisition, descriptor, sensor.name, rig_file, rows, cut_short=cut_short, factor=factor)

        key = "sim_s" if descriptor.simulated else "acquisition_s"
        with RecordingWriter(path, meta) as writer:
            try:
                blocks = iter(acquisition)
                while True:
                    began = clock()
                    block = next(blocks, None)
                    spent += clock() - began
                    if block is None:
                        break
                    writer.append(block)
                    if has_devices:
                        whole.add(block)
                    if watch is not None:
                        watch(block)
                lacking = ""
                if has_devices:
                    _check_not_silent(acquisition, writer.rows)
                    lacking = _lacking(acquisition, whole)
            except BaseException as error:
                ignore_interrupts()
                alarm = _stopped(acquisition, error)
                if not descriptor.simulated and any(writer.rows.values()):
                    why = f"interrupted: {_why(error)}"
                    _conclude(writer, acquisition, of_devices, {**provenance, key: spent}, why)
                    if complete_interrupted:
                        writer.complete()
                if alarm and isinstance(error, KeyboardInterrupt):
                    raise RigError(f"It was interrupted, and the rig is not as it should be: {alarm}.") from error
                raise
            alarm = _stopped(acquisition, RigError(lacking)) if lacking else ""
            _conclude(writer, acquisition, of_devices, {**provenance, key: spent}, lacking and INCOMPLETE + lacking)
    if alarm:
        raise RigError(f"The scene {scene.name!r} ended, and the rig is not as it should be: {alarm}.")
    return writer.meta


def _lacking(acquisition: Any, whole: Completeness) -> str:
    """Return why a recording of devices is incomplete, in one line; empty: it is not."""
    ended = str(getattr(acquisition, "ended", ""))
    found = [f"ended before its time: {ended}"] if ended else []
    return "; ".join([*found, *whole.lacking(acquisition.stream_counts)])


def _check_not_silent(acquisition: Acquisition, rows: Mapping[str, int]) -> None:
    """Raise RigError if nothing came of the sensor's devices or nothing of the reference's."""
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
    of_devices: Callable[..., dict[str, Any]],
    provenance: dict[str, Any],
    why: str = "",
) -> None:
    """Write down what is known at the end; `why` it is not to be evaluated, if it is not."""
    drawn = dict(acquisition.drawn)
    remarks = tuple(str(text) for name, text in drawn.items() if name.startswith("remark "))
    writer.revise(
        plan=tuple(acquisition.plan),
        assumptions=dict(acquisition.assumptions),
        drawn=drawn,
        remarks=(*remarks, why) if why else remarks,
        excluded=why,
        provenance=provenance,
        **of_devices(writer.rows, cut_short=bool(why)),
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
    acquisition: Acquisition,
    descriptor: RigDescriptor,
    sensor: str,
    rig_file: RigFile | None,
    rows: Mapping[str, int],
    *,
    cut_short: bool = False,
    factor: float | None = None,
) -> dict[str, Any]:
    """Return the fields of the meta that an acquisition of devices knows; of another one, whose clock it is."""
    emulation = _emulation(rig_file, sensor, acquisition, factor)
    counts: Mapping[str, StreamCounts] = getattr(acquisition, "stream_counts", {})
    simulated = descriptor.simulated or (emulation is not None and emulation.time == "virtual")
    return {
        "simulated": descriptor.simulated or emulation is not None,
        "emulation": emulation,
        "clock": "simulated" if simulated else "host",
        "streams": {name: _settled(one, rows.get(name, 0), cut_short) for name, one in counts.items()},
        "counts": dict(getattr(acquisition, "counts", {})),
    }


def _says_emulated(name: str, drawn: Mapping[str, Any]) -> bool:
    """Whether a device says of itself that it is emulated, where a rig file forgets to."""
    return any(key.startswith(f"{name} ") and "emulat" in str(value).lower() for key, value in drawn.items())


def _emulation(file: RigFile | None, sensor: str, acquisition: Acquisition, factor: float | None) -> Emulation | None:
    """Return which devices are emulated, by the rig file and by what they say of themselves; None: none is.

    `factor` is how much faster than the clock it went.
    """
    names = [] if file is None else [
        name
        for name, entry in file.entries().items()
        if (name == sensor or name not in file.sensors)
        and (entry.emulated or entry.emulator or _says_emulated(name, acquisition.drawn))
    ]  # fmt: skip
    if file is None or not names:
        return None
    ours = Emulation(time="real", factor=factor, devices=tuple(names))
    if file.emulated or file.emulation.control:
        how = file.emulation
        faults = [f"{name}: {fault}" for name in names for fault in file.entries()[name].faults]
        ours = ours.model_copy(
            update={"time": how.time, "seed": how.seed, "physics": how.physics, "faults": tuple(faults)}
        )
    return ours


def _meta(
    acquisition: Acquisition,
    sensor: SensorDescriptor,
    descriptor: RigDescriptor,
    scene: Scene,
    role: Role | None,
    seed: int,
    name: str,
    rig_file: RigFile | None,
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
        **_of_devices(acquisition, descriptor, sensor.name, rig_file, {}),
    )
