"""Plan of the recordings of cells: those that exist, and those that a rig has to make."""

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
from tactbench.core.spec.declared_task import DeclaredTask
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.rig import RigDescriptor
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.task import ChannelTarget, TaskSpec, in_drawn_order

RequestKey = tuple[str, str, str | None, int]
"""Sensor, task, split and seed, which determine the recordings of a cell."""


def request_key(cell: Cell) -> RequestKey:
    """Return the key of a cell's recordings, without a split that its protocol does not support."""
    return cell.sensor, cell.task, cell.split if serves(cell.protocol, cell.split) else None, cell.seed


def requests_for(
    cells: Iterable[Cell], registry: Registry, keys: Keys, store: Store, rig_file: RigFile | None = None
) -> dict[RequestKey, list[RecordingRequest]]:
    """Return the recordings needed, in the campaign's order, with the cells' settings of the simulation.

    Where the campaign leaves the order to be drawn, it is drawn with the cell's seed.
    Tasks and campaigns with the same scene in the same role share the recording.
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
"""Splits that every acquired recording supports, beside the labels of its scene."""


@dataclass
class RecordingSource:
    """Where the recordings of some cells come from."""

    paths: Sequence[Path]
    """Paths of the recordings, present or to be made."""
    requests: Sequence[RecordingRequest] = ()
    """Requests to a rig for those that are missing."""
    trouble: BaseException | None = None
    """Error that explains why recordings are missing."""


RecordingPlan = dict[RequestKey, RecordingSource]


@dataclass(frozen=True)
class Part:
    """The tasks of a matrix that are evaluated on one folder of recordings."""

    matrix: MatrixSpec
    recordings: Path | None
    trouble: TactbenchError | None = None
    """Error of a data set that could not be fetched or imported."""
    declared: tuple[DeclaredTask, ...] = ()
    """Tasks that such a data set declares."""


def parts_of(matrix: MatrixSpec, recordings: Path | None, root: Path | None, progress: Progress) -> list[Part]:
    """Return `matrix` in parts, one for each data set that its tasks name; what is missing is fetched and imported.

    A data set that cannot be fetched fails its own cells only.

    Raises
    ------
    TactbenchError
        If no data set can be fetched.
    UnknownNameError
        If there is no data set of that name.
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
    """Return the cells of all parts, and where their recordings come from; see :func:`plan_run`.

    Raises
    ------
    UsageError
        If two parts have a cell in common, and as `plan_run`.
    """
    cells: dict[str, Cell] = {}
    plan: RecordingPlan = {}
    for part in parts:
        if part.trouble is None:
            some, own = plan_run(part, registry, keys, store, limits)
        else:
            some = plan_cells(part.matrix, part.matrix.sensors, registry)
            own = {request_key(cell): RecordingSource((), trouble=part.trouble) for cell in some}
        for cell in some:
            if cells.setdefault(cell.name, cell) is not cell:
                raise UsageError(
                    f"{cell.name} is planned for two folders of recordings.",
                    hint="Run one of them at a time, each with --out.",
                )
        plan |= own
    return list(cells.values()), plan


def plan_run(
    part: Part, registry: Registry, keys: Keys, store: Store, limits: Limits
) -> tuple[list[Cell], RecordingPlan]:
    """Return the cells of a matrix, and where their recordings come from.

    Raises
    ------
    UsageError
        If the matrix names something that does not exist.
    TactbenchError
        If a rig that is not simulated cannot be built, cannot list its recordings, or one of them cannot be read.
    """
    matrix = part.matrix
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
        raise UsageError("No sensor is named.", hint=f"Give --sensor; known: {', '.join(registry.sensors.names())}.")
    cells = plan_cells(matrix, [registry.sensors[name].name for name in matrix.sensors], registry)
    for cell in cells:
        _check_split(registry.tasks[cell.task].spec, cell.split)
    plan: RecordingPlan = {}
    for key, made in requests_for(cells, registry, keys, store, rig_file).items():
        trouble = _unanswerable(key, registry, rig, rig_file) or (None if made else _no_scenes(key, matrix))
        plan[key] = (
            RecordingSource((), trouble=trouble) if trouble else RecordingSource([one.path for one in made], made)
        )
    reasons = {str(one.trouble) for one in plan.values()}
    if plan and not rig.simulated and all(one.trouble is not None for one in plan.values()):
        raise UsageError(f"Nothing is recorded: {'; '.join(sorted(reasons))}", hint="Choose another task or rig.")
    return cells, plan


def _unanswerable(
    key: RequestKey, registry: Registry, rig: RigDescriptor, file: RigFile | None
) -> NotApplicable | None:
    """Return the reason for which specs rule out a task on a rig of real devices with a sensor, or None."""
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
            return NotApplicable(f"Task {task.name!r} asks for {what}; the rig {rig.name} records none.", hint="")
    return None


def _from_replay(
    matrix: MatrixSpec, registry: Registry, paths: Sequence[Path], store: Store
) -> tuple[list[Cell], RecordingPlan]:
    """Return the cells of recordings that exist.

    A recording of a planned scene serves the campaigns with a scene of this name; one without (an imported table)
    serves every task. An unreadable recording fails the cells of the sensor after which its folder is named;
    RecordingError if there is no such sensor.
    """
    if not paths:
        raise MissingRecordingError("There are no recordings.", hint="Import recordings with `tactbench import`.")
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
        f"Task {key[1]!r} has no scenes for rig {matrix.rig!r}, and there are no recordings of it.",
        hint="Use --rig replay --recordings DIR.",
    )


def _replayed(name: str, registry: Registry, recordings: Path | None, rig_file: RigFile | None) -> list[Path] | None:
    """Return the recordings of a rig that replays, or None for a rig that records."""
    rig = rig_of(name, registry, recordings, rig_file)
    if not hasattr(rig, "recordings"):
        return None
    with failing_as(f"The recordings of rig {name!r} cannot be listed"):
        return [Path(path) for path in rig.recordings()]


def _check_split(task: TaskSpec, split: str | None) -> None:
    """Refuse a split that the recordings of this task's scenes do not support, before any is made."""
    labels = {label for planned in task.scenes for label in planned.scene.labels}
    known = {*ACQUIRED_SPLITS, *task.splits, *task.campaigns, *labels}
    if split is not None and split not in known and shots(split) is None:
        raise UnknownNameError(f"split of task {task.name!r}", split, known)
