"""A finished cell computed once more from scratch, and compared with what lies in the result folder bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from tactbench.core.matrix.keys import Sections, differences
from tactbench.core.matrix.plan import Cell, task_of
from tactbench.core.matrix.plan_recordings import RecordingRequest
from tactbench.core.matrix.record import Recorder
from tactbench.core.matrix.solve import Job, solve, unanswered
from tactbench.core.matrix.store import Row, Store
from tactbench.core.matrix.summary import SEED_DECIDES
from tactbench.core.plugins.registry import Registry
from tactbench.core.pool import InProcess
from tactbench.core.samples import Answers


@dataclass(frozen=True)
class Repeated:
    """What came out the second time."""

    row: Row
    differences: tuple[str, ...]
    """What is not as it was, in words; none: identical."""
    recordings: int
    """Recordings made anew; 0: the cell was answered from the same files."""

    @property
    def identical(self) -> bool:
        """Whether it was done before, is done now, and every bit that a seed decides is the same."""
        return self.row["status"] == "done" and not self.differences


def compute_again(
    cell: Cell,
    before: Row,
    store: Store,
    registry: Registry,
    paths: Sequence[Path],
    requests: Sequence[RecordingRequest],
    report: Callable[[str], None],
) -> Repeated:
    """Compute `cell` again in this process; nothing in the result folder changes.

    Parameters
    ----------
    before
        Its row in `store`.
    paths
        The recordings it was answered from.
    requests
        How to make them anew, into another place; none where they cannot be made anew.
    report
        Called with what is being done.
    """
    task = task_of(cell.task_key, registry)
    made: dict[str, str] = {}
    record = Recorder(registry)

    def again(_: None) -> Any:
        for request in requests:
            report(f"recording {request.sensor} {request.scene.name}")
            made[request.path.name] = record(request)
        report(f"evaluating {cell.name}")
        recordings = tuple(request.path for request in requests) or tuple(paths)
        return solve(Job(cell, task, registry.estimators[cell.estimator], recordings, ()))

    outcome: Any
    ((_, outcome),) = InProcess().each(again, [None])
    stopped = isinstance(outcome, BaseException)
    row = unanswered(cell, task, outcome, simulated=before["simulated"]) if stopped else outcome[0]
    names = ["status", "reason"]
    if not stopped and before["status"] == "done":
        names = [name for name in (*SEED_DECIDES, "unit") if name != "cell"]
    old_row, new_row = ({name: one.get(name) for name in names} for one in (before, row))
    found = differences(old_row, new_row)
    if made:
        old: Sections = {path.name: store.about(path)["digest"] for path in paths if path.exists()}
        found += differences(old, made, "recording ")
    if not stopped and before["status"] == "done":
        found += _answers(store.answers(before["key"]), outcome[1])
    return Repeated(row, tuple(found), len(made))


def _answers(before: Mapping[str, Answers], now: Mapping[str, Answers]) -> list[str]:
    found = []
    for role in sorted({*before, *now}):
        if role not in before or role not in now or len(before[role]) != len(now[role]):
            rows = [str(len(side[role])) if role in side else "no" for side in (before, now)]
            found.append(f"answers on {role}: {rows[0]} rows before, {rows[1]} now")
            continue
        for column in fields(Answers):
            old, new = getattr(before[role], column.name), getattr(now[role], column.name)
            if old.tobytes() != new.astype(old.dtype).tobytes():
                found.append(f"answers on {role}: values of {column.name} differ")
    return found
