"""Evaluation of cells whose estimator, split, metric, ``fit`` parameters or windows are Python objects."""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from pickle import PicklingError
from typing import Any, NamedTuple

import numpy as np

from tactbench.core.errors import EngineError, UnknownNameError, UsageError, wrong
from tactbench.core.evaluation.folds import PLAIN
from tactbench.core.evaluation.metrics import METRICS, Metric, metric_called
from tactbench.core.evaluation.protocols import is_probe, without_options
from tactbench.core.evaluation.splits import OwnSplit
from tactbench.core.matrix.keys import Keys, Sections
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.solve import Job, Solved, solve, unanswered
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.declared import declared_in
from tactbench.core.plugins.declared import with_declared as with_declared_tasks
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.plugins.registry import installed
from tactbench.core.provenance import gather
from tactbench.core.recording.reader import read_meta
from tactbench.core.spec.row import DIRECTIONS, STOPPED
from tactbench.core.spec.task import TASKS_FILE, TaskSpec
from tactbench.core.study.terminal import progress
from tactbench.recordings import Recordings, opened_as

Row = dict[str, Any]


class Options(NamedTuple):
    """Arguments of :func:`tactbench.evaluate` that may differ between data sets or estimators."""

    protocol: str = "deployable"
    split: Any = None
    groups: Any = None
    metric: Any = None
    greater_is_better: bool | None = None
    params: Mapping[str, Any] | None = None
    window: int | None = None
    step: int = 1
    seed: int = 1


def question(
    task: str | TaskSpec, recordings: Recordings, options: Options
) -> tuple[TaskSpec, str, tuple[Path, ...], dict[str, Any]]:
    """Return the task, its JSON declaration beside the recordings, the files, and the arguments for its folds.

    The JSON is empty for an installed task; the arguments are for :func:`tactbench.core.evaluation.folds.load_task`.
    """
    protocol, split, groups, *_, window, step, seed = options
    for name, given, least in (("window", 1 if window is None else window, 1), ("step", step, 1), ("seed", seed, 0)):
        if not isinstance(given, int | np.integer) or given < least or (name == "step" and given > 1 and not window):
            raise wrong(name, given, f"a whole number, {least} or more{', beside `window`' * (name == 'step')}")
    paths = tuple(one.path for one in opened_as("recordings", recordings))
    folders = {path.parent for path in paths if (path.parent / TASKS_FILE).is_file()}
    registry = with_declared_tasks(installed(), {one: None for each in sorted(folders) for one in declared_in(each)})
    declared = ""
    if isinstance(task, str):
        owned = registry.tasks.owned(task)
        task, declared = owned.descriptor.spec, owned.declared
    if not isinstance(task, TaskSpec):
        raise wrong("task", task, "a name in `tactbench list tasks`, a task declared beside recordings, or a TaskSpec")
    plain = without_options(str(protocol))
    if plain not in task.protocols and not is_probe(plain):
        raise UnknownNameError(f"protocol of task {task.name!r}", str(protocol), task.protocols)
    if split is not None and not isinstance(split, str):
        if not hasattr(split, "split") and not isinstance(split, Iterable):
            raise wrong("split", split, "a name, an object with scikit-learn's `split(X, y, groups)`, or index arrays")
        split = OwnSplit(split, groups)
    elif groups is not None:
        raise wrong("groups", groups, "given only for a splitter object in `split`; groups for `fit` go into `params`")
    return task, declared, paths, {"split": split, "window": window or 0, "step": step, "seed": seed}


class Work(NamedTuple):
    """A cell to be evaluated in this process, with its task and files."""

    cell: Cell
    task: TaskSpec
    paths: tuple[Path, ...]
    how: dict[str, Any]
    """the user's objects, in the form that :func:`solve` takes"""


def cells_of(
    name: str, estimator: str | Estimator, task: str | TaskSpec, recordings: Recordings, options: Options
) -> list[Work]:
    """Return the cell of an estimator, and the cells of the task's trivial estimators."""
    spec, declared, paths, how = question(task, recordings, options)
    given, params = None if isinstance(estimator, str) else estimator, options.params
    scored = metric_of(options.metric, options.greater_is_better, spec)
    if scored.name != spec.metric:  # published figures and equivalence are those of the task's own metric
        unit = spec.unit if {scored.name, spec.metric} == {"rmse", "mae"} else "1"
        spec = spec.model_copy(update={"metric": scored.name, "unit": unit, "equivalence": None, "published": ()})
    if params is not None and (given is None or not isinstance(params, Mapping)):
        raise wrong("params", params, "a mapping of arguments of an object's `fit` to their values")
    if options.window and given is None:
        raise wrong("estimator", estimator, "an object, not a name, if `window` is given")
    cell = Cell(
        sensor=read_meta(paths[0]).sensor.name, task=spec.name, rig="replay", protocol=options.protocol,
        split=getattr(how["split"], "name", how["split"]), estimator=name, params=(), baseline=False, seed=options.seed,
        declared_task=declared,
    )  # fmt: skip
    how |= {"given": None, "metric": scored}
    trivial = [replace(cell, estimator=other, baseline=True) for other in spec.baselines if other != name]
    mine = Work(cell, spec, paths, {**how, "given": given, "fit_params": params or {}})
    return [mine, *(Work(one, spec, paths, how) for one in trivial)]


def metric_of(given: Any, greater_is_better: bool | None, task: TaskSpec) -> Metric:
    """Return the metric of a name, a scikit-learn scorer, or a function of (y, prediction); None: the task's."""
    own, scorer = metric_called(task.metric), given
    found = own if given is None else None
    if isinstance(given, str):
        scorers: Any = import_module("sklearn.metrics")
        found, scorer = METRICS.get(given), scorers.get_scorer(given) if given in scorers.get_scorer_names() else None
    by_prediction = callable(scorer) and getattr(scorer, "_response_method", "predict") == "predict"
    alike = found is not None and (found.kind, found.vector) == (own.kind, own.vector)
    if not alike and (found is not None or own.kind == "events" or not by_prediction):
        takes = "a name of docs/protocols.md or of sklearn.metrics.get_scorer_names(), a scorer of predictions, or a "
        raise wrong("metric", given, f"a metric of {own.kind}: {takes}function of (y, prediction)")
    plain = not alike and not hasattr(scorer, "_score_func")
    if not (isinstance(greater_is_better, bool) if plain else greater_is_better is None):
        takes = "True or False where `metric` is a function, and no value otherwise"
        raise wrong("greater_is_better", greater_is_better, takes)
    if found is not None:
        return found
    function, higher = scorer, bool(greater_is_better)
    if not plain:
        scorer, function, higher = scorer._score_func, partial(scorer._score_func, **scorer._kwargs), scorer._sign > 0
    name = getattr(scorer, "__name__", type(scorer).__name__) + DIRECTIONS[higher]
    return replace(own, name=name, function=function)


def name_of(estimator: str | Estimator) -> str:
    """Return the name of an estimator in tables: its class, or for a pipeline the classes of its steps."""
    if isinstance(estimator, str):
        return estimator
    # Some objects of scikit-learn have no `predict` before `fit`, but their class has it.
    able = (hasattr(estimator, name) or hasattr(type(estimator), name) for name in ("fit", "predict"))
    if isinstance(estimator, type) or not all(able):
        raise wrong("estimator", estimator, "an object with fit(X, y) and predict(X), or an installed estimator's name")
    steps = [type(step).__name__ for _, step in getattr(estimator, "steps", ()) if step not in (None, "passthrough")]
    return "+".join(steps) or type(estimator).__name__


def answered(work: Work) -> Solved:
    """Return the row and the answers of a cell; the states of the global random generators are restored afterwards."""
    described = installed().estimators[work.cell.estimator] if work.how["given"] is None else PLAIN
    states = random.getstate(), np.random.get_state()  # noqa: NPY002  (cells seed this old generator)
    try:
        return solve(Job(work.cell, work.task, described, work.paths, (), "", {}), own=work.how)
    finally:
        random.setstate(states[0])
        np.random.set_state(states[1])  # noqa: NPY002


def ended(work: Work, simulated: bool) -> Solved:
    """Return the row and the answers of a cell, also for a cell that fails."""
    try:
        return answered(work)
    except Exception as error:
        return unanswered(work.cell, work.task, error, simulated=simulated), {}


Estimators = str | Estimator | list[str | Estimator] | tuple[str | Estimator, ...] | Mapping[str, str | Estimator]


def named(estimator: Estimators) -> tuple[list[str], dict[str, Estimator]]:
    """Return the names of installed estimators, and the objects by name; raise UsageError for a repeated name."""
    if not isinstance(estimator, Mapping):
        several = list(estimator) if isinstance(estimator, list | tuple) else [estimator]
        pairs = [(name_of(one), one) for one in several]
    else:
        pairs = list(estimator.items())
    objects = {name: one for name, one in pairs if not isinstance(one, str)}
    names = [one for _, one in pairs if isinstance(one, str)]
    if len(objects) + len(names) < len(pairs) or any(name in installed().estimators for name in objects):
        raise UsageError(
            f"Two estimators have the same name: {', '.join(name for name, _ in pairs)}.",
            hint="Give a mapping of names to objects, with names that no installed estimator has.",
        )
    return names, objects


def side_by_side(work_of: Mapping[str, Mapping[str, Work]], out: Path, jobs: int) -> dict[str, list[Row]]:
    """Return the rows of cells by data set, read from its result folder or computed in one of `jobs` processes."""
    import joblib

    keys, rows = Keys(installed()), {name: dict[str, Row]() for name in work_of}
    todo: list[tuple[str, Work, Store, str, Sections, str]] = []
    with ExitStack() as held, progress() as display:
        for name, works in work_of.items():
            store = held.enter_context(Store(out / name).hold())
            store.begin(gather(installed(), engine="joblib"))
            each = {work.paths for work in works.values()}
            digests = {paths: {path: store.about(path)["digest"] for path in paths} for paths in each}
            for work in works.values():
                work = work._replace(cell=replace(work.cell, timed=jobs == 1))
                try:
                    key, sections = keys.of_given(work.cell, work.task, work.how, digests[work.paths])
                    why = ""
                except ValueError as error:
                    key, sections, why = "", {}, f"computed anew at every run: its source is not known ({error})"
                if (found := store.finished(key)) is None:
                    todo.append((name, work, store, key, sections, why))
                else:
                    rows[name][work.cell.name] = found
        display.begin("evaluating", len(todo))
        calls = (joblib.delayed(_in_place)(place, one[1]) for place, one in enumerate(todo))
        try:
            for place, (row, answers) in joblib.Parallel(jobs, return_as="generator_unordered")(calls):
                name, work, store, key, sections, why = todo[place]
                paths = [store.beside(path) for path in work.paths]
                row |= {"key": key, "recordings": paths, "remarks": [*row["remarks"], *filter(None, [why])]}
                rows[name][work.cell.name] = store.keep(row, sections, answers) if key else row
                display.advance(work.cell.name, stopped=row["status"] in STOPPED)
        except (BrokenProcessPool, PicklingError) as error:
            raise EngineError(
                f"A process that evaluates cells has ended, or objects cannot be sent to it: {error}",
                hint="Finished rows are kept. Give jobs=1 to evaluate the rest in this process.",
            ) from error
    return {name: [rows[name][cell] for cell in works] for name, works in work_of.items()}


def _in_place(place: int, work: Work) -> tuple[int, Solved]:
    """Return a cell's place among the cells to compute, with its row and answers."""
    return place, ended(work, simulated=False)
