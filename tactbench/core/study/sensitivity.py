"""Runs of a task with nuisances at the ends of their ranges, with one result folder for each combination of ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.leaderboard.sensitivity import FOLDER, ends_of, name_of, ranges_of, sensitivities
from tactbench.core.matrix.run import EngineChoice, run_matrix
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.registry import Registry, installed
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.study.study import Study, matrix_of
from tactbench.core.study.terminal import progress
from tactbench.core.tables.terminal import remark

Single = tuple[str, str]
"""Name of a nuisance, and the end of its range: ``lower`` or ``upper``."""
STRONGEST = 3
"""Number of nuisances that are also set in pairs: those with the largest improvement of scores at an end."""


def carry_out_sensitivity(study: Study, nuisances: Sequence[str] = ()) -> list[Row]:
    """Run a task as stated, and with `nuisances` (empty: all) at the ends of their ranges; return rows of failed cells.

    Raises
    ------
    UsageError
        If the rig is not simulated, or a name is unknown.
    """
    registry = installed()
    matrix = matrix_of(study, registry)
    if not registry.rigs[matrix.rig].simulated:
        raise UsageError(f"Nuisances are set on simulated rigs; {matrix.rig} is none.", hint="Use the rig twin.")
    singles = _singles(matrix, registry, nuisances)
    store, choice = Store(study.out), EngineChoice(jobs=study.jobs)
    untimed = matrix.model_copy(update={"latency": False})  # times would be measured with nothing else at work
    with progress() as display:
        stopped = run_matrix(matrix, store, choice=choice, progress=display).failures

        def run(ends: Mapping[str, str]) -> None:
            remark(f"{name_of(ends)}:")
            folder = Store(study.out / FOLDER / name_of(ends))
            for sensor in matrix.sensors:
                own = {one[0]: singles[one][sensor] for one in ends.items() if sensor in singles[one]}
                if not own:
                    continue
                nuisances = tuple(sorted({**dict(matrix.simulation.nuisances), **own}.items()))
                simulation = matrix.simulation.model_copy(update={"nuisances": nuisances})
                part = untimed.model_copy(update={"sensors": (sensor,), "simulation": simulation})
                stopped.extend(run_matrix(part, folder, choice=choice, progress=display).failures)

        for one in singles:
            run(dict([one]))
        for pair in combinations(_strongest(store, {choice.name for choice in matrix.tasks}, set(singles)), 2):
            run(dict(pair))
    return stopped


def _singles(
    matrix: MatrixSpec, registry: Registry, nuisances: Sequence[str]
) -> dict[tuple[str, str], dict[str, float]]:
    """Return values by sensor, for each (nuisance, end) that differs from the stated value, in the nuisance's unit.

    A nuisance that varies between the task's scenes is the subject of the task, and is left out.

    Raises
    ------
    UnknownNameError
        If no sensor states a range of one of `nuisances`.
    """
    scenes = [planned.scene for choice in matrix.tasks for planned in registry.tasks[choice.name].spec.scenes]
    specs = {name: registry.sensors[name].spec.handled(matrix.simulation.scenario) for name in matrix.sensors}
    ranges = {name: ranges_of(spec) for name, spec in specs.items()}
    known = list(dict.fromkeys(nuisance for own in ranges.values() for nuisance in own))
    for nuisance in nuisances:
        if nuisance not in known:
            raise UnknownNameError("nuisance with a range", nuisance, known)
    found: dict[Single, dict[str, float]] = {}
    for nuisance in nuisances or known:
        for sensor, spec in specs.items():
            own = {name: amount.value for name, amount in spec.settable().items()} | dict(matrix.simulation.nuisances)
            stated = {{**scene.nuisances(), **own}.get(nuisance) for scene in scenes}
            for end in ("lower", "upper") if nuisance in ranges[sensor] and len(stated) == 1 else ():
                value = getattr(ranges[sensor][nuisance], end)
                if value not in stated:
                    found.setdefault((nuisance, end), {})[sensor] = value
    return found


def _strongest(store: Store, tasks: set[str], singles: set[Single]) -> list[Single]:
    """Return the (nuisance, end) pairs with the largest improvement of scores among those computed."""
    best: dict[str, tuple[float, str]] = {}
    for one in sensitivities(store).values():
        for name in one.rows:
            ((nuisance, end), *more) = ends_of(name).items()
            if one.task in tasks and (nuisance, end) in singles and not more and one.gain(name) > 0:
                best[nuisance] = max(best.get(nuisance, (0.0, "")), (one.gain(name), end))
    return [(nuisance, best[nuisance][1]) for nuisance in sorted(best, key=lambda one: -best[one][0])[:STRONGEST]]
