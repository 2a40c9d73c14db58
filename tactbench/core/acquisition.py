"""Acquisition of one scene on one rig into one recording."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import Any

from tactbench.core.errors import RecordingError, RigError
from tactbench.core.interrupts import one_interrupt
from tactbench.core.plugins.interfaces import Acquisition, RecordingRequest, Rig
from tactbench.core.recording.completeness import INCOMPLETE, Completeness
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tactbench.core.spec.recording import Emulation, RecordingMeta, StreamCounts
from tactbench.core.spec.rig_file import Allowed, RigFile
from tactbench.core.thread_limit import thread_limit


def acquire(
    rig: Rig,
    request: RecordingRequest,
    *,
    clock: Callable[[], float],
    opened: Callable[[Acquisition], None] | None = None,
    watch: Callable[[Block], None] | None = None,
    complete_interrupted: bool = False,
) -> RecordingMeta:
    """Carry out a scene, write the samples to a file, and return the meta of the recording.

    A recording of devices that ended before its time, or that lacks more than the rig file allows, is kept as an
    incomplete one: `excluded` begins with ``incomplete: `` and says why.

    Parameters
    ----------
    rig
        What `request.rig` describes. If its acquisition is one of devices (DeviceAcquisition), what it says
        of its counts is recorded too. Where something moves in it by itself, it has ``stop(why)``, which is called
        before an interrupted recording is completed: it ends that at once, and returns what is to be done where it
        could not be ended, or an empty text.
    clock
        Seconds, monotonic; its difference over the scene becomes ``provenance["sim_s"]`` for a simulated rig and
        ``provenance["acquisition_s"]`` otherwise. Writing the file is not counted.
    opened
        Called with the acquisition before its first block.
    watch
        Called with every block, once it is written.
    complete_interrupted
        Whether a recording that was cut short on a real rig is completed, excluded from every evaluation, before the
        error goes on. Otherwise its journal stays, and the error names the command that makes a recording of it. Of a
        simulation nothing is left behind.

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
    simulated = request.rig.simulated
    with (
        _one_thread() if simulated else nullcontext(),
        one_interrupt() as ignore_interrupts,
        rig.open(request.sensor, request.scene, seed=request.seed) as acquisition,
    ):
        if opened is not None:
            opened(acquisition)
        meta = _meta(acquisition, request)
        spent = clock() - began
        allowed = Allowed() if request.rig_file is None else request.rig_file.allowed
        whole = Completeness(allowed, acquisition.streams, acquisition.reference)
        has_devices = hasattr(acquisition, "stream_counts")
        began_s = time.perf_counter()

        def conclude(why: str) -> None:
            """Write the facts that are known at the end, with the reason `why` it is excluded, if it is."""
            factor = whole.seconds / (time.perf_counter() - began_s)
            drawn = dict(acquisition.drawn)
            remarks = tuple(str(text) for name, text in drawn.items() if name.startswith("remark "))
            writer.revise(
                plan=tuple(acquisition.plan),
                assumptions=dict(acquisition.assumptions),
                drawn=drawn,
                remarks=(*remarks, why) if why else remarks,
                excluded=why,
                provenance={**request.provenance, "sim_s" if simulated else "acquisition_s": spent},
                **_of_devices(acquisition, request, writer.rows, cut_short=bool(why), factor=factor),
            )

        with RecordingWriter(request.path, meta) as writer:
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
                if not simulated and any(writer.rows.values()):
                    with suppress(RecordingError):  # a disk that refuses this: the journal stays with what came before
                        conclude(f"interrupted: {_why(error)}")
                        if complete_interrupted:
                            writer.complete()
                if alarm:
                    raise RigError(
                        f"It was interrupted ({_why(error)}), and the rig is not as it should be: {alarm}."
                    ) from error
                raise
            alarm = _stopped(acquisition, RigError(lacking)) if lacking else ""
            if alarm:
                with suppress(RecordingError):
                    conclude(INCOMPLETE + lacking)
                    writer.complete()
                raise RigError(f"The scene {request.scene.name!r} ended, and the rig is not as it should be: {alarm}.")
            conclude(lacking and INCOMPLETE + lacking)
    return writer.meta


def _lacking(acquisition: Any, whole: Completeness) -> str:
    """Return the reason for which a recording of devices is incomplete; empty: it is complete."""
    ended = str(getattr(acquisition, "ended", ""))
    found = [f"ended before its time: {ended}"] if ended else []
    return "; ".join([*found, *whole.lacking(acquisition.stream_counts)])


def _check_not_silent(acquisition: Acquisition, rows: Mapping[str, int]) -> None:
    """Raise RigError if no row came from the sensor or none from the reference."""
    for streams in (acquisition.streams, acquisition.reference):
        names = [stream.name for stream in streams]
        if names and not any(rows.get(name) for name in names):
            raise RigError(
                f"No row came from {', '.join(names)} in the whole scene.",
                hint="Is the device on, connected and set to the same speed? `tactbench doctor` asks it.",
            )


def _one_thread() -> AbstractContextManager[Any]:
    """Return a context in which a simulation makes the same bytes for any number of threads of BLAS."""
    importlib.import_module("scipy.linalg")  # it brings a BLAS of its own: only what is loaded can be held
    return thread_limit(1)


def _stopped(acquisition: Acquisition, error: BaseException) -> str:
    """Stop what moves before anything is written; return what remains to be done by hand where that fails."""
    stop: Callable[[str], str] | None = getattr(acquisition, "stop", None)
    return "" if stop is None else stop(_why(error))


def _why(error: BaseException) -> str:
    return "stopped by hand" if isinstance(error, KeyboardInterrupt) else str(error) or type(error).__name__


def _settled(counts: StreamCounts, written: int, cut_short: bool) -> StreamCounts:
    """Return counts with the written rows; rows on their way when the recording was cut short are dropped ones."""
    left = counts.received - written - counts.dropped - counts.duplicates - counts.late
    dropped = counts.dropped + max(0, left) if cut_short else counts.dropped
    return counts.model_copy(update={"written": written, "dropped": dropped})


def _of_devices(
    acquisition: Acquisition,
    request: RecordingRequest,
    rows: Mapping[str, int],
    *,
    cut_short: bool = False,
    factor: float | None = None,
) -> dict[str, Any]:
    """Return the fields of the meta that an acquisition of devices knows, and the clock of any acquisition."""
    emulation = _emulation(request.rig_file, request.sensor.name, acquisition, factor)
    counts: Mapping[str, StreamCounts] = getattr(acquisition, "stream_counts", {})
    simulated = request.rig.simulated or (emulation is not None and emulation.time == "virtual")
    return {
        "simulated": request.rig.simulated or emulation is not None,
        "emulation": emulation,
        "clock": "simulated" if simulated else "host",
        "streams": {name: _settled(one, rows.get(name, 0), cut_short) for name, one in counts.items()},
        "counts": dict(getattr(acquisition, "counts", {})),
    }


def _says_emulated(name: str, drawn: Mapping[str, Any]) -> bool:
    """Return whether a device states in its facts that it is emulated, which a rig file may leave out."""
    return any(key.startswith(f"{name} ") and "emulat" in str(value).lower() for key, value in drawn.items())


def _emulation(file: RigFile | None, sensor: str, acquisition: Acquisition, factor: float | None) -> Emulation | None:
    """Return which devices are emulated, by the rig file and by their own facts; None: none is.

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
    ours = Emulation(time="virtual" if file.emulated else "real", factor=factor, devices=tuple(names))
    if file.emulated or file.emulation.control:
        how = file.emulation
        faults = [f"{name}: {fault}" for name in names for fault in file.entries()[name].faults]
        ours = ours.model_copy(update={"seed": how.seed, "physics": how.physics, "faults": tuple(faults)})
    return ours


def _meta(acquisition: Acquisition, request: RecordingRequest) -> RecordingMeta:
    sensor, scene = request.sensor.spec, request.scene
    recorded_hz = {stream.name: stream.rate_hz for stream in acquisition.streams}
    own_hz = {stream.name: stream.rate_hz for stream in sensor.streams if stream.rate_hz is not None}
    return RecordingMeta(
        name=request.name or scene.name,
        sensor=sensor.model_copy(update={"streams": tuple(acquisition.streams)}),
        own_rates_hz={name: rate for name, rate in own_hz.items() if recorded_hz.get(name, rate) != rate},
        reference=tuple(acquisition.reference),
        rig=request.rig.name,
        session=scene.session,
        role=request.role,
        scene=scene,
        labels=dict(scene.labels),
        seed=request.seed,
        **_of_devices(acquisition, request, {}),
    )
