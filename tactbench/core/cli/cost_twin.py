"""``tactbench cost --twin``: a simulated rig's error against its seconds per recording."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from tactbench.core.plugins.cost import CostPoint, CostStudy

_COLUMNS = ("", "way", "time", "rms", "worst", "unit", "noise / 3", "front")


def show_twin(sensors: tuple[str, ...], rig: str | None, out: Path, shape: str) -> None:
    """Measure the simulated rig `rig` (default: the first) for `sensors`; print `shape`, write files into `out`."""
    from tactbench.core.cli.config import default_matrix
    from tactbench.core.cli.progress import progress
    from tactbench.core.cli.twin import simulated_rig
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_object, load_registry

    registry = load_registry()
    name = simulated_rig(registry, rig)
    where = registry.rigs[name].work_precision
    if where is None:
        raise UsageError(f"The rig {name!r} does not say what its accuracy costs.", hint="Choose another with --rig.")
    asked = [registry.sensors[sensor] for sensor in sensors or default_matrix().sensors]
    points: list[CostPoint] = []
    study: CostStudy | None = None
    with progress() as told:
        for sensor in asked:
            study = load_object(where)(sensor)
            told.begin(sensor.name, study.total)
            for job in study.jobs:
                told.working(job.label)
                points += job.run()
                told.advance(job.label)
    if study is None or not points:
        raise UsageError("There is nothing to measure.", hint="Name a sensor that can be simulated with --sensor.")
    _show(points, study, shape)
    _write(points, study, out)


def _show(points: list[CostPoint], study: CostStudy, shape: str) -> None:
    from tactbench.core.cli.grid import print_grid, print_records
    from tactbench.core.cli.screen import remark
    from tactbench.core.cost.precision import diagrams, precise, verdict

    if shape != "table":
        print_records([record(point) for point in points], shape)
        return
    for (subject, observable), group in diagrams(points).items():
        best = precise(group)
        lines = [_line(point, point in best) for point in group]
        styles = ["bold" if point.default else "" for point in group]
        print_grid(f"{subject}, {observable}: {study.title}", _COLUMNS, lines, styles=styles,
                   numeric=("time", "rms", "worst", "noise / 3"))  # fmt: skip
        click.echo(verdict(group))
    remark(study.reference)


def _line(point: CostPoint, on_front: bool) -> dict[str, str]:
    return {
        "": "default" if point.default else "",
        "way": point.label,
        "time": f"{1e3 * point.seconds:.1f} ms",
        "rms": f"{point.error:.3g}",
        "worst": f"{point.worst:.3g}",
        "unit": point.unit,
        "noise / 3": f"{point.floor / 3:.3g}" if math.isfinite(point.floor) else "",
        "front": "*" if on_front else "",
    }


def record(point: CostPoint) -> dict[str, Any]:
    """Return a point as one flat record; settings last, under their own names."""
    return {
        "sensor": point.subject,
        "observable": point.observable,
        "way": point.label,
        "seconds": point.seconds,
        "error_rms": point.error,
        "error_worst": point.worst,
        "unit": point.unit,
        "noise": point.floor if math.isfinite(point.floor) else None,
        "default": point.default,
        **point.settings,
    }


def _write(points: list[CostPoint], study: CostStudy, folder: Path) -> None:
    import json

    from tactbench.core.cli.grid import csv_text
    from tactbench.core.cli.screen import remark
    from tactbench.core.cost.precision_figure import draw
    from tactbench.core.errors import UnwritableError
    from tactbench.core.matrix.files import replace_file

    records = [record(point) for point in points]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        replace_file(folder / "twin.csv", csv_text(records).encode())
        replace_file(folder / "twin.json", (json.dumps(records, indent=1, ensure_ascii=False) + "\n").encode())
        draw(points, study.title, [folder / "twin.png", folder / "twin.pdf"])
    except OSError as error:
        raise UnwritableError(
            f"{folder} cannot be written: {error}.", hint="Give another folder with --out."
        ) from error
    remark(f"Files: {folder}/twin.csv, .json, .png, .pdf")
