"""A finished cell computed once more from scratch, and held against what lies in the result folder bit for bit."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from tactbench.core.matrix.evaluate_cell import Job, solve, unanswered
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.plan_recordings import RecordingRequest
from tactbench.core.matrix.record import record
from tactbench.core.matrix.recorded import Recorded
from tactbench.core.matrix.store import Row, Store
from tactbench.core.matrix.summary import SEED_DECIDES
from tactbench.core.matrix.why import short
from tactbench.core.pool.in_process import InProcess
from tactbench.core.samples import Answers


@dataclass(frozen=True)
class Again:
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
    paths: Sequence[Path],
    requests: Sequence[RecordingRequest],
    report: Callable[[str], None],
) -> Again:
    """Compute `cell` again; nothing in the result folder changes.

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
    found: list[str] = []
    trouble: BaseException | None = None
    made: dict[Path, str] = {}
    for request in requests:
        if request.path in made:
            continue
        report(f"recording {request.sensor} {request.scene.name}")
        try:
            made[request.path] = record(request)
        except Exception as error:
            trouble = error
            break
    if requests and trouble is None:
        found += _recordings(paths, [(request.scene.name, made[request.path]) for request in requests])
    report(f"evaluating {cell.name}")
    outcome: Any = trouble
    if trouble is None:
        job = Job(cell, tuple(request.path for request in requests) or tuple(paths))
        ((_, outcome),) = InProcess().each(solve, [job])
    row, columns = (unanswered(cell, outcome), {}) if isinstance(outcome, BaseException) else outcome
    sets = {role: Answers(**columns[role]) for role in columns}
    found += _rows(before, row)
    if row["status"] == "done" and before["status"] == "done":
        found += _answers(store.answers(before["key"]), sets)
    return Again(row, tuple(found), len(made))


def _recordings(before: Sequence[Path], made: Sequence[tuple[str, str]]) -> list[str]:
    if len(before) != len(made):
        return [f"{len(made)} recordings are made now, {len(before)} were"]
    recorded = Recorded(Path(os.devnull))
    found = []
    for path, (scene, digest) in zip(before, made, strict=True):
        if not path.exists():
            found.append(f"recording {scene}: the old one is gone, so that it cannot be held against the new one")
        elif recorded.digest(path) != digest:
            found.append(f"recording {scene}: other bytes")
    return found


def _rows(before: Row, now: Row) -> list[str]:
    """Return what differs of a row that a seed decides, as it reads once it was written down."""
    fresh = json.loads(json.dumps(now))
    names = [name for name in (*SEED_DECIDES, "unit") if name != "cell"]
    if before["status"] != "done" or now["status"] != "done":
        names = ["status", "reason"]
    return [
        f"{name}: {short(before.get(name))} before, {short(fresh.get(name))} now"
        for name in names
        if before.get(name) != fresh.get(name)
    ]


def _answers(before: Mapping[str, Answers], now: Mapping[str, Answers]) -> list[str]:
    if not before:
        return ["the answers in the folder cannot be read"]
    found = []
    for role in sorted({*before, *now}):
        if role not in before or role not in now or len(before[role]) != len(now[role]):
            rows = [str(len(side[role])) if role in side else "no" for side in (before, now)]
            found.append(f"answers on {role}: {rows[0]} rows before, {rows[1]} now")
            continue
        for column in fields(Answers):
            old, new = getattr(before[role], column.name), getattr(now[role], column.name)
            if old.astype(new.dtype).tobytes() != new.tobytes():
                other = sum(a.tobytes() != b.tobytes() for a, b in zip(old.astype(new.dtype), new, strict=True))
                found.append(f"answers on {role}: {other} of {len(new)} values of {column.name} differ")
    return found
