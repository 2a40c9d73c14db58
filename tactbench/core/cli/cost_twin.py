"""``tactbench cost --twin``: measures the error of a simulated rig against its seconds per recording."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tactbench.core.cli.grid import print_records
from tactbench.core.cost.precision import Skipped, diagrams, measured, precise
from tactbench.core.errors import UsageError
from tactbench.core.files import replace_file, writable
from tactbench.core.plugins.interfaces import CostPoint, CostStudy
from tactbench.core.plugins.registry import load_object, load_registry
from tactbench.core.report.figures.style import save, styled
from tactbench.core.report.figures.trade import draw_precision
from tactbench.core.study.progress import progress
from tactbench.core.study.shipped import matrix_called
from tactbench.core.tables.terminal import remark
from tactbench.core.tables.text import json_text

_COLUMNS = (
    "sensor", "observable", "marks", "way", "rung", "seconds", "error_rms", "error_worst", "unit", "noise", "reason",
)  # fmt: skip
"""Keys of a record that are columns of the printed table."""


def show_twin(sensors: Sequence[str], out: Path, shape: str, rounds: int) -> None:
    """Measure the simulated rig for `sensors` (default: the matrix's); print in format `shape`, write files into `out`.

    Parameters
    ----------
    rounds
        Number of times that each recording is timed.
    """
    registry = load_registry()
    name = registry.first_rig("simulated")
    where = registry.rigs[name].work_precision
    if where is None:
        raise UsageError(f"The rig {name!r} declares no study of its accuracy against time.", hint="Use the rig twin.")
    found: list[CostPoint | Skipped] = []
    with progress() as display:
        for sensor in sensors or matrix_called().sensors:
            study: CostStudy = load_object(where)(registry.sensors[sensor], rounds=rounds)
            found += measured(study, sensor, display)
    points = [one for one in found if not isinstance(one, Skipped)]
    records = _records(points, [one for one in found if isinstance(one, Skipped)])
    print_records(records, shape, title=study.title, columns=_COLUMNS)
    remark(study.reference)
    with writable(out), styled():
        out.mkdir(parents=True, exist_ok=True)
        replace_file(out / f"{name}.json", (json_text(records, indent=1) + "\n").encode())
        if points:
            save(draw_precision(points, study.title), out / name)
    remark(f"Files: {out / name}.json{', .png, .pdf' if points else ''}")


def _records(points: Sequence[CostPoint], skipped: Sequence[Skipped]) -> list[dict[str, Any]]:
    """Return one flat record for each point, with its time, error and settings, and for each skipped setting."""
    found = []
    for group in diagrams(points).values():
        best = precise(group)
        for point in group:
            marks = ("default",) * point.default + ("front",) * (point in best)
            found.append({
                "sensor": point.subject, "observable": point.observable, "marks": ", ".join(marks), "way": point.label,
                "rung": point.rung or None, "seconds": point.seconds, "error_rms": point.error,
                "error_worst": point.worst, "unit": point.unit,
                "noise": point.floor if math.isfinite(point.floor) else None, "reason": "", **point.settings,
            })  # fmt: skip
    found += [{"sensor": one.subject, "way": one.label, "rung": one.rung or None, "reason": one.reason}
              for one in skipped]  # fmt: skip
    keys = dict.fromkeys((*_COLUMNS, *(key for record in found for key in record)))
    return [{key: record.get(key) for key in keys} for record in found]
