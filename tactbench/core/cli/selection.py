"""The options that say which cells a verb is about: those of ``run``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.simulation import SIMULATION, simulation_of
from tactbench.core.spec.bounds import MOST_REPEATS

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.matrix import MatrixSpec

SELECTING = (
    click.option("--sensor", "sensors", multiple=True, metavar="NAME", help="Sensor to test; may be repeated."),
    click.option("--task", "tasks", multiple=True, metavar="NAME", help="Question to ask; may be repeated."),
    click.option("--rig", metavar="NAME", help="What carries out the scenes: twin (default), replay …"),
    click.option("--recordings", type=click.Path(path_type=Path), metavar="DIR", help="Recordings for --rig replay."),
    click.option("--rig-file", metavar="FILE", help="Devices and links of a rig of real or emulated devices."),
    click.option("--protocol", "protocols", multiple=True, metavar="NAME",
                 help="How recordings become X and y; may be repeated. Default: the task's first."),
    click.option("--split", "splits", multiple=True, metavar="NAME",
                 help="What is kept apart: roles, session, placement, unit, few-shot, object …; may be repeated."),
    click.option("--estimator", "estimators", multiple=True, metavar="NAME",
                 help="What answers; may be repeated. all: every one for this kind of question."),
    click.option("--config", metavar="FILE", help="A matrix like benchmarks.yaml, or the name of a packaged one."),
    click.option("--repeats", type=click.IntRange(min=1, max=MOST_REPEATS), metavar="N",
                 help="Replicates: record and answer everything N times, each with another seed. Default: 8 simulated "
                 "ones; of recordings 1, whose sessions are the replicates."),
    click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Seed of the first replicate."),
    click.option("--probe", is_flag=True,
                 help="Also ask what the recordings give away: first frame alone, shuffled rows."),
    click.option("--latency/--no-latency", default=None,
                 help="Measure how long one row takes, up to 0.3 s a cell. Default: yes."),
    *SIMULATION,
)  # fmt: skip
"""Given to `requested_matrix`."""


def requested_matrix(
    registry: Registry,
    *,
    probe: bool,
    recordings: Path | None,
    effects: str | None,
    rung: str | None,
    tolerance: float | None,
    scenario: str | None,
    nuisances: Sequence[str],
    latency: bool | None,
    **selection: Any,
) -> tuple[MatrixSpec, Path | None]:
    """Return the matrix that the options ask for, and the folder of the recordings to replay if there is one.

    Raises
    ------
    UsageError
        If a file, a name or a combination of options is wrong.
    """
    matrix = _matrix(**selection, replaying=recordings is not None)
    chosen = {choice.name for choice in matrix.tasks}
    tasks = []
    for choice in matrix.tasks:
        known = choice.name in registry.tasks
        beside = registry.tasks[choice.name].spec.beside if known else ()  # an unknown name is refused with all others
        more = [choice.model_copy(update={"name": name}) for name in beside if name not in chosen]
        tasks += [choice, *more]  # those that are to be read beside it are answered in the same way
    matrix = matrix.model_copy(update={"tasks": tuple(tasks)})
    simulation = simulation_of(
        registry, matrix.rig, matrix.sensors, effects=effects, rung=rung, tolerance=tolerance, scenario=scenario,
        nuisances=nuisances, stated=matrix.simulation,
    )  # fmt: skip
    if probe:
        matrix = matrix.model_copy(update={"probe": True})
    if latency is not None:
        matrix = matrix.model_copy(update={"latency": latency})
    if simulation is not None:
        matrix = matrix.model_copy(update={"simulation": simulation})
    return matrix, recordings or (Path(matrix.recordings) if matrix.recordings else None)


def _matrix(
    *,
    sensors: tuple[str, ...],
    tasks: tuple[str, ...],
    rig: str | None,
    rig_file: str | None,
    protocols: tuple[str, ...],
    splits: tuple[str, ...],
    estimators: tuple[str, ...],
    config: str | None,
    repeats: int | None,
    seed: int | None,
    replaying: bool,
) -> MatrixSpec:
    """Return the matrix file with the command line's choices laid over it."""
    from tactbench.core.cli.config import default_matrix, matrix_called
    from tactbench.core.spec.matrix import EstimatorChoice, TaskChoice

    matrix = matrix_called(config) if config else default_matrix()
    change: dict[str, Any] = {}
    if rig or replaying or rig_file:
        change["rig"] = rig or (rig_of_file(rig_file) if rig_file else "replay")
        change["rig_file"] = rig_file
    if sensors:
        change["sensors"] = tuple(dict.fromkeys(sensors))
    elif change.get("rig", matrix.rig) != matrix.rig:
        change["sensors"] = ()  # the file's sensors are those of its own rig
    if repeats is not None:
        change["repeats"] = repeats
    if seed is not None:
        change["seed"] = seed
    chosen = list(matrix.tasks)
    if tasks:
        chosen = []
        for name in dict.fromkeys(tasks):
            chosen += [choice for choice in matrix.tasks if choice.name == name] or [TaskChoice(name=name)]
    over: dict[str, Any] = {}
    if protocols:
        over["protocol"] = tuple(dict.fromkeys(protocols))
    elif change.get("rig", matrix.rig) != matrix.rig:
        over["protocol"] = ("deployable",)  # the paper's protocol needs the paper's three roles
    if splits:
        over["split"] = tuple(dict.fromkeys(splits))
    if estimators:
        over["estimators"] = tuple(EstimatorChoice(name=name) for name in dict.fromkeys(estimators))
    change["tasks"] = tuple(choice.model_copy(update=over) for choice in chosen)
    return matrix.model_copy(update=change)


def rig_of_file(file: str) -> str:
    """Return the name of the rig that a rig file is for; raises ConfigError if it is none."""
    from tactbench.core.spec.rig_file import RigFile
    from tactbench.core.spec.yaml_file import load_yaml

    return load_yaml(Path(file), RigFile).rig
