"""Recordings of arrays in memory: what ``tactbench.from_arrays`` gives."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from tempfile import mkdtemp
from typing import Any
from weakref import finalize

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from tactbench.core.errors import TactbenchError, UsageError, complaint, wrong
from tactbench.core.plugins.registry import installed
from tactbench.core.recording.mapping.files import RawRecording
from tactbench.core.recording.mapping.importing import import_arrays
from tactbench.core.recording.mapping.model import Mapping
from tactbench.core.recording.mapping.table import ArrayTable
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.task import ChannelTarget, LabelTarget, VectorTarget
from tactbench.core.spec.units import parse
from tactbench.recordings import Recording


def from_arrays(
    X: Any,
    y: Any,
    *,
    time_s: Any = None,
    groups: Any = None,
    sensor: str = "arrays",
    task: str = "target",
    unit: str | None = None,
    simulated: bool = True,
) -> list[Recording]:
    """Return arrays as recordings, checked as imported ones are; their files last as long as these objects.

    Parameters
    ----------
    X
        (n, channels) readings, or a DataFrame, whose columns that are not named below are readings. NaN is no sample.
    y
        (n,) numbers, (n, d) vectors, or (n,) classes: texts, truth values, or numbers of an integer type. NaN is no
        answer. Of a DataFrame the name of a column, or a list of names; `time_s` and `groups` alike.
    time_s
        (n,) seconds, rising within each group; None: there is no clock.
    groups
        (n,) the session of each row, each a recording; None: all rows are one.
    sensor
        A name: lower case, digits, - and _.
    task
        What `y` answers: the name of an installed task, or a new name.
    unit
        Of `y`; None: the task's, or 1.
    simulated
        Whether rows are marked SIM and ranked with no measured ones; False where a real sensor was read.

    Raises
    ------
    UsageError
        If an argument cannot be used.
    MappingError
        If a channel has no sample, or the arrays are otherwise none that could be imported.
    """
    frame: Any = X if hasattr(X, "columns") else None
    if np.ndim(X) != 2 or not len(X):
        raise wrong("X", X, "an array (n, channels) of numbers, or a DataFrame")
    named: list[str] = []

    def column(argument: str, given: Any) -> npt.NDArray[Any]:
        names = given if isinstance(given, list) else [given]
        if frame is not None and all(isinstance(name, str) and name in frame.columns for name in names):
            named.extend(names)
            return np.asarray(frame[given])
        found = np.asarray(given)
        if found.shape[:1] != (len(X),) or found.ndim > 1 + (argument == "y"):
            known = "" if frame is None else f", or a name among {', '.join(map(str, frame.columns))}"
            raise wrong(argument, given, f"an array with a value for each of {len(X)} rows of X{known}")
        return found

    def numbers(argument: str, given: Any) -> npt.NDArray[np.float64]:
        try:
            return np.asarray(given, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise wrong(argument, given, f"numbers: {error}") from error

    if not isinstance(task, str):
        raise wrong("task", task, "a name")
    answers, columns = column("y", y), [] if time_s is None else [numbers("time_s", column("time_s", time_s))]
    sessions = np.zeros(len(X), dtype=int) if groups is None else column("groups", groups)
    readings = X if frame is None else frame.drop(columns=named)
    columns = [numbers("X", readings), *columns]
    names = [f"x{at}" for at in range(len(columns[0].T))] if frame is None else list(map(str, readings.columns))
    spec = installed().tasks[task].spec if task in installed().tasks else None
    target = _target(answers, unit) if spec is None else spec.target
    if isinstance(target, SlipTarget):
        raise wrong("task", task, "the name of a task of numbers, vectors or classes, or a new name")
    notes, parts = {}, []
    if isinstance(target, LabelTarget):
        texts, answers = np.unique(_texts(answers), return_inverse=True)
        values = {code: str(text) for code, text in enumerate(texts)}
        notes = {target.name: {"column": len(names) + len(columns) - 1, "values": values}}
    else:
        several = target.components if isinstance(target, VectorTarget) else (target,)
        parts = [(one.name or "y", one.kind, unit or one.unit) for one in several]
    wanted = numbers("y", answers).reshape(len(X), -1)
    if len(wanted.T) != max(len(parts), 1):
        raise wrong("y", y, f"{max(len(parts), 1)} values a row for task {task!r}")
    rows = np.column_stack([*columns, wanted])

    def stream(channels: Sequence[tuple[str, str, str]], first: int, **more: Any) -> dict[str, Any]:
        groups = [{"columns": at, "name": name, "kind": kind, "unit": of, "sentinels": []}
                  for at, (name, kind, of) in enumerate(channels, first)]  # fmt: skip
        return {"table": "rows", "channels": groups, **more}

    streams = {"readings": stream([(name, "taxel", "1") for name in names], 0, annotations=notes)}
    streams |= {"answers": stream(parts, rows.shape[1] - len(parts), of="reference")} if parts else {}
    time = {"column": len(names), "unit": "s", "epoch": "start"} if time_s is not None else None
    declared = {"name": task, "target": target.model_dump(), "splits": ("session", "in-session", "shuffled")}
    try:
        mapping = Mapping.model_validate({
            "version": 1, "title": sensor, "clock": "host" if time else "none", "streams": streams,
            "sensor": {"name": sensor, "title": sensor, "principle": "not stated",
                       "principle_source": {"tag": "assumed", "reference": "arrays given in Python"}},
            "tables": {"rows": {"files": "*", "read": {"format": "csv", "header": False}, "time": time}},
            "recording": {"name": "{name}", "session": "{session}"}, "tasks": [] if spec else [declared],
        })  # fmt: skip
    except (ValidationError, UsageError) as error:
        what = complaint(error) if isinstance(error, ValidationError) else str(error)
        raise UsageError(
            f"sensor={sensor!r}, task={task!r}, unit={unit!r} or the names of X cannot be used: {what}.",
            hint="Names begin with a letter and have letters, digits, - and _; a unit is one of docs/glossary.md.",
        ) from error
    labels, raws = sessions.astype(np.str_), []
    for place, label in enumerate(dict.fromkeys(labels.tolist())):
        table = ArrayTable(f"group {label!r}", rows[labels == label])
        raws.append(RawRecording({"rows": table}, {"session": label, "name": f"group-{place}"}, ("arrays",)))
    about = {"rig": "arrays", "simulated": simulated, "clock": "simulated" if time and simulated else mapping.clock}
    folder = Path(mkdtemp(prefix="tactbench-arrays-"))
    try:
        found = [Recording(path) for path in import_arrays(mapping, raws, folder, **about)]
    except TactbenchError:
        shutil.rmtree(folder)
        raise
    kept = _Kept()
    finalize(kept, shutil.rmtree, folder, ignore_errors=True)
    for one in found:
        one.kept = kept
    return found


class _Kept:
    """What the recordings of one folder refer to: without any of them the folder is removed."""


def _target(answers: npt.NDArray[Any], unit: str | None) -> ChannelTarget | VectorTarget | LabelTarget:
    """Return what a new task asks: a class where answers are no numbers on a continuous scale."""
    if answers.ndim == 1 and answers.dtype.kind != "f":
        return LabelTarget(name="y")
    kind: Any = "force" if unit and parse(unit)[1] == parse("N")[1] else "other"
    if answers.ndim == 1:
        return ChannelTarget(kind=kind, name="y", unit=unit or "1")
    names = tuple(f"y{place}" for place in range(answers.shape[1]))
    return VectorTarget(kind=kind, names=names, unit=unit or "1")


def _texts(answers: npt.NDArray[Any]) -> list[str]:
    """Return classes as texts that are in the order of the values; no text for NaN and None."""
    if answers.dtype.kind in "iu":
        return [f"{one:0{len(str(answers.max()))}d}" for one in answers]
    return ["" if one is None or one != one else str(one) for one in answers.tolist()]
