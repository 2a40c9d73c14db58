"""Tasks, scores and results in Python; :func:`evaluate` computes the same row as a cell of a run."""

from __future__ import annotations

import math
import os
import shutil
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from tactbench import scoring
from tactbench.core.errors import NotApplicable, UnknownNameError, UsageError, complaint, wrong
from tactbench.core.evaluation.folds import TaskData
from tactbench.core.evaluation.folds import load_task as folds_of
from tactbench.core.evaluation.metrics import Metric
from tactbench.core.evaluation.splits import OwnSplit
from tactbench.core.files import named_file
from tactbench.core.leaderboard.formats import best, grids, records, write_tables
from tactbench.core.leaderboard.names import grouped
from tactbench.core.leaderboard.pairwise import PairwiseComparison, comparisons, record_of, tables_of
from tactbench.core.leaderboard.table import Block, Table, build_table, over_all
from tactbench.core.matrix.plan import cell_of
from tactbench.core.matrix.solve import read_dataset, unanswered
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.declared import with_declared_of
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.plugins.registry import installed
from tactbench.core.provenance import usable_cores
from tactbench.core.samples import Answers
from tactbench.core.spec.task import TaskSpec, VectorTarget
from tactbench.core.statistics.replicates import against_reference, over_replicates
from tactbench.core.study.files import opened, shown_rows, table_of
from tactbench.core.study.study import Study, carry_out
from tactbench.core.tables.markup import html
from tactbench.core.tables.terminal import plain_text
from tactbench.core.tables.text import TextTable, visible
from tactbench.recordings import AnyPath, Recordings, library, open_recordings, opened_as

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

Row = dict[str, Any]


def load_task(
    task: str | TaskSpec,
    recordings: Recordings,
    protocol: str = "deployable",
    split: Any = None,
    *,
    groups: Any = None,
    window: int | None = None,
    step: int = 1,
    seed: int = 1,
) -> TaskData:
    """Return the data of a task on recordings as `X`, `y`, `groups`, `feature_names` and `folds`.

    Parameters
    ----------
    task
        Name of a task that is installed or declared beside the recordings, or a task's spec.
    recordings
        Recordings from :func:`open_recordings`, or files, folders or globs.
    protocol
        Name of the protocol by which recordings become rows; see docs/protocols.md.
    split
        Name of a split; an object with scikit-learn's ``split(X, y, groups)``; or pairs of index arrays (train, test)
        over the rows of `X`. None: the task's first split that the recordings can serve.
    groups
        Groups for a splitter and for intervals: the name of a label of the recordings (session, object …), or an array
        (n,). None: no interval is computed.
    window, step
        Rows of a window, and rows from one window to the next (1). `X` is then (n, window, features): each window lies
        in one recording and in one fold, and has the label of its last row. Training windows that share a row with a
        test window are left out of that fold.
    seed
        Seed of split ``shuffled``.

    Returns
    -------
    TaskData
        `X` (n, features), `y` (n,) or (n, components), `groups` (n,), `feature_names`, and `folds`, index arrays that
        scikit-learn takes as `cv`. `X` is not scaled, and no row is dropped for its value: :func:`evaluate` does that
        on each fold's training rows. Classes in `y` are indices into ``data.classes``.

    Raises
    ------
    UsageError
        If an argument is not valid, or the recordings cannot be divided by the split.
    DataError
        If no row is left to evaluate; NotApplicable (a DataError) if the recordings lack data that the task needs.
    """
    options = scoring.Options(protocol, split, groups, window=window, step=step, seed=seed)
    spec, _, paths, how = scoring.question(task, recordings, options)
    return folds_of(spec, read_dataset(spec, paths), protocol, **how)


class Rows(list[dict[str, Any]]):
    """Rows as mappings, printed as the text of `tables`."""

    def __init__(self, rows: Iterable[dict[str, Any]], tables: Sequence[TextTable]) -> None:
        super().__init__(rows)
        self.tables = tuple(tables)

    def __repr__(self) -> str:
        return plain_text(self.tables, shutil.get_terminal_size((120, 24)).columns).rstrip() or "no rows"

    def _repr_html_(self) -> str:
        return html(self.tables)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas DataFrame with one line for each row; raise UsageError if pandas is not installed."""
        found: pandas.DataFrame = library("pandas").DataFrame(list(self))
        return found


class Results(Rows):
    """Rows of results, one for each cell over its replicates, in the order of the leaderboard.

    A row has the keys of ``tactbench leaderboard --format json`` (docs/results.md).
    """

    def __init__(self, table: Table) -> None:
        of = ({"data": line.row["data"]} if "data" in line.row else {} for line in table.lines)
        rows = (data | row for data, (row, _) in zip(of, records(table), strict=True))
        super().__init__(rows, [*grids(table), *table.sections])
        self.table = table

    def best(self, count: int = 1) -> Results:
        """Return the first `count` rows for each sensor and question, with their ranks among all rows."""
        return Results(best(self.table, count))

    def compare(self, a: str, b: str, task: str | None = None) -> Rows:
        """Compare two sensors, estimators, protocols or splits replicate by replicate, as ``tactbench compare`` does.

        Raises UnknownNameError if no data set has rows of both names, or if they are names of different kinds.
        """
        found: list[PairwiseComparison] = []
        unknown = UnknownNameError("row", a, ())
        for rows in grouped(self.table.rows, lambda row: row.get("data")).values():
            try:
                found += comparisons(rows, a, b, task)
            except UnknownNameError as error:
                unknown = error
        if not found:
            raise unknown
        return Rows(map(record_of, found), tables_of(found))


class Result(Results):
    """The score of one estimator, with the scores of the task's trivial estimators as further rows.

    Attributes
    ----------
    score
        Metric over the pooled test rows of all folds.
    interval
        Interval of the score over the units that the split holds out (``row["ci_method"]``); the upper end is infinite
        if open. None for fewer than five units, whose own scores are in ``row["replicate_scores"]``.
    trivial
        Scores of the task's trivial estimators by name; None for an estimator that failed.
    fold_scores
        Scores by name of the fold, in the order of ``load_task(...).folds``.
    row
        The estimator's row: metric, unit, times, remarks …
    answers
        True values and predictions for the test rows, as arrays; classes are indices.
    """

    def __init__(
        self, rows: Sequence[Row], answers: Answers, task: TaskSpec, names: Sequence[str], metric: Metric
    ) -> None:
        rows = over_replicates(rows)
        super().__init__(build_table(rows, questions={task.name: task.question}))
        row, *others = map(against_reference, rows)  # as scikit-learn scores the rows of `load_task`
        self.score: float = row["score"]
        self.interval: tuple[float, float] | None = None
        if row["ci_low"] is not None:
            self.interval = row["ci_low"], math.inf if row["ci_high"] is None else row["ci_high"]
        self.trivial = {str(one["estimator"]): one["score"] for one in others}
        self.fold_scores = {name.removeprefix("fold "): row["scores"].get(name) for name in row["fold_sizes"]}
        self.row, self.answers, self._names, self._metric = row, answers, names, metric
        self._components = task.target.names if isinstance(task.target, VectorTarget) else ()

    @property
    def recording_scores(self) -> dict[str, float]:
        """Return the score over the test rows of each recording, by its name; NaN if the metric is undefined."""
        one, found = self.answers, {}
        with np.errstate(all="ignore"):
            for place in np.unique(one.recording):
                mine = one.recording == place
                score = self._metric.of(one.y_true[mine], one.y_pred[mine], len(self.row["classes"]))
                found[self._names[place]] = score
        return found

    @property
    def predictions(self) -> pandas.DataFrame:
        """Return a pandas DataFrame with one line for each test row; raise UsageError if pandas is not installed.

        Its columns are recording, row (place in the recording), time_s, fold (name), y_true and y_pred: class labels,
        numbers, or a column for each component of a vector.
        """
        one, labels = self.answers, np.asarray(self.row["classes"])
        found = {"recording": np.asarray(self._names)[one.recording]}
        found |= {"row": one.row, "time_s": one.time_s, "fold": np.asarray(list(self.fold_scores))[one.fold]}
        for name, values in (("y_true", one.y_true), ("y_pred", one.y_pred)):
            if values.ndim > 1:
                found |= {f"{name}_{part}": column for part, column in zip(self._components, values.T, strict=True)}
            else:
                found[name] = labels[values] if len(labels) else values
        frame: pandas.DataFrame = library("pandas").DataFrame(found)
        return frame

    def plot(self) -> Figure:
        """Return a figure of predictions against true values, one panel for each component, or a confusion matrix.

        Raises NotApplicable for events, whose figure is part of ``tactbench report``.
        """
        from matplotlib.figure import Figure
        from sklearn.metrics import ConfusionMatrixDisplay, PredictionErrorDisplay

        if self.row["events"]:
            raise NotApplicable("No figure is available for events.", hint="See row['events'].")
        frame, names = self.predictions, [name for name in self.predictions if name.startswith("y_true")]
        figure = Figure(figsize=(4.5 * len(names), 4.5), layout="constrained")
        for name, axes in zip(names, figure.subplots(1, len(names), squeeze=False)[0], strict=True):
            part, unit = name.removeprefix("y_true").replace("_", " "), self.row["unit"]
            drawn = {"y_true": frame[name], "y_pred": frame[name.replace("true", "pred")], "ax": axes}
            if self.row["confusion"]:
                more = {"values_format": ".2g", "colorbar": False, "xticks_rotation": "vertical", "cmap": "Blues"}
                ConfusionMatrixDisplay.from_predictions(**drawn, normalize="true", **more)
            else:
                kind, points = "actual_vs_predicted", {"s": 4}
                PredictionErrorDisplay.from_predictions(**drawn, kind=kind, subsample=None, scatter_kwargs=points)
                axes.set(xlabel=f"answer{part} [{unit}]", ylabel=f"truth{part} [{unit}]")
        figure.suptitle(f"{self.row['estimator']}: {self.row['metric']} {self.score:.3g}")
        return figure


def evaluate(
    estimator: str | Estimator,
    task: str | TaskSpec,
    recordings: Recordings,
    protocol: str = "deployable",
    split: Any = None,
    *,
    groups: Any = None,
    metric: Any = None,
    greater_is_better: bool | None = None,
    params: Mapping[str, Any] | None = None,
    window: int | None = None,
    step: int = 1,
    seed: int = 1,
) -> Result:
    """Score an estimator on recordings in this process, together with the task's trivial estimators.

    Parameters
    ----------
    estimator
        Any object with scikit-learn's ``fit(X, y)`` and ``predict(X)``, fitted as a copy on each fold, or the name of
        an installed estimator. Classes in `y` are indices.
    task, recordings, protocol, split, groups, window, step
        As in :func:`load_task`.
    metric
        Name of a metric of docs/protocols.md or of a scorer of scikit-learn, such a scorer, or a function of (y,
        prediction). None: the task's metric. Scores of scorers of errors lose their negative sign.
    greater_is_better
        True if a higher value is better, where `metric` is a function.
    params
        Further arguments of ``fit``, as of ``sklearn.model_selection.cross_validate``: arrays (n,), one value for each
        row of ``load_task(...).X`` are cut to the rows of a fold. ``groups`` may be the name of a label. A search of
        parameters by cross-validation is given the split's groups.
    seed
        Seed of intervals, of split ``shuffled``, and of the global generators of ``random`` and numpy, whose states are
        restored afterwards.

    Raises
    ------
    UsageError, DataError
        As in :func:`load_task`.
    PluginContractError
        If a prediction is not finite, or is not a class.
    """
    options = scoring.Options(protocol, split, groups, metric, greater_is_better, params, window, step, seed)
    mine, *trivial = scoring.cells_of(scoring.name_of(estimator), estimator, task, recordings, options)
    data = read_dataset(mine.task, mine.paths)
    row, answers = scoring.answered(mine)
    rows = [row, *(scoring.ended(one, row["simulated"])[0] for one in trivial)]
    counts = Counter(one.name for one in data.metas)
    names = [one.name if counts[one.name] == 1 else str(path) for one, path in zip(data.metas, data.paths, strict=True)]
    return Result(rows, answers["test"], mine.task, names, mine.how["metric"])


def run(
    *,
    sensor: str | Sequence[str] = (),
    task: str | Sequence[str] = (),
    estimator: scoring.Estimators = (),
    recordings: Recordings | None = None,
    out: AnyPath = "tactbench-results",
    data: Mapping[str, Recordings] | None = None,
    estimators: scoring.Estimators = (),
    tasks: str | TaskSpec | Sequence[str | TaskSpec] | Mapping[str, Any] = (),
    **options: Any,
) -> Results:
    """Acquire, evaluate and rank, as ``tactbench run`` does, or score estimators on several data sets.

    Parameters
    ----------
    sensor, task
        Name or names of sensors, and of tasks.
    estimator
        Names and objects with ``fit`` and ``predict``, one or several; a mapping gives objects their names. Beside
        objects, only the tasks' trivial answers are run.
    recordings, out
        Folder of recordings to replay, or all recordings in one folder; the result folder.
    data, estimators, tasks
        Recordings of several data sets by name, estimators as of `estimator`, and one task or several. Each data set
        has its own tables, and a result folder in `out`.
    **options
        Other options of ``tactbench run`` by name, with ``_`` for ``-``: ``protocol="deployable"``, ``repeats=3``,
        ``probe=True``, ``rig_file="rig.yaml"``, ``config="beyond"``; lists for options that may be repeated. With
        `data`: the arguments of :func:`evaluate`, and `jobs`, the number of processes (None: all cores). Each of these,
        and `tasks`, may be a mapping from names of data sets or of estimators: ``split={"pad": GroupKFold(3)}``.

    Notes
    -----
    Named estimators are evaluated in child processes, as by the command, and stored in `out`. Objects are evaluated
    afterwards in this process, on the same recordings, and are in the returned table only. An option or a
    name that is not valid raises UsageError before anything is run.

    With `data` joblib evaluates everything; single answers are timed with ``jobs=1`` only. Rows are reused while
    object, metric, data and code are the same; if this cannot be checked, `remarks` of the row state it.
    """
    if data is not None:
        given = {"sensor": sensor, "task": task, "estimator": estimator, "recordings": recordings}
        if misplaced := [name for name, value in given.items() if value not in ((), None)]:
            raise UsageError(f"`{misplaced[0]}` excludes `data`.", hint="Use `data`, `estimators` and `tasks`.")
        return _over_data(data, estimators, tasks, Path(out), **options)
    names, objects = scoring.named(estimator)
    given = {"sensor": sensor, "task": task, "recordings": _folder(recordings), "out": out, **options}
    if unknown := given.keys() - Study.model_fields:
        raise UnknownNameError("argument of `run`", min(unknown), Study.model_fields)
    try:
        study = Study(estimator=names if names or objects else None, **given)
    except ValidationError as error:
        raise UsageError(f"{complaint(error)}.", hint="See the options in `tactbench run --help`.") from error
    store, outcome = carry_out(study)
    table = table_of(store, over_all(store, outcome.rows))
    write_tables(table, store.folder)
    # The row of a question is a finished one, else a trivial answer's, whose reason is that of the recordings.
    ended = sorted(outcome.rows, key=lambda row: (row["status"] == "done", row["is_baseline"]))
    each = {replace(cell_of(row), estimator="", params=(), baseline=False, timed=True): row for row in ended}
    beside = [_beside(row, name, given, store.folder) for name, given in objects.items() for row in each.values()]
    return Results(table_of(store, over_all(store, [*outcome.rows, *beside])) if beside else table)


def _over_data(
    data: Mapping[str, Recordings],
    estimators: scoring.Estimators,
    tasks: Any,
    out: Path,
    jobs: int | None = None,
    **options: Any,
) -> Results:
    """Return the rows of estimators on several data sets, for :func:`run`."""
    names, objects = scoring.named(estimators)
    every: dict[str, str | Estimator] = {**objects, **dict(zip(names, names, strict=True))}
    if not isinstance(data, Mapping) or not data:
        raise wrong("data", data, "a mapping from names of data sets to recordings")
    if not every:
        raise wrong("estimators", estimators, "objects and names of estimators, at least one")
    if jobs is not None and not (isinstance(jobs, int) and jobs > 0):
        raise wrong("jobs", jobs, "a whole number, 1 or more")
    if unknown := options.keys() - set(scoring.Options._fields):
        raise UnknownNameError("argument of `run` with `data`", min(unknown), ("jobs", *scoring.Options._fields))

    def chosen(value: Any, *of: str) -> Any:
        mapped = isinstance(value, Mapping) and value and value.keys() <= {*data, *every}
        return next((value[name] for name in of if name in value), None) if mapped else value

    work_of: dict[str, dict[str, scoring.Work]] = {name: {} for name in data}
    splits: dict[tuple[Any, ...], OwnSplit] = {}
    for name, recordings in data.items():
        some = chosen(tasks, name)
        if not some:
            raise wrong("tasks", tasks, f"for {name!r} a name of a task or a TaskSpec, or several")
        sensors = grouped(opened_as(f"data[{name!r}]", recordings), lambda one: one.sensor.name).values()
        for task, mine in product([some] if isinstance(some, str | TaskSpec) else some, sensors):
            for called, given in every.items():
                own = {key: chosen(value, called, name) for key, value in options.items()}
                stated = {key: value for key, value in own.items() if value is not None}
                for work in scoring.cells_of(called, given, task, mine, scoring.Options(**stated)):
                    if isinstance(work.how["split"], OwnSplit):  # drawn once, so that all are tested on the same folds
                        of = (name, work.cell.sensor, work.cell.task, work.how["window"], work.how["step"],
                              id(stated["split"]), id(stated.get("groups")))  # fmt: skip
                        if of not in splits:
                            splits[of] = work.how["split"]
                            folds = {key: work.how[key] for key in ("split", "seed", "window", "step")}
                            folds_of(work.task, read_dataset(work.task, work.paths), work.cell.protocol, **folds)
                        work.how["split"] = splits[of]
                    work_of[name].setdefault(work.cell.name, work)
    blocks: list[Block] = []
    for name, rows in scoring.side_by_side(work_of, out, jobs or usable_cores()).items():
        store = Store(out / name)
        table = table_of(store, over_all(store, [{**row, "data": name} for row in rows]))
        write_tables(table, store.folder)
        blocks += [replace(one, title=f"{visible(name)} · {one.title}") for one in table.blocks]
    return Results(replace(table, blocks=tuple(blocks), sections=()))


def results(folder: AnyPath = "tactbench-results") -> Results:
    """Return the rows of a result folder, as ``tactbench leaderboard`` shows them; raise UsageError if it has none."""
    store = opened(Path(folder))
    return Results(table_of(store, shown_rows(store)))


def _folder(recordings: Recordings | None) -> AnyPath | None:
    """Return the folder that a run replays; raise UsageError unless all recordings are in one folder."""
    if recordings is None or isinstance(recordings, str | os.PathLike):
        return recordings
    paths = {one.path for one in open_recordings(recordings)}
    folders = {path.parent for path in paths}
    if len(folders) != 1 or {one.path for one in open_recordings(*folders)} != paths:
        raise UsageError(
            f"A run replays a folder of recordings, but these {len(paths)} are not those of one folder.",
            hint="Give a folder, or use `evaluate`.",
        )
    return folders.pop()


def _beside(row: Row, name: str, given: Estimator, folder: Path) -> Row:
    """Return the row of an estimator object for the question and the recordings of another row."""
    cell = replace(cell_of(row), estimator=name, params=(), baseline=False)
    task = with_declared_of(installed(), [row]).tasks[cell.task].spec
    paths = [folder / named_file(one) for one in row["recordings"]]
    if not paths:  # no cell of this question has finished
        whose = "" if row["status"] == "skipped" else f"{row['estimator']}: "
        return unanswered(cell, task, NotApplicable(f"{whose}{row['reason']}"), simulated=row["simulated"])
    return scoring.ended(scoring.Work(cell, task, tuple(paths), {"given": given}), row["simulated"])[0]
