"""The options that say which cells a run computes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.simulation import SIMULATION, simulation_of
from tactbench.core.spec.bounds import MOST_REPEATS

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.matrix import MatrixSpec, TaskChoice

SELECTING = (
    click.option("--sensor", "sensors", multiple=True, metavar="NAME", help="Sensor; repeatable."),
    click.option("--task", "tasks", multiple=True, metavar="NAME", help="Task; repeatable."),
    click.option("--rig", metavar="NAME", help="Rig: twin (default), replay, or one of a rig file."),
    click.option("--recordings", type=click.Path(path_type=Path), metavar="DIR", help="Recordings to replay."),
    click.option("--dataset", "datasets", multiple=True, metavar="NAME",
                 help="Public data set (see `tactbench datasets`) or its mapping file; fetched once; repeatable."),
    click.option("--rig-file", metavar="FILE", help="Devices and links of a rig of real or emulated devices."),
    click.option("--protocol", "protocols", multiple=True, metavar="NAME",
                 help="Evaluation protocol; repeatable. Default: the task's first."),
    click.option("--split", "splits", multiple=True, metavar="NAME",
                 help="Train/test split: roles, session, placement, unit, few-shot, …; repeatable."),
    click.option("--estimator", "estimators", multiple=True, metavar="NAME",
                 help="Estimator; repeatable; `all` for every one that fits."),
    click.option("--config", metavar="FILE", help="Matrix file like benchmarks.yaml, or the name of a packaged one."),
    click.option("--repeats", type=click.IntRange(min=1, max=MOST_REPEATS), metavar="N",
                 help="Number of replicates, each with its own seed. Default: 8 if simulated, else 1."),
    click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Seed of the first replicate."),
    click.option("--probe", is_flag=True, help="Add leakage probes: first frame only, shuffled rows."),
    click.option("--include-incomplete", is_flag=True,
                 help="Let recordings take part that lack more than their rig file allows."),
    *SIMULATION,
)  # fmt: skip
"""Given to `requested_matrix`."""


def requested_matrix(
    registry: Registry,
    *,
    sensors: tuple[str, ...],
    tasks: tuple[str, ...],
    rig: str | None,
    recordings: Path | None,
    datasets: tuple[str, ...],
    rig_file: str | None,
    protocols: tuple[str, ...],
    splits: tuple[str, ...],
    estimators: tuple[str, ...],
    config: str | None,
    repeats: int | None,
    seed: int | None,
    probe: bool,
    include_incomplete: bool,
    effects: str | None,
    settings: tuple[str, ...],
) -> tuple[MatrixSpec, Path | None]:
    """Return the matrix file with the command line's choices laid over it, and the folder of recordings if any.

    Raises
    ------
    UsageError
        If a file, a name or a combination of options is wrong.
    """
    from tactbench.core.cli.config import default_matrix, matrix_called
    from tactbench.core.errors import UsageError
    from tactbench.core.spec.matrix import EstimatorChoice, TaskChoice
    from tactbench.core.spec.rig_file import RigFile
    from tactbench.core.spec.yaml_file import load_yaml

    base = config or ("real" if datasets else None)
    matrix = matrix_called(base) if base else default_matrix()
    change: dict[str, Any] = {"rig": matrix.rig or registry.first_rig("simulated")}
    over: dict[str, Any] = {}
    if datasets and (recordings or rig_file or rig not in (None, registry.first_rig("replays"))):
        raise UsageError("--dataset brings its own recordings.", hint="Leave out --rig, --recordings and --rig-file.")
    if rig or recordings or rig_file or datasets:
        file = load_yaml(Path(rig_file), RigFile) if rig_file else None
        change["rig"] = rig or (file.rig if file else registry.first_rig("replays"))
        change["rig_file"] = rig_file
        if change["rig"] != matrix.rig:
            change["sensors"] = tuple(file.sensors) if file else ()  # the matrix' sensors are those of its own rig
            over["protocol"] = ("deployable",)  # the paper's protocol needs the paper's three roles
    stated = {
        "sensors": tuple(dict.fromkeys(sensors)) or None,
        "repeats": repeats,
        "seed": seed,
        "probe": probe or None,
        "include_incomplete": include_incomplete or None,
    }
    change |= {name: value for name, value in stated.items() if value is not None}
    chosen: list[TaskChoice] = []
    if datasets:
        matrix = matrix.model_copy(update={"tasks": _of_datasets(datasets, tasks, matrix)})
    for name in dict.fromkeys(() if datasets else tasks):
        chosen += [choice for choice in matrix.tasks if choice.name == name] or [TaskChoice(name=name)]
    several = {
        "protocol": tuple(dict.fromkeys(protocols)),
        "split": tuple(dict.fromkeys(splits)),
        "estimators": tuple(EstimatorChoice(name=name) for name in dict.fromkeys(estimators)),
    }
    over |= {name: value for name, value in several.items() if value}
    if recordings:
        over["dataset"] = None
    chosen = [choice.model_copy(update=over) for choice in chosen or matrix.tasks]
    change["tasks"] = tuple(_with_those_beside(chosen, registry))
    matrix = matrix.model_copy(update=change)
    simulation = simulation_of(
        registry, matrix.rig, matrix.sensors, effects=effects, settings=settings, stated=matrix.simulation
    )
    if simulation is not None:
        matrix = matrix.model_copy(update={"simulation": simulation})
    return matrix, recordings or (Path(matrix.recordings) if matrix.recordings else None)


def _of_datasets(datasets: tuple[str, ...], tasks: tuple[str, ...], matrix: MatrixSpec) -> tuple[TaskChoice, ...]:
    """Return what each data set is asked: `tasks`, as the matrix asks them, or else what the data set is for."""
    from tactbench.core.recording.datasets import dataset_called
    from tactbench.core.spec.matrix import TaskChoice

    found = []
    for given, dataset in {given: dataset_called(given) for given in datasets}.items():
        for name in dict.fromkeys(tasks or dataset.source.tasks):
            asked = TaskChoice(name=name, protocol=("deployable",))
            stated = [one for one in matrix.tasks if one.name == name and one.dataset in (None, given, dataset.name)]
            found += [one.model_copy(update={"dataset": given}) for one in stated or [asked]]
    return tuple(found)


def _with_those_beside(choices: list[Any], registry: Registry) -> list[Any]:
    """Return the tasks and those that are to be read beside them, answered in the same way."""
    names = {choice.name for choice in choices}
    found = []
    for choice in choices:
        known = choice.name in registry.tasks
        beside = registry.tasks[choice.name].spec.beside if known else ()  # an unknown name is refused with all others
        found += [choice, *(choice.model_copy(update={"name": name}) for name in beside if name not in names)]
    return found
