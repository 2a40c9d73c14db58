"""``tactbench cost``: what accuracy costs in time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tactbench.core.cli.options import FiniteRange
from tactbench.core.cli.threads import keep_threads
from tactbench.core.spec.bounds import MOST_REPEATS


@click.command(name="cost")
@click.option("--twin", is_flag=True, help="Of the simulated rig instead: error against seconds per recording.")
@click.option("--sensor", "sensors", multiple=True, metavar="NAME", help="Of which sensor; with --twin also several.")
@click.option("--task", metavar="NAME",
              help="Which question the estimators answer; with --twin whose score is looked at, rung by rung (default: "
                   "the tasks of the default matrix).")  # fmt: skip
@click.option("--estimator", "estimators", multiple=True, metavar="NAME",
              help="What answers; may be repeated. Default: every one for this kind of question. With --twin one; "
                   "default: a quick, linear one.")  # fmt: skip
@click.option(
    "--rung",
    "rungs",
    multiple=True,
    metavar="NAME",
    help="With --twin: a rung whose recordings are scored; may be repeated. Default: all but the dearest.",
)
@click.option("--score/--no-score", default=True, help="With --twin: whether rungs are scored at all.")
@click.option("--rig", metavar="NAME", help="What carries out the scenes: twin (default), replay …")
@click.option("--recordings", type=click.Path(path_type=Path), metavar="DIR", help="Recordings for --rig replay.")
@click.option("--protocol", metavar="NAME", help="How recordings become X and y; default: the task's first.")
@click.option("--split", metavar="NAME", help="What is kept apart; default: the task's first that fits.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, metavar="N")
@click.option("--repeats", type=click.IntRange(min=1, max=MOST_REPEATS), default=1, show_default=True, metavar="N",
              help="Replicates that scores are over, five or more for intervals; times are of the first.")  # fmt: skip
@click.option("--rounds", type=click.IntRange(min=1), default=5, show_default=True, metavar="N",
              help="How often everything is timed, turn and turn about.")  # fmt: skip
@click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True, metavar="N",
              help="Threads that estimators and BLAS may use while they are timed.")  # fmt: skip
@click.option("--budget", type=FiniteRange(min=0), default=20.0, show_default=True, metavar="SECONDS",
              help="What took longer once is not timed again in later rounds; its row says so.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR",
              help="Result folder, as of `run`; files and cells go into its folder cost. Default: tactbench-results. "
                   "With --twin: the folder of the files themselves; default: tactbench-results/cost.")  # fmt: skip
@click.option("--format", "shape", type=click.Choice(("table", "json", "csv")), default="table", show_default=True)
def command(
    twin: bool, sensors: tuple[str, ...], task: str | None, rig: str | None, out: Path | None, shape: str, threads: int,
    rungs: tuple[str, ...], score: bool, **options: Any,
) -> None:  # fmt: skip
    """Measure what accuracy costs in time, and draw it.

    Of estimators: score against fit time and answer delay, for one sensor and task. Of the simulated rig: --twin, error
    in counts against seconds, and what its rungs do to the score.
    """
    keep_threads(1 if twin else threads)
    from tactbench.core.errors import UsageError

    if twin:
        from tactbench.core.cli.cost_twin import show_twin

        if len(options["estimators"]) > 1:
            raise UsageError("--twin has one estimator answer.", hint="Give --estimator once.")
        show_twin(
            sensors, rig, out or Path("tactbench-results") / "cost", shape, rounds=options["rounds"], task=task,
            rungs=rungs, estimator=next(iter(options["estimators"]), None), scoring=score, seed=options["seed"],
        )  # fmt: skip
        return
    if rungs or not score:
        raise UsageError("--rung and --no-score belong to --twin.", hint="Leave them out, or add --twin.")
    if len(sensors) != 1 or task is None:
        raise UsageError(
            "Say what the cost is asked of.",
            hint="Of estimators: --sensor NAME --task NAME, one of each. Of the simulated rig: --twin.",
        )
    from tactbench.core.cli.cost_ladder import show_ladder

    show_ladder(
        sensors[0], task, rig=rig, threads=threads, out=out or Path("tactbench-results"), shape=shape, **options
    )
