"""``tactbench cost``: the time that accuracy costs, for estimators or for the simulated rig."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tactbench.core.cli.grid import print_records, print_tables
from tactbench.core.cli.options import JOBS, RESULTS, format_option, options
from tactbench.core.cost.knobs import measure, quick_estimator, settings_of, simulations_of
from tactbench.core.errors import UsageError
from tactbench.core.matrix.run import EngineChoice
from tactbench.core.plugins.declared import declared_in, with_declared
from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.figures.trade import trade_table, write_trade
from tactbench.core.spec.bounds import MOST_REPEATS
from tactbench.core.spec.matrix import REPLICATES, MatrixSpec, TaskChoice
from tactbench.core.study.progress import progress
from tactbench.core.study.shipped import matrix_called
from tactbench.core.tables.terminal import remark


@click.command(name="cost")
@options(
    click.option("--twin", is_flag=True, help="Vary the solver and tolerance of the simulated rig instead."),
    click.option("--sensor", "sensors", multiple=True, metavar="NAME", help="Sensor; with --twin repeatable."),
    click.option("--task", metavar="NAME", help="Task. Default with --twin: the first of benchmarks.yaml."),
    click.option("--estimator", "estimators", multiple=True, metavar="NAME",
                 help="Estimator; repeatable: the first is varied. Default: the task's first; --twin: a quick one."),
    click.option("--recordings", type=click.Path(path_type=Path), metavar="DIR", help="Recordings to replay."),
    click.option("--protocol", metavar="NAME", help="Evaluation protocol. Default: the task's first."),
    click.option("--repeats", type=click.IntRange(min=1, max=MOST_REPEATS), metavar="N",
                 help=f"Number of replicates. Default: {REPLICATES} if simulated, else 1."),
    JOBS,
    RESULTS,
)  # fmt: skip
@format_option("table", "json", "csv")
def command(
    twin: bool, sensors: tuple[str, ...], task: str | None, estimators: tuple[str, ...], recordings: Path | None,
    protocol: str | None, repeats: int | None, jobs: int | None, out: Path, shape: str,
) -> None:  # fmt: skip
    """Measure scores against times for varied settings, and draw the figure.

    One setting after another is varied: trees, window, sampling rate, training sessions, estimators; with --twin the
    solver (rung) and the tolerance of the simulation. Files are written into the folder cost of the result folder;
    finished cells there are reused.
    """
    if not twin and (task is None or len(sensors) != 1):
        raise UsageError(
            "One sensor and one task are expected, or --twin.",
            hint="For estimators, give --sensor NAME --task NAME, each once; for the simulated rig, give --twin.",
        )
    task = task or matrix_called().tasks[0].name
    folder = out / "cost"
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
