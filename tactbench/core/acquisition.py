"""Acquisition of one scene on one rig, written to one recording."""

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
    """Carry out a scene, write its samples to a file, and return the metadata of the recording.

    A recording of devices that ended early, or that lacks more rows than the rig file allows, is kept as an
    incomplete one: `excluded` is ``incomplete: `` and the reason.

    Parameters
    ----------
    rig
        The rig of `request.rig`. The counts of an acquisition of devices (DeviceAcquisition) are recorded too. An
        acquisition with parts that move has ``stop(why)``, which is called before an interrupted recording is
        completed: it stops the parts, and returns a text about any work left for the operator.
    clock
        Monotonic clock [s]; its difference over the scene, without writing the file, is ``provenance["sim_s"]`` of a
        simulated rig and ``provenance["acquisition_s"]`` of others.
    opened
        Called with the acquisition before its first block.
    watch
        Called with every block, once it is written.
    complete_interrupted
        Whether an interrupted recording of a real rig is completed, excluded from every evaluation, before the error
        goes on. Otherwise its journal stays, and the error names the command that makes a recording of it. An
        interrupted simulation leaves no file.

    Raises
    ------
    RigError, NotApplicable, LinkError
        If the rig cannot carry out the scene, a device sent no row, or moving parts cannot be stopped.
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

        def conclude(reason: str) -> None:
            """Write the facts that are known at the end of the scene, with the reason for exclusion, if any."""
            factor = whole.seconds / (time.perf_counter() - began_s)
            drawn = dict(acquisition.drawn)
            remarks = tuple(str(text) for name, text in drawn.items() if name.startswith("remark "))
            writer.revise(
                plan=tuple(acquisition.plan),
                assumptions=dict(acquisition.assumptions),
                drawn=drawn,
                remarks=(*remarks, reason) if reason else remarks,
                excluded=reason,
                provenance={**request.provenance, "sim_s" if simulated else "acquisition_s": spent},
                **_of_devices(acquisition, request, writer.rows, cut_short=bool(reason), factor=factor),
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
                    lacking = _incompleteness(acquisition, whole)
            except BaseException as error:
                ignore_interrupts()
                alarm = _stop(acquisition, error)
                if not simulated and any(writer.rows.values()):
                    with suppress(RecordingError):  # a full disk: the journal stays with the earlier rows
                        conclude(f"interrupted: {_reason_of(error)}")
                        if complete_interrupted:
                            writer.complete()
                if alarm:
                    raise RigError(
                        f"The scene was interrupted ({_reason_of(error)}), and the rig is not in a safe state: {alarm}."
                    ) from error
                raise
            alarm = _stop(acquisition, RigError(lacking)) if lacking else ""
            if alarm:
                with suppress(RecordingError):
                    conclude(INCOMPLETE + lacking)
                    writer.complete()
                raise RigError(f"The scene {request.scene.name!r} ended, but the rig is not in a safe state: {alarm}.")
            conclude(lacking and INCOMPLETE + lacking)
    return writer.meta


def _incompleteness(acquisition: Any, whole: Completeness) -> str:
    """Return the reason why a recording of devices is incomplete; an empty text if it is complete."""
    ended = str(getattr(acquisition, "ended", ""))
    found = [f"ended before its time: {ended}"] if ended else []
    return "; ".join([*found, *whole.lacking(acquisition.stream_counts)])


def _check_not_silent(acquisition: Acquisition, rows: Mapping[str, int]) -> None:
    """Raise RigError if no row came from the sensor, or no row from the reference."""
    for streams in (acquisition.streams, acquisition.reference):
        names = [stream.name for stream in streams]
        if names and not any(rows.get(name) for name in names):
            raise RigError(
                f"No row came from {', '.join(names)} during the whole scene.",
                hint="Check power, cable and speed of the device; `tactbench doctor` tests its link.",
            )


def _one_thread() -> AbstractContextManager[Any]:
    """Return a context in which a simulation gives identical bytes for any number of BLAS threads."""
    importlib.import_module("scipy.linalg")  # its own BLAS can be limited once it is loaded
    return thread_limit(1)


def _stop(acquisition: Acquisition, error: BaseException) -> str:
    """Stop all motion before a file is written; return the work left for the operator, empty if all stopped."""
    stop: Callable[[str], str] | None = getattr(acquisition, "stop", None)
    return "" if stop is None else stop(_reason_of(error))


def _reason_of(error: BaseException) -> str:
    return "stopped by hand" if isinstance(error, KeyboardInterrupt) else str(error) or type(error).__name__


def _with_written(counts: StreamCounts, written: int, cut_short: bool) -> StreamCounts:
    """Return row counts with the written rows; rows in transit when the recording was cut short count as dropped."""
    left = max(0, counts.received - written - counts.dropped - counts.duplicates - counts.late) if cut_short else 0
    return counts.model_copy(update={"written": written, "dropped": counts.dropped + left})


def _of_devices(
    acquisition: Acquisition,
    request: RecordingRequest,
    rows: Mapping[str, int],
    *,
    cut_short: bool = False,
    factor: float | None = None,
) -> dict[str, Any]:
    """Return the metadata that only an acquisition of devices has, and the clock of any acquisition."""
    emulation = _emulation(request.rig_file, request.sensor.name, acquisition, factor)
    counts: Mapping[str, StreamCounts] = getattr(acquisition, "stream_counts", {})
    simulated = request.rig.simulated or (emulation is not None and emulation.time == "virtual")
    return {
        "simulated": request.rig.simulated or emulation is not None,
        "emulation": emulation,
        "clock": "simulated" if simulated else "host",
        "streams": {name: _with_written(one, rows.get(name, 0), cut_short) for name, one in counts.items()},
        "counts": dict(getattr(acquisition, "counts", {})),
    }


def _is_emulated(name: str, drawn: Mapping[str, Any]) -> bool:
    """Return True if a device states in its facts that it is emulated, which a rig file may omit."""
    return any(key.startswith(f"{name} ") and "emulat" in str(value).lower() for key, value in drawn.items())


def _emulation(file: RigFile | None, sensor: str, acquisition: Acquisition, factor: float | None) -> Emulation | None:
    """Return how devices were emulated, from the rig file and from the devices' own facts; None: no device was."""
    names = [] if file is None else [
        name
        for name, entry in file.entries().items()
        if (name == sensor or name not in file.sensors)
        and (entry.emulated or entry.emulator or _is_emulated(name, acquisition.drawn))
    ]  # fmt: skip
    if file is None or not names:
        return None
    how = file.emulation
    known = {"time": "virtual" if file.emulated else "real", "factor": factor, "devices": tuple(names)}
    if not (file.emulated or how.control):
        return Emulation(**known)
    faults = tuple(f"{name}: {fault}" for name in names for fault in file.entries()[name].faults)
    return Emulation(seed=how.seed, physics=how.physics, faults=faults, **known)


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
