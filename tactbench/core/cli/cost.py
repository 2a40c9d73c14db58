"""``tactbench cost``: what accuracy costs in time, of estimators or of the simulated rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.options import RESULTS, format_option
from tactbench.core.tables.terminal import remark

if TYPE_CHECKING:
    from tactbench.core.cost.ladder import Ladder


@click.command(name="cost")
@click.option("--twin", is_flag=True, help="Of the simulated rig instead: error against seconds per recording.")
@click.option("--sensor", "sensors", multiple=True, metavar="NAME", help="Sensor; with --twin repeatable.")
@click.option("--task", metavar="NAME", help="Task; with --twin the task to score with each rung's recordings.")
@click.option("--estimator", "estimators", multiple=True, metavar="NAME",
              help="Estimator; repeatable. Default: every one that fits.")  # fmt: skip
@click.option("--recordings", type=click.Path(path_type=Path), metavar="DIR", help="Recordings to replay.")
@click.option("--protocol", metavar="NAME", help="Evaluation protocol. Default: the task's first.")
@click.option("--rounds", type=click.IntRange(min=1), default=5, show_default=True, metavar="N",
              help="Number of timing rounds.")  # fmt: skip
@RESULTS
@format_option("table", "json", "csv")
def command(
    twin: bool, sensors: tuple[str, ...], task: str | None, estimators: tuple[str, ...], recordings: Path | None,
    protocol: str | None, rounds: int, out: Path, shape: str,
) -> None:  # fmt: skip
    """Measure what accuracy costs in time, and draw it.

    Of estimators: score against fit time and answer delay, for one sensor and task. Of the simulated rig: --twin, error
    in counts against seconds, and with --task what its rungs do to the score. Files go into the folder cost of the
    result folder.
    """
    from tactbench.core.errors import UsageError

    if twin:
        if estimators or recordings or protocol:
            raise UsageError("--twin takes --sensor, --task and --rounds.", hint="Leave the others out.")
        from tactbench.core.cli.cost_twin import show_twin

        show_twin(sensors, out / "cost", shape, rounds=rounds, task=task)
        return
    if len(sensors) != 1 or task is None:
        raise UsageError(
            "Say what the cost is asked of.",
            hint="Of estimators: --sensor NAME --task NAME, one of each. Of the simulated rig: --twin.",
        )
    import time

    from tactbench.core.cli.grid import print_records
    from tactbench.core.cost.ladder import climb
    from tactbench.core.cost.ladder_file import write_ladder
    from tactbench.core.leaderboard.names import METRIC_NAMES
    from tactbench.core.matrix.store import Store
    from tactbench.core.plugins.declared import declared_in, with_declared
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice
    from tactbench.core.study.progress import progress

    registry = with_declared(load_registry(), declared_in(recordings))
    if protocol is None and recordings is not None:
        protocol = "deployable"  # as `run` has it: the paper's protocol needs the paper's three roles
    answerers = tuple(EstimatorChoice(name=name) for name in estimators or ("all",))
    choice = TaskChoice(name=task, protocol=protocol, estimators=answerers)
    rig = registry.first_rig("simulated" if recordings is None else "replays")
    matrix = MatrixSpec(rig=rig, seed=1, repeats=1, sensors=(sensors[0],), tasks=(choice,))
    with progress() as display:
        ladder = climb(
            matrix, registry, Store(out / "cost"), rounds=rounds, clock=time.perf_counter, progress=display,
            recordings=recordings,
        )  # fmt: skip
    if shape == "table":
        _print(ladder)
    else:
        print_records(ladder.rows, shape)
    paths = write_ladder(ladder, out, METRIC_NAMES.get(ladder.about["metric"], ""))
    remark(f"Files: {', '.join(map(str, paths))}")


def _print(ladder: Ladder) -> None:
    from dataclasses import replace

    from tactbench.core.cli.grid import print_tables
    from tactbench.core.report.costs import ladder_table

    about = ladder.about
    kinds = tuple("result" if row["front_fit"] or row["front_delay"] else "" for row in ladder.rows)
    print_tables([replace(ladder_table({**about, "rows": ladder.rows}), kinds=kinds, notes=())])
    if about["load"] is not None and about["load"] > about["cores"]:
        remark(f"The machine was busy (load {about['load']:.1f} on {about['cores']} cores): the times are too long.")
    for text in about["remarks"]:
        remark(f"{text[0].upper()}{text[1:]}.")
    remark("docs/glossary.md says what each column is.")
