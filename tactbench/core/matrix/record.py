"""Making the recordings that are missing."""

from __future__ import annotations

import importlib
import os
import time
from collections.abc import Generator, Iterable, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from tactbench.core.errors import UnwritableError
from tactbench.core.matrix.context import RunContext
from tactbench.core.matrix.installed import rig_of
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.plan_recordings import RecordingRequest, request_key
from tactbench.core.matrix.recorded import stat_signature
from tactbench.core.matrix.why import recording_entry
from tactbench.core.plugins.interfaces import Operator, Rig
from tactbench.core.plugins.registry import installed, load_object
from tactbench.core.pool.pool import Pool
from tactbench.core.spec.rig_file import RigFile

GRACE_S = 5.0
"""Seconds that a real rig has to stand still and let go of its devices when its time is up."""


def acquire_missing(run: RunContext, cells: Sequence[Cell], operator: Operator | None, stage: str) -> None:
    """Make the recordings that `cells` lack, and note in the recording plan what went wrong.

    Simulations do not disturb each other and are not timed by the wall: they use all cores; so are emulated devices in
    virtual time. A real rig does one scene at a time, and is asked to end before it is ended. A scene that its process
    does not survive costs its recording. Where somebody stands at the rig, scenes are carried out in this process,
    which has the terminal.

    Parameters
    ----------
    operator
        Who stands at a rig of real devices.
    stage
        What the progress calls this.

    Raises
    ------
    UnwritableError
        If the disk refuses them.
    """
    needs = dict.fromkeys(map(request_key, cells))
    recording_plan, recorded, progress = run.recording_plan, run.recorded, run.progress
    refused: dict[Path, BaseException] = {}
    unique = {request.path: request for need in needs for request in recording_plan.requests.get(need, ())}
    missing = [request for path, request in unique.items() if not path.exists()]
    if not missing:
        return
    run.book.write(recording_entry(request, run.keys) for request in missing)
    simulated = all(_computed(request) for request in missing)
    workers = min(max(run.choice.jobs, os.cpu_count() or 1), len(missing)) if simulated else 1
    progress.begin(stage, len(missing), alone=False)
    outcomes: Generator[tuple[RecordingRequest, str | BaseException], None, None]
    try:
        if operator is not None and not simulated:
            outcomes = _one_by_one(missing, operator)
        else:
            registry = installed()
            own = all(registry.sensors.owned(one.sensor).ours and registry.rigs.owned(one.rig).ours for one in missing)
            if own and simulated:
                import_own_rigs({one.rig for one in missing})
            # What an import of somebody else's changes in its process, it changes for one recording.
            limits = replace(run.choice.limits, grace_s=0.0 if simulated else GRACE_S)
            outcomes = Pool(workers, limits, reuse=own).each(record, missing)
        with closing(outcomes):
            for request, outcome in outcomes:
                if isinstance(outcome, UnwritableError):
                    raise outcome  # the disk is no cell's fault, and refuses the next one too
                if isinstance(outcome, BaseException):
                    refused[request.path] = outcome
                    _discard(request)
                else:
                    recorded.digests[request.path], recorded.made[request.path] = outcome, stat_signature(request.path)
                progress.advance(f"{request.sensor} {request.scene.name}", stopped=isinstance(outcome, BaseException))
    except BaseException:
        # Workers that were ended in the middle could not tidy up behind themselves.
        for request in missing:
            _discard(request)
        raise
    for need in needs:
        reasons = [refused[path] for path in recording_plan.paths.get(need, ()) if path in refused]
        if reasons:
            recording_plan.troubles.setdefault(need, reasons[0])


def _discard(request: RecordingRequest) -> None:
    """Remove what there is of an unfinished recording; a disk that refuses has been told of already."""
    from tactbench.core.recording.format import completing_path, partial_path

    for unfinished in (partial_path(request.path), completing_path(request.path)):
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


def _computed(request: RecordingRequest) -> bool:
    """Whether a scene needs nothing but this machine, and no wall clock."""
    if installed().rigs[request.rig].simulated:
        return True
    if not request.rig_file:
        return False
    devices = RigFile.model_validate_json(request.rig_file)
    used = [devices.sensors.get(request.sensor), devices.force, *devices.devices.values()]
    return devices.emulation.time == "virtual" and all(entry is None or entry.emulated for entry in used)


def _one_by_one(
    requests: Sequence[RecordingRequest], operator: Operator
) -> Generator[tuple[RecordingRequest, str | BaseException], None, None]:
    """Carry out scenes in this process; what a rig raises is the scene's outcome."""
    for request in requests:
        try:
            yield request, record(request, operator)
        except Exception as error:
            yield request, error


def import_own_rigs(names: Iterable[str]) -> None:
    """Import what recordings with our own rigs of these names need, before processes are forked that share it."""
    for library in ("h5py", "scipy.linalg", "tactbench.core.acquisition"):
        importlib.import_module(library)
    for name in names:
        load_object(installed().rigs[name].where)


@lru_cache(maxsize=4)
def _rig(name: str, rig_file: str, operator: Operator | None) -> Rig:
    devices = RigFile.model_validate_json(rig_file) if rig_file else None
    return rig_of(name, installed(), rig_file=devices, operator=operator)  # type: ignore[return-value]


def record(request: RecordingRequest, operator: Operator | None = None) -> str:
    """Make one recording and return its content digest. Raises whatever the rig raises."""
    from tactbench.core.acquisition import acquire

    registry = installed()
    rig = registry.rigs[request.rig]
    made = acquire(
        _rig(request.rig, request.rig_file, operator),  # type: ignore[arg-type]
        registry.sensors[request.sensor],
        rig,
        request.scene,
        role=request.role,
        seed=request.seed,
        path=request.path,
        # Simulations run side by side: what they cost is the processor's time. A real rig is waited for.
        clock=time.process_time if rig.simulated else time.perf_counter,
        provenance={},
    )
    return made.content_digest
