"""``tactbench cost --twin``: a simulated rig's error against its seconds per recording, and what its rungs score."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.cli.grid import print_records
from tactbench.core.tables.terminal import remark

if TYPE_CHECKING:
    from tactbench.core.cost.precision import Skipped
    from tactbench.core.cost.task_score import TaskScore
    from tactbench.core.plugins.interfaces import CostPoint, CostStudy

Scores = Mapping[tuple[str, str], "TaskScore"]
"""By sensor and rung."""
_COLUMNS = ("marks", "way", "rung", "seconds", "error_rms", "error_worst", "unit", "noise", "reason")
"""Of a record that tables show, before those of scores."""


def show_twin(sensors: tuple[str, ...], out: Path, shape: str, *, rounds: int, task: str | None) -> None:
    """Measure the simulated rig for `sensors` (default: the matrix's); print `shape`, write files into `out`.

    Parameters
    ----------
    rounds
        How often each recording is timed.
    task
        Answered with recordings of every rung but the dearest, by a quick estimator; None: no score.
    """
    from tactbench.core.cost.precision import measured
    from tactbench.core.cost.task_score import quick_estimator, task_score
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_object, load_registry
    from tactbench.core.spec.scene import Simulation
    from tactbench.core.study.progress import progress
    from tactbench.core.study.shipped import matrix_called

    registry = load_registry()
    name = registry.first_rig("simulated")
    descriptor = registry.rigs[name]
    if descriptor.work_precision is None:
        raise UsageError(f"The rig {name!r} does not say what its accuracy costs.", hint="Ask twin.")
    estimator = "" if task is None else quick_estimator(registry, task)
    chosen = [registry.sensors[sensor] for sensor in sensors or matrix_called().sensors]
    points: list[CostPoint] = []
    skipped: list[Skipped] = []
    scores: dict[tuple[str, str], TaskScore] = {}
    with progress() as display:
        for sensor in chosen:
            study: CostStudy = load_object(descriptor.work_precision)(sensor, rounds=rounds)
            found, without = measured(study, sensor.name, display)
            points += found
            skipped += without
            for rung in descriptor.rungs[:-1] if task is not None else ():
                scores[sensor.name, rung] = task_score(
                    registry, name, sensor.name, str(task), Simulation(rung=rung), estimator=estimator, progress=display
                )
    records = _records(points, skipped, scores)
    if shape == "table":
        shown = [*_COLUMNS, *(key for key in records[0] if key.startswith("score_"))]
        for named in dict.fromkeys((one["sensor"], one["observable"]) for one in records):
            own = [one for one in records if (one["sensor"], one["observable"]) == named]
            print_records(own, shape, title=f"{', '.join(filter(None, named))}: {study.title}", columns=shown)
        remark(f"{study.reference}\nenough: the quickest whose error is below a third of the noise.")
        for estimator in dict.fromkeys(one.estimator for one in scores.values()):
            remark(f"Scores are by {estimator}, of one replicate recorded at that rung with the same draws (SIM).")
    else:
        print_records(records, shape)
    _write(points, records, study, out)


def _records(points: Sequence[CostPoint], skipped: Sequence[Skipped], scores: Scores) -> list[dict[str, Any]]:
    """Return every way as a flat record: what it takes, how far off it is, what its rung scores, and its settings."""
    from tactbench.core.cost.precision import diagrams, precise, quickest_enough

    def scored(subject: str, rung: str) -> dict[str, Any]:
        one = scores.get((subject, rung))
        return {} if one is None else {f"score_{one.task}": one.score, f"score_{one.task}_reason": one.reason or None}

    found = []
    for group in diagrams(points).values():
        best, enough = precise(group), quickest_enough(group)
        for point in group:
            marks = ("default",) * point.default + ("front",) * (point in best) + ("enough",) * (point is enough)
            found.append({
                "sensor": point.subject, "observable": point.observable, "marks": ", ".join(marks), "way": point.label,
                "rung": point.rung or None, "seconds": point.seconds, "error_rms": point.error,
                "error_worst": point.worst, "unit": point.unit,
                "noise": point.floor if math.isfinite(point.floor) else None, "reason": "",
                **scored(point.subject, point.rung), **point.settings,
            })  # fmt: skip
    found += [{"sensor": one.subject, "way": one.label, "rung": one.rung or None, "reason": one.reason,
               **scored(one.subject, one.rung)} for one in skipped]  # fmt: skip
    keys = dict.fromkeys(key for record in found for key in record)
    return [{key: record.get(key) for key in keys} for record in found]


def _write(points: Sequence[CostPoint], records: Sequence[dict[str, Any]], study: CostStudy, folder: Path) -> None:
    from tactbench.core.cost.precision import draw
    from tactbench.core.files import replace_file, writable
    from tactbench.core.tables.csv_text import csv_of_records
    from tactbench.core.tables.text import json_text

    with writable(folder):
        folder.mkdir(parents=True, exist_ok=True)
        replace_file(folder / "twin.csv", csv_of_records(records).encode())
        replace_file(folder / "twin.json", (json_text(records, indent=1) + "\n").encode())
        if points:
            draw(points, study.title, [folder / "twin.png", folder / "twin.pdf"])
    remark(f"Files: {folder}/twin.csv, .json{', .png, .pdf' if points else ''}")
