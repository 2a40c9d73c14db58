"""A cell computed once more from scratch, and compared with what lies in the result folder bit for bit."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from tactbench.core.matrix.keys import Keys, differences
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.plan_recordings import RecordingPlan, request_key, requests_for
from tactbench.core.matrix.progress import Progress
from tactbench.core.matrix.run import EngineChoice, Run
from tactbench.core.matrix.store import Row, Store
from tactbench.core.matrix.summary import SEED_DECIDES
from tactbench.core.plugins.registry import Registry
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
    cell: Cell, before: Row, store: Store, registry: Registry, paths: Sequence[Path], progress: Progress
) -> Repeated:
    """Compute `cell` again in this process; nothing in the result folder changes.

    Parameters
    ----------
    before
        Its row in `store`.
    paths
        The recordings it was answered from. What a simulation recorded is recorded again, into another place.
    """
    with tempfile.TemporaryDirectory(prefix="tactbench-rerun-") as place, Store(Path(place)).hold() as again:
        keys, need = Keys(registry), request_key(cell)
        plan = RecordingPlan(paths={need: list(paths)})
        if registry.rigs[cell.rig].simulated:
            plan.requests = requests_for([cell], registry, keys, again, cell.simulation)
            plan.paths = {need: [request.path for request in plan.requests[need]]}
        run = Run(again, registry, keys, plan, EngineChoice("in-process"), None, progress, None, [cell])
        run.carry_out([cell], alone=True)
        row = run.rows[cell.name]
        done = row["status"] == before["status"] == "done"
        decided = [name for name in SEED_DECIDES if name != "cell"] if done else ["status", "reason"]
        old, new = ({name: one.get(name) for name in decided} for one in (before, row))
        found = differences(old, new)
        if done:
            names = [path.stem for path in plan.paths[need]]
            old, new = (dict(zip(names, one["digests"], strict=False)) for one in (before, row))
            found += differences(old, new, "recording ")
            found += _answers(store.answers(before["key"]), again.answers(row["key"]))
    return Repeated(row, tuple(found), run.recorded)


def _answers(before: Mapping[str, Answers], now: Mapping[str, Answers]) -> list[str]:
    found = [
        f"answers on {role} are there only {'before' if role in before else 'now'}"
        for role in before.keys() ^ now.keys()
    ]
    for role in before.keys() & now.keys():
        for column in fields(Answers):
            old, new = getattr(before[role], column.name), getattr(now[role], column.name)
            if old.tobytes() != new.tobytes():
                found.append(f"answers on {role}: values of {column.name} differ")
    return found
