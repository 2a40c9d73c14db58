"""Acquisition of one scene on one rig, written to one recording, and search for missing data of its devices."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from typing import Any

import numpy as np

from tactbench.core.errors import RecordingError, RigError
from tactbench.core.interrupts import one_interrupt
from tactbench.core.plugins.interfaces import Acquisition, RecordingRequest, Rig
from tactbench.core.recording.format import Array
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block, IntArray, Quality
from tactbench.core.spec.recording import INCOMPLETE, Emulation, RecordingMeta, StreamCounts
from tactbench.core.spec.rig_file import Allowed, RigFile
from tactbench.core.spec.sensor import StreamSpec
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
        simulated rig and ``provenance["acquisition_s"]`` of other rigs.
    opened, watch
        Called with the acquisition before its first block, and with every block once it is written.
    complete_interrupted
        Whether an interrupted recording of a real rig is completed, excluded from every evaluation, before the error
        is raised. Otherwise its journal stays, and the error names the command that makes a recording of it. An
        interrupted simulation leaves no file.

    Raises
    ------
    RigError, NotApplicable, LinkError
        If the rig cannot carry out the scene, a device sent no row, or moving parts cannot be stopped.
    KeyboardInterrupt, RecordingError
        If it was interrupted, or the file cannot be written.
    """
    began = clock()
    simulated = request.rig.simulated
    if simulated:  # one thread makes the same bytes on every machine; a BLAS can be limited once it is loaded
        importlib.import_module("scipy.linalg")
    with (
        thread_limit(1) if simulated else nullcontext(),
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
                    ended = getattr(acquisition, "ended", "")
                    early = [f"ended before its time: {ended}"] if ended else []
                    lacking = "; ".join([*early, *whole.lacking(getattr(acquisition, "stream_counts", {}))])
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


def _check_not_silent(acquisition: Acquisition, rows: Mapping[str, int]) -> None:
    """Raise RigError if no row came from the sensor, or no row from the reference."""
    for streams in (acquisition.streams, acquisition.reference):
        names = [stream.name for stream in streams]
        if names and not any(rows.get(name) for name in names):
            raise RigError(
                f"No row came from {', '.join(names)} during the whole scene.",
                hint="Check power, cable and speed of the device; `tactbench doctor` tests its link.",
            )


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


MOVED = 0.2
"""Share of the force's range: a sensor is frozen if its readings are constant while the force changes by a larger share
(assumed; a force sensor's noise is less, and a sensor that is not pressed need not change)."""


class Completeness:
    """Search for silent streams, frozen readings and lost rows in the blocks of a recording.

    The force sensor is frozen if its readings are constant for longer than allowed although most of its other rows
    differ from the row before, or if they never change while the tactile sensor's readings do. A force sensor with a
    coarse display, which repeats readings also under load, may be constant without load.

    `allowed` limits silence, time without a change, and the share of lost rows; `sensor` and `reference` are streams of
    the tactile sensor and of the force sensor. Only streams with a stated rate are checked for silence.
    """

    def __init__(self, allowed: Allowed, sensor: Sequence[StreamSpec], reference: Sequence[StreamSpec]) -> None:
        self._allowed = allowed
        self._sensor = [stream.name for stream in sensor]
        self._specs = {stream.name: stream for stream in (*sensor, *reference)}
        self._rows: dict[str, list[IntArray]] = {name: [] for name in self._specs}
        """By stream and block, for each row with a sample: its time, the time of the previous row [ns], and 1 if the
        sample differs from that of the previous row, (3, n)."""
        self._last: dict[str, tuple[int, Array]] = {}
        self._force: list[tuple[int, float]] = []
        self._times_ns: list[int] = []

    def add(self, block: Block) -> None:
        """Add a block of samples; a block without times is ignored."""
        stream, t_ns = block.stream, block.t_ns
        if stream not in self._specs or t_ns is None or not len(t_ns):
            return
        self._times_ns += int(t_ns[0]), int(t_ns[-1])
        missing = np.isnan(block.data.astype(np.float64))
        if block.quality is not None:
            missing |= (block.quality & np.uint8(Quality.MISSING)) != 0
        pressing = [place for place, one in enumerate(self._specs[stream].channels) if one.name in ("fz", "normal")]
        for place in pressing[:1] if stream not in self._sensor else ():
            forces = block.data[~missing[:, place], place]
            self._force += [(int(t_ns[-1]), float(forces.mean()))] if len(forces) else []
        good = ~missing.all(axis=1)
        if good.any():
            data, t_ns = block.data[good], t_ns[good]
            last_ns, last = self._last.get(stream, (t_ns[0], data[0]))
            changed = (data != np.vstack((last, data[:-1]))).any(axis=1)
            self._rows[stream].append(np.stack((t_ns, np.append(last_ns, t_ns[:-1]), changed)))
            self._last[stream] = int(t_ns[-1]), data[-1].copy()

    @property
    def seconds(self) -> float:
        """Time between the first and the last row of all streams, by their time stamps [s]."""
        return 1e-9 * (max(self._times_ns, default=0) - min(self._times_ns, default=0))

    def lacking(self, counts: Mapping[str, StreamCounts]) -> list[str]:
        """Return sentences about streams that exceed a limit; `counts` are the rig's counts of rows, by stream."""
        return [text for name in self._specs for text in self._of(name, counts.get(name))]

    def _of(self, name: str, counts: StreamCounts | None) -> Iterator[str]:
        first_ns, last_ns = min(self._times_ns, default=0), max(self._times_ns, default=0)

        def for_long(what: str, from_ns: int, to_ns: int) -> str:
            return f"{name}: {what} for {1e-9 * (to_ns - from_ns):.3g} s from {1e-9 * (from_ns - first_ns):.3g} s on"

        edges = np.concatenate(([first_ns], self._kept(name)[0], [last_ns]))
        place = int(np.argmax(np.diff(edges)))
        if self._specs[name].rate_hz is not None and np.diff(edges)[place] > 1e9 * self._allowed.silent_s:
            yield for_long("silent", edges[place], edges[place + 1])
        # A microphone may be still in a slow press: the streams of the sensor count together.
        kept = self._kept(*(self._sensor if name in self._sensor else [name]))
        changes = kept[:, kept[2] == 1]
        since, until = np.append(kept[0, :1], changes[0]), np.append(changes[1], kept[0, -1:])
        for row in np.flatnonzero(until - since > 1e9 * self._allowed.frozen_s):
            if self._frozen(name, changes.shape[1], since[row], until[row]):
                yield for_long("frozen", since[row], until[row])
                break
        if counts is not None:
            lost, due = counts.gaps - counts.late + counts.dropped, counts.received + counts.gaps - counts.late
            if due and lost / due > 0.01 * self._allowed.lost_percent:
                yield f"{name}: {lost} of {due} rows lost"

    def _kept(self, *names: str) -> IntArray:
        """Return times, previous times [ns] and changes (0 or 1) of rows of some streams, in order of time, (3, n)."""
        blocks = (block for name in names for block in self._rows[name])
        rows = np.concatenate([np.empty((3, 0), dtype=np.int64), *blocks], axis=1)
        return rows[:, np.argsort(rows[0], kind="stable")]

    def _frozen(self, name: str, changes: int, from_ns: int, to_ns: int) -> bool:
        """Return True if a sensor is constant while the force varies, or a usually varying force sensor is constant."""
        if name in self._sensor:
            every = [value for _, value in self._force]
            within = [value for at_ns, value in self._force if from_ns <= at_ns <= to_ns]
            return bool(within) and max(within) - min(within) > MOVED * (max(every) - min(every)) > 0
        # An axis may stand; a force that nothing changes is none.
        if all(channel.kind != "force" for channel in self._specs[name].channels):
            return False
        if not changes:
            return bool(self._kept(*self._sensor)[2].any())
        others = self._kept(name).shape[1] * (1 - 1e-9 * (to_ns - from_ns) / self.seconds)
        return bool(changes > others / 2)
