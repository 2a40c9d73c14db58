"""Why a cell would be reused, or computed: what its key is made of now, compared with what it was made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tactbench.core.errors import TactbenchError
from tactbench.core.matrix.keys import Keys, differences
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.store import Row, Store


@dataclass(frozen=True)
class Explanation:
    """What would happen to a cell, and why."""

    key: str
    """Empty: not known before its recordings are there."""
    hit: bool
    reasons: tuple[str, ...]
    """What differs from the result that is there, in words; what is missing."""


def explain(cell: Cell, paths: Sequence[Path], keys: Keys, store: Store, row: Row | None) -> Explanation:
    """Say whether the result of `cell` would be reused, and what differs.

    Parameters
    ----------
    paths
        Its recordings, whether they are there or not.
    row
        The latest row of that name; None: there is none.
    """
    missing = [path for path in paths if not path.exists()]
    reasons = [] if paths else ["there are no recordings of it"]
    if missing:
        text = f"{len(missing)} of {len(paths)} recordings have to be made, {missing[0].stem} first"
        reasons = [f"{text}: they were never made, removed, or are made otherwise now"]
    there = [path for path in paths if path.exists()]
    try:
        digests = {path: store.about(path)["digest"] for path in there}
        before = store.cell(row).sections if row is not None else {}
    except TactbenchError as error:
        return Explanation("", False, (str(error),))
    key, now = keys.of_cell(cell, digests)
    if paths and not missing and store.finished(key) is not None:
        return Explanation(key, True, ())
    if row is None:
        return Explanation("" if missing else key, False, ("it was never computed into this folder", *reasons))
    if missing or not before:
        now, before = ({name: part for name, part in one.items() if name != "data"} for one in (now, before))
    found = differences(before, now) if before else []
    return Explanation("" if missing else key, False, (*found, *reasons))
