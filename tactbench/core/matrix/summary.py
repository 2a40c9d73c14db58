"""What a row says besides its own result: the baselines of its group, and which keys a seed decides."""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter
from typing import Any

from tactbench.core.matrix.store import Row
from tactbench.core.spec.row import LOWER_IS_BETTER

_group = itemgetter("sensor", "task", "rig", "protocol", "split", "repeat")

SEED_DECIDES = (
    "cell", "status", "metric", "score", "ci_low", "ci_high", "ci_method", "reference_floor",
    "score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high", "true_score", "tare_s", "n_recordings",
    "n_train", "n_test",
    "counts", "chosen", "scores", "confusion", "classes", "split", "stamps", "dagger",
)  # fmt: skip
"""Keys of a row that do not depend on machine or hour, but for the last bits of numbers."""


def fill_baselines(rows: Sequence[Row]) -> None:
    """Write beside every row the best trivial score of its group that used no more than the row's own answer may.

    A trivial answer that looks at the time of a sample knows what an answer from readings does not: a ramp that is
    commanded alike in every recording. It is compared with answers that look at the time too, and with no others. One
    that looks at the reference is an oracle, and no bar to anything.
    """
    by_group: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        if row.get("is_baseline") and row["status"] == "done":
            by_group.setdefault(_group(row), []).append(row)
    bars: dict[tuple[Any, bool], float | None] = {}
    for group, members in by_group.items():
        best = min if members[0]["metric"] in LOWER_IS_BETTER else max
        for timed in (False, True):
            knowing = {"reference"} if timed else {"reference", "time"}
            known = [one["score"] for one in members if one.get("looks_at") not in knowing]
            bars[group, timed] = best(known, default=None)
    for row in rows:
        row["baseline"] = bars.get((_group(row), row.get("looks_at") == "time"))
