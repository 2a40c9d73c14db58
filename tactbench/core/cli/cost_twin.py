"""``tactbench cost --twin``: a simulated rig's error against its seconds per recording, and what its rungs score."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from tactbench.core.cost.precision import Skipped
    from tactbench.core.cost.task_score import TaskScore
    from tactbench.core.matrix.progress import Progress
    from tactbench.core.plugins.cost import CostPoint, CostStudy
    from tactbench.core.plugins.registry import Registry

_COLUMNS = ("", "way", "time", "rms", "worst", "unit", "noise / 3", "front", "reason")

Scores = Mapping[tuple[str, str], "list[TaskScore]"]
"""By sensor and rung."""


def show_twin(
    sensors: tuple[str, ...],
    rig: str | None,
    out: Path,
    shape: str,
    *,
    rounds: int,
    task: str | None,
    rungs: tuple[str, ...],
    estimator: str | None,
    scoring: bool,
    seed: int,
) -> None:
    """Measure the simulated rig `rig` (default: the first) for `sensors`; print `shape`, write files into `out`.

    Parameters
    ----------
    rounds
        How often each recording is timed.
    task
        Whose score is looked at, rung by rung; None: every task of the default matrix.
    rungs
        Those whose recordings are scored; none named: all but the last, the dearest.
    estimator
        What answers then; None: a quick one.
    scoring
        False: no score.
    seed
        Of the recordings that are scored.
    """
    from tactbench.core.cli.config import default_matrix
    from tactbench.core.cli.progress import progress
    from tactbench.core.cli.twin import simulated_rig
    from tactbench.core.cost.precision import Skipped, measured
    from tactbench.core.errors import TactbenchError, UnknownNameError, UsageError
    from tactbench.core.plugins.registry import load_object, load_registry

    registry = load_registry()
    name = simulated_rig(registry, rig)
    descriptor = registry.rigs[name]
    if descriptor.work_precision is None:
        raise UsageError(f"The rig {name!r} does not say what its accuracy costs.", hint="Choose another with --rig.")
    for rung in rungs:
        if rung not in descriptor.rungs:
            raise UnknownNameError(f"rung of {name}", rung, descriptor.rungs)
    tasks = [task] if task is not None else [choice.name for choice in default_matrix().tasks]
    answerers = _answerers(registry, tasks, estimator) if scoring else {}
    chosen = [registry.sensors[sensor] for sensor in sensors or default_matrix().sensors]
    points: list[CostPoint] = []
    skipped: list[Skipped] = []
    scores: dict[tuple[str, str], list[TaskScore]] = {}
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
            for rung in (rungs or descriptor.rungs[:-1]) if answerers else ():
                scores[sensor.name, rung] = _scored(registry, name, sensor.name, rung, answerers, seed, display)
    if study is None or not (points or skipped):
        raise UsageError("There is nothing to measure.", hint="Name a sensor that can be simulated with --sensor.")
    records = [record(point, scores) for point in points] + [_absent(one, scores) for one in skipped]
    records = [{key: entry.get(key) for key in _keys(records)} for entry in records]
    _show(points, skipped, scores, records, study, shape)
    _write(points, records, study, out)


def _answerers(registry: Registry, tasks: Sequence[str], estimator: str | None) -> dict[str, str]:
    """Return what answers each task: the estimator named, or a quick one."""
    from tactbench.core.cost.task_score import quick_estimator

    return {registry.tasks[task].name: estimator or quick_estimator(registry, task) for task in tasks}


def _scored(
    registry: Registry, rig: str, sensor: str, rung: str, answerers: Mapping[str, str], seed: int, progress: Progress
) -> list[TaskScore]:
    from tactbench.core.cost.task_score import task_score
    from tactbench.core.spec.scene import Simulation

    simulation = Simulation(rung=rung)
    return [
        task_score(registry, rig, sensor, task, simulation, estimator=answerer, seed=seed, progress=progress)
        for task, answerer in answerers.items()
    ]


def _show(
    points: Sequence[CostPoint],
    skipped: Sequence[Skipped],
    scores: Scores,
    records: Sequence[dict[str, Any]],
    study: CostStudy,
    shape: str,
) -> None:
    from tactbench.core.cli.grid import print_grid, print_records
    from tactbench.core.cli.screen import remark
    from tactbench.core.cost.precision import diagrams, precise, verdict

    if shape != "table":
        print_records(records, shape)
        return
    for (subject, observable), group in diagrams(points).items():
        best = precise(group)
        lines = [_line(point, point in best) for point in group]
        lines += _lines_of(skipped, subject)
        kinds = ["result" if point.default else "" for point in group]
        kinds += ["skipped"] * (len(lines) - len(kinds))
        print_grid(f"{subject}, {observable}: {study.title}", _COLUMNS, lines, kinds=kinds,
                   numeric=("time", "rms", "worst", "noise / 3"))  # fmt: skip
        click.echo(verdict(group))
    measured = {point.subject for point in points}
    for one in skipped:
        if one.subject not in measured:
            click.echo(f"{one.subject}, {one.label}: {one.reason}")
    for subject in dict.fromkeys(sensor for sensor, _ in scores):
        _show_scores(subject, points, scores)
    remark(study.reference)
    if scores:
        remark("Scores are of recordings made at that rung, with the same draws of noise and place (SIM); behind a "
               "score how far it is from the finest rung's here; all of one replicate.")  # fmt: skip


def _lines_of(skipped: Sequence[Skipped], subject: str) -> list[dict[str, str]]:
    """Return one line for each reason why a sensor cannot have a way."""
    found: dict[str, list[str]] = {}
    for one in skipped:
        if one.subject == subject:
            found.setdefault(one.reason, []).append(one.label)
    return [
        {"way": labels[0] + (f", and {len(labels) - 1} more" if len(labels) > 1 else ""), "reason": reason}
        for reason, labels in found.items()
    ]


def _show_scores(subject: str, points: Sequence[CostPoint], scores: Scores) -> None:
    """Print a sensor's rungs: error in counts and time beside what its recordings score."""
    from tactbench.core.cli.grid import print_grid

    own = {rung: scored for (sensor, rung), scored in scores.items() if sensor == subject}
    finest = {one.task: one.score for scored in own.values() for one in scored if one.score is not None}
    lines: list[dict[str, str]] = []
    columns = dict.fromkeys(("rung", "time", *(f"{one.observable}, rms" for one in points if one.subject == subject)))
    for rung, scored in own.items():
        line = {"rung": rung}
        for point in points:
            if (point.subject, point.rung) == (subject, rung):
                line |= {f"{point.observable}, rms": f"{point.error:.3g} {point.unit}", "time": _ms(point.seconds)}
        for one in scored:
            line |= _score_line(one, finest.get(one.task))
        columns |= dict.fromkeys(line)
        lines.append(line)
    print_grid(f"{subject}: what a rung scores", tuple(columns), lines, numeric=[c for c in columns if c != "rung"])


def _score_line(one: TaskScore, finest: float | None) -> dict[str, str]:
    from tactbench.core.cost.task_score import in_unit
    from tactbench.core.leaderboard.names import METRIC_NAMES

    name = f"{one.task}: {METRIC_NAMES.get(one.metric, one.metric)} by {one.estimator}"
    if one.score is None:
        return {name: one.reason}
    apart = "" if finest is None else f"{one.score - finest:+.2g}"
    return {name: f"{in_unit(one.score, one.unit)}", f"{one.task}: against the finest": apart}


def _line(point: CostPoint, on_front: bool) -> dict[str, str]:
    return {
        "": "default" if point.default else "",
        "way": point.label,
        "time": _ms(point.seconds),
        "rms": f"{point.error:.3g}",
        "worst": f"{point.worst:.3g}",
        "unit": point.unit,
        "noise / 3": f"{point.floor / 3:.3g}" if math.isfinite(point.floor) else "",
        "front": "*" if on_front else "",
    }


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.1f} ms"


def record(point: CostPoint, scores: Scores | None = None) -> dict[str, Any]:
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
        **_score_fields((scores or {}).get((point.subject, point.rung), [])),
        **point.settings,
    }


def _absent(one: Skipped, scores: Scores) -> dict[str, Any]:
    """Return the record of a way that a sensor cannot have."""
    scored = _score_fields(scores.get((one.subject, one.rung), []))
    return {"sensor": one.subject, "way": one.label, "rung": one.rung or None, "reason": one.reason, **scored}


def _score_fields(scored: Sequence[TaskScore]) -> dict[str, Any]:
    return {f"score_{one.task}": one.score for one in scored} | {
        f"score_{one.task}_reason": one.reason for one in scored if one.reason
    }


def _keys(records: Sequence[Mapping[str, Any]]) -> list[str]:
    return list(dict.fromkeys(key for entry in records for key in entry))


def _write(points: Sequence[CostPoint], records: Sequence[dict[str, Any]], study: CostStudy, folder: Path) -> None:
    import json

    from tactbench.core.cli.screen import remark
    from tactbench.core.cost.precision_figure import draw
    from tactbench.core.errors import UnwritableError
    from tactbench.core.files import replace_file
    from tactbench.core.tables.csv_text import csv_of_records

    try:
        folder.mkdir(parents=True, exist_ok=True)
        replace_file(folder / "twin.csv", csv_of_records(records).encode())
        replace_file(folder / "twin.json", (json.dumps(records, indent=1, ensure_ascii=False) + "\n").encode())
        if points:
            draw(points, study.title, [folder / "twin.png", folder / "twin.pdf"])
    except OSError as error:
        raise UnwritableError(
            f"{folder} cannot be written: {error}.", hint="Give another folder with --out."
        ) from error
    remark(f"Files: {folder}/twin.csv, .json{', .png, .pdf' if points else ''}")
