"""``tactbench cost --twin``: a simulated rig's error against its seconds per recording, and what its rungs score."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.grid import print_grid, print_records
from tactbench.core.cli.screen import remark

if TYPE_CHECKING:
    from tactbench.core.cost.precision import Skipped
    from tactbench.core.cost.task_score import TaskScore
    from tactbench.core.plugins.cost import CostPoint, CostStudy

Scores = Mapping[tuple[str, str], "TaskScore"]
"""By sensor and rung."""


def show_twin(sensors: tuple[str, ...], out: Path, shape: str, *, rounds: int, task: str | None) -> None:
    """Measure the simulated rig for `sensors` (default: the matrix's); print `shape`, write files into `out`.

    Parameters
    ----------
    rounds
        How often each recording is timed.
    task
        Answered with recordings of every rung but the dearest, by a quick estimator; None: no score.
    """
    from tactbench.core.cli.config import default_matrix
    from tactbench.core.cli.progress import progress
    from tactbench.core.cli.twin import simulated_rig
    from tactbench.core.cost.precision import Skipped, measured
    from tactbench.core.cost.task_score import quick_estimator, task_score
    from tactbench.core.errors import TactbenchError, UsageError
    from tactbench.core.plugins.registry import load_object, load_registry
    from tactbench.core.spec.scene import Simulation

    registry = load_registry()
    name = simulated_rig(registry)
    descriptor = registry.rigs[name]
    if descriptor.work_precision is None:
        raise UsageError(f"The rig {name!r} does not say what its accuracy costs.", hint="Ask twin.")
    estimator = "" if task is None else quick_estimator(registry, task)
    chosen = [registry.sensors[sensor] for sensor in sensors or default_matrix().sensors]
    points: list[CostPoint] = []
    skipped: list[Skipped] = []
    scores: dict[tuple[str, str], TaskScore] = {}
    study: CostStudy | None = None
    with progress() as display:
        for sensor in chosen:
            try:
                study = load_object(descriptor.work_precision)(sensor, rounds=rounds)
            except TactbenchError as error:
                skipped.append(Skipped(sensor.name, "every way", "", str(error)))
                continue
            found, without = measured(study, sensor.name, display)
            points += found
            skipped += without
            for rung in descriptor.rungs[:-1] if task is not None else ():
                scores[sensor.name, rung] = task_score(
                    registry, name, sensor.name, str(task), Simulation(rung=rung), estimator=estimator, progress=display
                )
    if study is None:
        raise UsageError("There is nothing to measure.", hint="Name a sensor that can be simulated with --sensor.")
    records = [_record(point, scores) for point in points] + [_absent(one, scores) for one in skipped]
    keys = list(dict.fromkeys(key for record in records for key in record))
    records = [{key: record.get(key) for key in keys} for record in records]
    if shape == "table":
        _show(points, skipped, scores, study)
    else:
        print_records(records, shape)
    _write(points, records, study, out)


def _show(points: Sequence[CostPoint], skipped: Sequence[Skipped], scores: Scores, study: CostStudy) -> None:
    from tactbench.core.cost.precision import diagrams, precise, quickest_enough

    for (subject, observable), group in diagrams(points).items():
        best, enough = precise(group), quickest_enough(group)
        lines = []
        for point in group:
            marks = ("default",) * point.default + ("front",) * (point in best) + ("enough",) * (point is enough)
            texts = {key: _text(value) for key, value in _record(point, scores).items() if key not in point.settings}
            lines.append({"": ", ".join(marks), **texts})
        columns = [key for key in lines[0] if key not in ("sensor", "observable", "default", "reason")]
        scored = (key for key in columns if key.startswith("score_"))
        numeric = ("seconds", "error_rms", "error_worst", "noise", *scored)
        kinds = ["result" if point.default else "" for point in group]
        print_grid(f"{subject}, {observable}: {study.title}", columns, lines, kinds=kinds, numeric=numeric)
    for one in skipped:
        click.echo(f"{one.subject}, {one.label}: {one.reason}")
    remark(study.reference)
    remark("enough: the quickest whose error is below a third of the noise.")
    for estimator in dict.fromkeys(one.estimator for one in scores.values()):
        remark(f"Scores are by {estimator}, of one replicate recorded at that rung with the same draws (SIM).")


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)


def _record(point: CostPoint, scores: Scores) -> dict[str, Any]:
    """Return a point as one flat record; what its rung scores and its settings last, under their own names."""
    return {
        "sensor": point.subject,
        "observable": point.observable,
        "way": point.label,
        "rung": point.rung or None,
        "seconds": point.seconds,
        "error_rms": point.error,
        "error_worst": point.worst,
        "unit": point.unit,
        "noise": point.floor if math.isfinite(point.floor) else None,
        "default": point.default,
        "reason": "",
        **_score_fields(scores.get((point.subject, point.rung))),
        **point.settings,
    }


def _absent(one: Skipped, scores: Scores) -> dict[str, Any]:
    """Return the record of a way that a sensor cannot have."""
    scored = _score_fields(scores.get((one.subject, one.rung)))
    return {"sensor": one.subject, "way": one.label, "rung": one.rung or None, "reason": one.reason, **scored}


def _score_fields(scored: TaskScore | None) -> dict[str, Any]:
    if scored is None:
        return {}
    why = {f"score_{scored.task}_reason": scored.reason} if scored.reason else {}
    return {f"score_{scored.task}": scored.score} | why


def _write(points: Sequence[CostPoint], records: Sequence[dict[str, Any]], study: CostStudy, folder: Path) -> None:
    from tactbench.core.cost.precision import draw
    from tactbench.core.errors import UnwritableError
    from tactbench.core.files import replace_file
    from tactbench.core.tables.csv_text import csv_of_records
    from tactbench.core.tables.text import json_text

    try:
        folder.mkdir(parents=True, exist_ok=True)
        replace_file(folder / "twin.csv", csv_of_records(records).encode())
        replace_file(folder / "twin.json", (json_text(records, indent=1) + "\n").encode())
        if points:
            draw(points, study.title, [folder / "twin.png", folder / "twin.pdf"])
    except OSError as error:
        raise UnwritableError(
            f"{folder} cannot be written: {error}.", hint="Give another folder with --out."
        ) from error
    remark(f"Files: {folder}/twin.csv, .json{', .png, .pdf' if points else ''}")
