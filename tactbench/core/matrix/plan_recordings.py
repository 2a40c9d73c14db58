"""Planning of the recordings for cells: existing recordings, and recordings to be made by a rig."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tactbench.core.errors import (
    MissingRecordingError,
    NotApplicable,
    RecordingError,
    TactbenchError,
    UnknownNameError,
    UsageError,
)
from tactbench.core.evaluation.protocols import shots
from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan import Cell, plan_cells, serves
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.plugins.registry import Registry, installed
from tactbench.core.plugins.rigs import failing_as, load_rig_file, rig_of
from tactbench.core.pool import InProcess, Limits, Pool
from tactbench.core.progress import Progress
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.rig import RigDescriptor
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.task import ChannelTarget, DeclaredTask, TaskSpec, in_drawn_order

RequestKey = tuple[str, str, str | None, int]
"""Key (sensor, task, split, seed) that determines the recordings of a cell."""


def request_key(cell: Cell) -> RequestKey:
    """Return the key of a cell's recordings, with None for a split that the protocol does not support."""
    return cell.sensor, cell.task, cell.split if serves(cell.protocol, cell.split) else None, cell.seed


def requests_for(
    cells: Iterable[Cell], registry: Registry, keys: Keys, store: Store, rig_file: RigFile | None = None
) -> dict[RequestKey, list[RecordingRequest]]:
    """Return requests for the recordings that cells need, in the order of the campaign, by key.

    If the order of a campaign is random, it is drawn with the cell's seed.
    Tasks and campaigns that have the same scene in the same role share its recording.
    """
    requests: dict[RequestKey, list[RecordingRequest]] = {}
    for cell in cells:
        needed = request_key(cell)
        if needed in requests:
            continue
        requests[needed] = []
        for planned in in_drawn_order(registry.tasks[cell.task].spec.scenes_for(needed[2]), cell.seed):
            scene = planned.scene.simulated_as(cell.simulation)
            key = keys.of_recording(cell.sensor, cell.rig, scene, planned.role, cell.seed, rig_file)
            path = store.folder / "recordings" / cell.sensor / f"{scene.name}-{key[:12]}.h5"
            sensor, rig = registry.sensors[cell.sensor], registry.rigs[cell.rig]
            requests[needed].append(RecordingRequest(sensor, rig, scene, path, cell.seed, planned.role, rig_file))
    return requests


ACQUIRED_SPLITS = ("roles", "session", "recording", "unit", "in-session", "shuffled")
"""Splits that are possible with every acquired recording, in addition to splits by labels of its scene."""


@dataclass
class RecordingSource:
    """Source of the recordings of cells: existing files or requests to a rig."""

    paths: Sequence[Path]
    """Paths of the recordings, existing or to be made."""
    requests: Sequence[RecordingRequest] = ()
    """Requests to a rig for the recordings to be made."""
    trouble: BaseException | None = None
    """Error that is the reason for missing recordings, or None."""


RecordingPlan = dict[RequestKey, RecordingSource]


@dataclass(frozen=True)
class Part:
    """Part of a matrix: the tasks that are evaluated on one folder of recordings."""

    matrix: MatrixSpec
    recordings: Path | None
    trouble: TactbenchError | None = None
    """Error for a data set that could not be fetched or imported, or None."""
    declared: tuple[DeclaredTask, ...] = ()
    """Tasks declared by a data set that could not be fetched."""


def parts_of(matrix: MatrixSpec, recordings: Path | None, root: Path | None, progress: Progress) -> list[Part]:
    """Return `matrix` in parts, one for each data set of its tasks; missing data sets are fetched and imported.

    If a data set cannot be fetched, only its own cells fail.

    Raises
    ------
    TactbenchError
        If no data set can be fetched.
    UnknownNameError
        If the name of a data set is unknown.
    """
    from tactbench.core.recording.datasets import dataset_called

    names = dict.fromkeys(choice.dataset for choice in matrix.tasks)
    known = {name: dataset_called(name) for name in names if name is not None}
    parts = []
    for name in names:
        part = matrix.model_copy(update={"tasks": tuple(choice for choice in matrix.tasks if choice.dataset == name)})
        if name is None:
            parts.append(Part(part, recordings))
            continue
        part = part.model_copy(update={"rig": installed().first_rig("replays")})
        try:
            parts.append(Part(part, known[name].recordings(root, progress)))
        except TactbenchError as error:
            mapping = known[name].mapping
            part = part.model_copy(update={"sensors": matrix.sensors or (mapping.sensor.name,)})
            parts.append(Part(part, None, error, mapping.tasks))
    troubles = [part.trouble for part in parts if part.trouble is not None]
    if troubles and len(troubles) == len(parts):
        raise troubles[0]
    return parts


def plan_parts(
    parts: Sequence[Part], registry: Registry, keys: Keys, store: Store, limits: Limits
) -> tuple[list[Cell], RecordingPlan]:
    """Return the cells of all parts, and the sources of their recordings; see :func:`plan_run`.

    Raises
    ------
    UsageError
        If two parts have a cell in common, and for the reasons of `plan_run`.
    """
    cells: dict[str, Cell] = {}
    plan: RecordingPlan = {}
    for part in parts:
        some, own = plan_run(part, registry, keys, store, limits)
        named = {cell.name: cell for cell in some}
        for name in cells.keys() & named:
            hint = "Run one folder at a time, each with its own --out."
            raise UsageError(f"{name} is planned for two folders of recordings.", hint=hint)
        cells |= named
        plan |= own
    return list(cells.values()), plan


def plan_run(
    part: Part, registry: Registry, keys: Keys, store: Store, limits: Limits
) -> tuple[list[Cell], RecordingPlan]:
    """Return the cells of a part of a matrix, and the sources of their recordings.

    Raises
    ------
    UsageError
        If a name in the matrix is unknown.
    TactbenchError
        If a rig that is not simulated cannot be built or cannot list its recordings, or a recording cannot be read.
    """
    matrix = part.matrix
    if part.trouble is not None:
        cells = plan_cells(matrix, matrix.sensors, registry)
        return cells, {request_key(cell): RecordingSource((), trouble=part.trouble) for cell in cells}
    rig_file = load_rig_file(Path(matrix.rig_file), registry).checked_for(matrix.rig) if matrix.rig_file else None
    rig = registry.rigs[matrix.rig or registry.first_rig("simulated")]
    if not rig.simulated:  # a simulated one replays nothing: it is built when it has to record
        work = partial(_replayed, registry=registry, recordings=part.recordings, rig_file=rig_file)
        builder = InProcess() if registry.rigs.owned(rig.name).ours else Pool(1, limits)
        ((_, paths),) = builder.each(work, [rig.name])
        if isinstance(paths, BaseException):
            raise paths
        if paths is not None:
            return _from_replay(matrix, registry, paths, store)
    if not matrix.sensors:
        raise UsageError("No sensor is given.", hint=f"Give --sensor; known: {', '.join(registry.sensors.names())}.")
    cells = plan_cells(matrix, [registry.sensors[name].name for name in matrix.sensors], registry)
    plan: RecordingPlan = {}
    for key, requests in requests_for(cells, registry, keys, store, rig_file).items():
        _check_split(registry.tasks[key[1]].spec, key[2])
        trouble = _unanswerable(key, registry, rig, rig_file) or (None if requests else _no_scenes(key, matrix))
        made = () if trouble else requests
        plan[key] = RecordingSource([one.path for one in made], made, trouble)
    reasons = {str(one.trouble) for one in plan.values()}
    if plan and not rig.simulated and all(one.trouble is not None for one in plan.values()):
        raise UsageError(f"No task can be recorded: {'; '.join(sorted(reasons))}", hint="Choose another task or rig.")
    return cells, plan


def _unanswerable(
    key: RequestKey, registry: Registry, rig: RigDescriptor, file: RigFile | None
) -> NotApplicable | None:
    """Return the reason why a task is impossible with a sensor on a rig of real devices, by their specs, or None."""
    spec, task = registry.sensors[key[0]].spec, registry.tasks[key[1]].spec
    if rig.simulated or rig.references is None:  # a simulated rig raises it itself, at no cost
        return None
    kinds = {channel.kind for channel in spec.channels()}
    if not kinds & {*task.features, *task.optional_features}:
        needed = " or ".join(task.features)
        return NotApplicable(f"Task {task.name!r} needs channels of kind {needed}; {spec.name} has none.", hint="")
    parts = getattr(task.target, "components", (task.target,))
    wanted = [(one.kind, one.name) for one in parts if isinstance(one, ChannelTarget)]
    if isinstance(task.target, SlipTarget):
        wanted = [("position", "slip")]
    for kind, name in wanted:
        names = rig.references.get(kind)
        lacking = names is None or (kind in ("force", "torque") and file is not None and file.force is None)
        if lacking or (names and name is not None and name not in names):
            what = f"{kind} {name or ''}".strip()
            return NotApplicable(f"Task {task.name!r} needs {what}; the rig {rig.name} does not record it.", hint="")
    return None


def _from_replay(
    matrix: MatrixSpec, registry: Registry, paths: Sequence[Path], store: Store
) -> tuple[list[Cell], RecordingPlan]:
    """Return the cells for existing recordings, and the sources of their recordings.

    A recording of a planned scene is used for the campaigns with a scene of this name; an imported table without
    scene, for every task. An unreadable recording fails the cells of the sensor after which its folder is named;
    RecordingError is raised if there is no such sensor.
    """
    if not paths:
        raise MissingRecordingError("No recordings were found.", hint="Import recordings with `tactbench import`.")
    scenes: dict[str, dict[Path, str | None]] = {}
    broken: dict[str, BaseException] = {}
    for path in paths:
        try:
            about = store.about(path)
            scenes.setdefault(about["sensor"], {})[path] = about["scene"]
        except RecordingError as error:
            if path.parent.name not in (*registry.sensors.names(), *matrix.sensors):
                raise
            broken.setdefault(path.parent.name, error)
    known = sorted({*scenes, *broken})
    for name in matrix.sensors:
        if name not in known:
            raise UnknownNameError("sensor in these recordings", name, known)
    cells = plan_cells(matrix, matrix.sensors or known, registry)
    plan: RecordingPlan = {}
    for key in dict.fromkeys(request_key(cell) for cell in cells):
        sensor, task, split, _ = key
        names = {planned.scene.name for planned in registry.tasks[task].spec.scenes_for(split)}
        found = scenes.get(sensor, {})
        fitting = [path for path, scene in found.items() if scene is None or not names or scene in names]
        trouble = broken.get(sensor) or (None if fitting else _no_scenes(key, matrix))
        plan[key] = RecordingSource(fitting, trouble=trouble)
    return cells, plan


def _no_scenes(key: RequestKey, matrix: MatrixSpec) -> NotApplicable:
    return NotApplicable(
        f"Task {key[1]!r} has no scenes for rig {matrix.rig!r}, and no recordings of the task were given.",
        hint="Use --rig replay --recordings DIR.",
    )


def _replayed(name: str, registry: Registry, recordings: Path | None, rig_file: RigFile | None) -> list[Path] | None:
    """Return the paths of the recordings of a rig that replays, or None for a rig that records."""
    rig = rig_of(name, registry, recordings, rig_file)
    if not hasattr(rig, "recordings"):
        return None
    with failing_as(f"The recordings of rig {name!r} cannot be listed"):
        return [Path(path) for path in rig.recordings()]


def _check_split(task: TaskSpec, split: str | None) -> None:
    """Raise UnknownNameError for a split that is impossible with the recordings of the task's scenes."""
    labels = {label for planned in task.scenes for label in planned.scene.labels}
    known = {*ACQUIRED_SPLITS, *task.splits, *task.campaigns, *labels}
    if split is not None and split not in known and shots(split) is None:
        raise UnknownNameError(f"split of task {task.name!r}", split, known)
