"""A cell computed once more from scratch, and compared with what lies in the result folder bit for bit."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tactbench.core.matrix.keys import Keys, differences
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.plan_recordings import RecordingSource, request_key, requests_for
from tactbench.core.matrix.run import EngineChoice, Run
from tactbench.core.matrix.store import Row, Store
from tactbench.core.matrix.summary import SEED_DECIDES
from tactbench.core.plugins.registry import Registry
from tactbench.core.progress import Progress


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
    asked: Cell, before: Row, store: Store, registry: Registry, paths: Sequence[Path], progress: Progress
) -> Repeated:
    """Compute `asked` again in this process; nothing in the result folder changes.

    Parameters
    ----------
    before
        Its row in `store`.
    paths
        The recordings it was answered from. What a simulation recorded is recorded again, into another place.
    """
    with tempfile.TemporaryDirectory(prefix="tactbench-rerun-") as place, Store(Path(place)).hold() as again:
        keys, need = Keys(registry), request_key(asked)
        source = RecordingSource(paths)
        if registry.rigs[asked.rig].simulated:
            requests = requests_for([asked], registry, keys, again)[need]
            source = RecordingSource([request.path for request in requests], requests)
        run = Run(again, registry, keys, {need: source}, EngineChoice("in-process"), None, progress, None, [asked])
        run.carry_out([asked], alone=True)
        row = run.rows[asked.name]
        done = row["status"] == before["status"] == "done"
        old, new = (
            {name: one[name] for name in (SEED_DECIDES if done else ("status", "reason"))} for one in (before, row)
        )
        if done:
            for facts, cell in ((old, store.cell(before)), (new, again.cell(row))):
                facts |= {"recording": cell.sections["data"], "answers": cell.digests}
    return Repeated(row, tuple(differences(old, new)), run.recorded)
