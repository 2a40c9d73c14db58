"""``tactbench cost``: the time that accuracy costs, for estimators or for the simulated rig."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from tactbench.core.cli.shared import JOBS, RESULTS, format_option, options, print_records, print_tables
from tactbench.core.cost.knobs import (
    Skipped,
    diagrams,
    measure,
    measured,
    precise,
    quick_estimator,
    settings_of,
    simulations_of,
)
from tactbench.core.errors import UsageError
from tactbench.core.files import replace_file, writable
from tactbench.core.matrix.run import EngineChoice
from tactbench.core.plugins.declared import declared_in, with_declared
from tactbench.core.plugins.interfaces import CostPoint, CostStudy
from tactbench.core.plugins.registry import load_object, load_registry
from tactbench.core.report.figures.group import save, styled
from tactbench.core.report.figures.trade import draw_precision, trade_table, write_trade
from tactbench.core.spec.matrix import MOST_REPEATS, REPLICATES, MatrixSpec, TaskChoice
from tactbench.core.study.files import matrix_called
from tactbench.core.study.terminal import progress
from tactbench.core.tables.terminal import remark
from tactbench.core.tables.text import json_text


@click.command(name="cost")
@options(
    click.option("--twin", is_flag=True,
                 help="Measure the simulated rig instead: score against seconds, or without --task its error."),
    click.option("--sensor", "sensors", multiple=True, metavar="NAME", help="Sensor; with --twin repeatable."),
    click.option("--task", metavar="NAME", help="Task."),
    click.option("--estimator", "estimators", multiple=True, metavar="NAME",
                 help="Estimator; repeatable: the first is varied. Default: the task's first; --twin: a quick one."),
    click.option("--recordings", type=click.Path(path_type=Path), metavar="DIR", help="Recordings to replay."),
    click.option("--protocol", metavar="NAME", help="Evaluation protocol. Default: the task's first."),
    click.option("--repeats", type=click.IntRange(min=1, max=MOST_REPEATS), metavar="N",
                 help=f"Number of replicates. Default: {REPLICATES} if simulated, else 1."),
    click.option("--rounds", type=click.IntRange(min=1), default=5, metavar="N",
                 help="Number of timing rounds, for --twin without --task."),
    JOBS,
    RESULTS,
)  # fmt: skip
@format_option("table", "json", "csv")
def command(
    twin: bool, sensors: tuple[str, ...], task: str | None, rounds: int, out: Path, shape: str, **options_given: Any
) -> None:
    """Measure scores against times for varied settings, and draw the figure.

    One setting after another is varied: trees, window, sampling rate, training sessions, estimators; with --twin the
    solver (rung) and the tolerance of the simulation. Files are written into the folder cost of the result folder;
    finished cells there are reused.
    """
    if twin and task is None:
        if any(options_given.values()):
            raise UsageError("--twin without --task takes --sensor and --rounds only.", hint="Leave the others out.")
        _show_twin(sensors, out / "cost", shape, rounds)
        return
    if task is None or (len(sensors) != 1 and not twin):
        raise UsageError(
            "One sensor and one task are expected, or --twin.",
            hint="For estimators, give --sensor NAME --task NAME, each once; for the simulated rig, give --twin.",
        )
    _show_knobs(sensors, task, twin, out / "cost", shape, **options_given)


def _show_knobs(
    sensors: tuple[str, ...], task: str, twin: bool, folder: Path, shape: str, *, estimators: tuple[str, ...],
    recordings: Path | None, protocol: str | None, repeats: int | None, jobs: int | None,
) -> None:  # fmt: skip
    """Measure scores and times with varied settings of an estimator or the simulation; print and write the results."""
    registry = with_declared(load_registry(), declared_in(recordings))
    spec = registry.tasks[task].spec
    rig = registry.rigs[registry.first_rig("simulated" if recordings is None else "replays")]
    if twin and not rig.rungs:
        raise UsageError(f"The rig {rig.name!r} has no solvers of different accuracy.", hint="Leave out --recordings.")
    # As `run` has it: the paper's protocol needs the paper's three roles.
    protocol = protocol or (spec.protocols[0] if recordings is None else "deployable")
    names = estimators or ((quick_estimator(registry, task),) if twin else spec.estimators[:1])
    chosen = [registry.estimators[name] for name in names]
    settings = list(simulations_of(rig, chosen[0], protocol) if twin else settings_of(spec, chosen, protocol))
    repeats = repeats or (REPLICATES if rig.simulated else 1)
    records: list[dict[str, Any]] = []
    for sensor in sensors or matrix_called().sensors:
        matrix = MatrixSpec(rig=rig.name, repeats=repeats, sensors=(sensor,), tasks=(TaskChoice(name=task),))
        choice = EngineChoice(jobs=jobs)
        with progress() as display:
            known = measure(matrix, settings, folder, choice=choice, recordings=recordings, progress=display)
        place = folder / f"{sensor}-{task}{'-twin' if twin else ''}"
        write_trade(known, place)
        remark(f"Files: {place}.json, .png, .pdf")
        if shape == "table":
            print_tables([trade_table(known)])
        records += ({"sensor": sensor, **one} for one in known["settings"])
    if shape != "table":
        print_records(records, shape)


def _show_twin(sensors: Sequence[str], out: Path, shape: str, rounds: int) -> None:
    """Measure errors and times of the simulated rig for `sensors` (default: those of the matrix), in `rounds` rounds.

    The table is printed in the format `shape`; table and figure are written into the folder `out`.
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
    points = [one for one in found if isinstance(one, CostPoint)]
    records = [
        {
            "sensor": one.subject, "observable": one.observable, "setting": one.label, "front": one in precise(group),
            "seconds": one.seconds, "error_rms": one.error, "error_worst": one.worst, "unit": one.unit,
            "noise": one.floor if math.isfinite(one.floor) else None, "reason": "",
        }
        for group in diagrams(points).values()
        for one in group
    ]  # fmt: skip
    nothing = dict.fromkeys(records[0] if records else ())
    records += [{**nothing, "sensor": one.subject, "setting": one.label, "reason": one.reason}
                for one in found if isinstance(one, Skipped)]  # fmt: skip
    print_records(records, shape, title=study.title)
    remark(study.reference)
    with writable(out), styled():
        out.mkdir(parents=True, exist_ok=True)
        replace_file(out / f"{name}.json", (json_text(records, indent=1) + "\n").encode())
        if points:
            save(draw_precision(points, study.title), out / name)
    remark(f"Files: {out / name}.json{', .png, .pdf' if points else ''}")
