"""Conversion of arrays in memory into recordings."""

from __future__ import annotations

import atexit
import re
import shutil
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from tactbench.core.errors import UsageError, complaint, wrong
from tactbench.core.plugins.registry import installed
from tactbench.core.recording.mapping.files import RawRecording
from tactbench.core.recording.mapping.importing import import_arrays
from tactbench.core.recording.mapping.model import Mapping
from tactbench.core.recording.mapping.table import Table
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.task import ChannelTarget, LabelTarget, VectorTarget
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
    """Return arrays as recordings, checked like imported recordings; their files exist as long as this process.

    Parameters
    ----------
    X
        (n, channels) readings, or a DataFrame; its columns not named by other arguments are readings. NaN: no sample.
    y
        (n,) numbers, (n, d) vectors, or (n,) classes: texts, truth values, or numbers of an integer type. NaN: no
        answer. If `X` is a DataFrame, a column's name or a list of names; likewise `time_s` and `groups`.
    time_s
        (n,) times, ascending within each group [s]; None: there is no clock.
    groups
        (n,) session of each row; each session becomes a recording. None: all rows are one recording.
    sensor
        Name of the sensor: lower-case letters, digits, - and _.
    task
        Name of an installed task whose target `y` is, or a new name.
    unit
        Unit of `y`; None: the unit of the task, or 1 for a new task.
    simulated
        True if rows are marked SIM and not ranked against measured rows; False for readings of a real sensor.

    Raises
    ------
    UsageError
        If an argument is not valid.
    MappingError
        If a channel has no sample at all, or the arrays cannot be imported for another reason.
    """
    given: Any
    frame: Any = X if hasattr(X, "columns") else None
    for argument, given, kind in (("unit", unit, str | None), ("simulated", simulated, bool)):
        if not isinstance(given, kind):
            raise wrong(argument, given, f"a value of type {kind}")
    if np.ndim(X) != 2 or not len(X):
        raise wrong("X", X, "an array (n, channels) of numbers, or a DataFrame")
    used: list[str] = []
    columns: dict[str, npt.NDArray[Any]] = {"groups": np.zeros(len(X), dtype=int)}
    for argument, given in (("y", y), ("time_s", time_s), ("groups", groups)):
        if given is None and argument != "y":
            continue
        names = given if isinstance(given, list) else [given]
        named = frame is not None and all(isinstance(name, str) and name in frame.columns for name in names)
        used += names if named else []
        columns[argument] = found = np.asarray(frame[given] if named else given)
        gaps = argument != "y" and ((found != found).any() or found.dtype.kind in "mM")  # a date is no number
        if found.shape[:1] != (len(X),) or found.ndim > 1 + (argument == "y") or gaps:
            known = "" if frame is None else f", or a name among {', '.join(map(str, frame.columns))}"
            what = "seconds" if argument == "time_s" else "a value"
            raise wrong(argument, given, f"{what} for each of {len(X)} rows of X{known}")
    readings = X if frame is None else frame.drop(columns=used)
    called = range(np.shape(X)[1]) if frame is None else readings.columns
    channels = [re.sub(r"[^\w.-]+", "_", str(one), flags=re.ASCII) for one in called]
    channels = [one if one[:1].isalpha() else f"x{one}" for one in channels]
    spec = installed().tasks[task].spec if task in installed().tasks else None
    target = _target(columns["y"], unit) if spec is None else spec.target
    notes, parts = {}, []
    if isinstance(target, LabelTarget):
        texts, columns["y"] = np.unique(_texts(columns["y"]), return_inverse=True)
        notes = {target.name: {"column": 0, "values": dict(enumerate(texts.tolist()))}}
    elif isinstance(target, SlipTarget):
        raise wrong("task", task, "the name of a task that predicts numbers, vectors or classes, or a new name")
    else:
        several = target.components if isinstance(target, VectorTarget) else (target,)
        parts = [(one.name or "y", one.kind, unit or one.unit) for one in several]
    numbers: list[npt.NDArray[np.float64]] = []
    for argument, given in (("y", columns["y"]), ("X", readings), ("time_s", columns.get("time_s"))):
        try:
            numbers += [] if given is None else [np.asarray(given, dtype=np.float64).reshape(len(X), -1)]
        except (TypeError, ValueError) as error:
            raise wrong(argument, given, f"numbers ({error})") from error
        if np.isinf(numbers[-1]).any():
            raise wrong(argument, given, "finite numbers, or NaN for rows without a number")
    if numbers[0].shape[1] != max(len(parts), 1):
        raise wrong("y", y, f"{max(len(parts), 1)} values for each row, as task {task!r} expects")
    rows = np.column_stack(numbers)
    streams = {"readings": {"table": "rows", "annotations": notes, "channels": [
        _channel(place, name, "taxel", "1") for place, name in enumerate(channels, numbers[0].shape[1])]}}  # fmt: skip
    if parts:
        answers = [_channel(place, *part) for place, part in enumerate(parts)]
        streams["answers"] = {"table": "rows", "of": "reference", "channels": answers}
    time = None if time_s is None else {"column": rows.shape[1] - 1, "unit": "s", "epoch": "start"}
    own = {"name": task, "target": target.model_dump(), "splits": ("session", "in-session", "shuffled")}
    source = {"tag": "assumed", "reference": "arrays given in Python"}
    try:
        mapping = Mapping.model_validate({
            "version": 1, "title": sensor, "clock": "host" if time else "none", "streams": streams,
            "sensor": {"name": sensor, "title": sensor, "principle": "not stated", "principle_source": source},
            "tables": {"rows": {"files": "*", "read": {"format": "csv", "header": False}, "time": time}},
            "recording": {"name": "{name}", "session": "{session}"}, "tasks": [] if spec else [own],
        })  # fmt: skip
    except ValidationError as error:
        raise UsageError(
            f"sensor={sensor!r}, task={task!r}, unit={unit!r} or a name in X is not valid: {complaint(error)}.",
            hint="Use names of letters, digits, - and _ that begin with a letter.",
        ) from error
    labels, raws = columns["groups"].astype(np.str_), []
    for place, label in enumerate(dict.fromkeys(labels.tolist())):
        mine: dict[int | str, Any] = dict(enumerate(rows[labels == label].T))
        table = Table(f"group {label!r}", tuple(mine), range(int((labels == label).sum())), mine)
        raws.append(RawRecording({"rows": table}, {"session": label, "name": f"group-{place}"}, ("arrays",)))
    about = {"rig": "arrays", "simulated": simulated, "clock": "simulated" if time and simulated else mapping.clock}
    folder = Path(mkdtemp(prefix="tactbench-arrays-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return [Recording(path) for path in import_arrays(mapping, raws, folder, **about)]


def _channel(place: int, name: str, kind: str, unit: str) -> dict[str, Any]:
    return {"columns": place, "name": name, "kind": kind, "unit": unit, "sentinels": ()}


def _target(answers: npt.NDArray[Any], unit: str | None) -> ChannelTarget | VectorTarget | LabelTarget:
    """Return the target of a new task: a channel for floats and vectors, else a label."""
    if answers.ndim == 1 and answers.dtype.kind != "f":
        return LabelTarget(name="y")
    kind: Any = "force" if unit in ("N", "mN", "kN") else "other"
    if answers.ndim == 1:
        return ChannelTarget(kind=kind, name="y", unit=unit or "1")
    names = tuple(f"y{place}" for place in range(answers.shape[1]))
    return VectorTarget(kind=kind, names=names, unit=unit or "1")


def _texts(answers: npt.NDArray[Any]) -> list[str]:
    """Return classes as texts whose alphabetical order is that of the values; NaN and None become empty texts."""
    if answers.dtype.kind in "iu":
        return [f"{one:0{len(str(answers.max()))}d}" for one in answers]
    return ["" if one is None or one != one else str(one) for one in answers.tolist()]
