"""Recordings in Python, as ``open_recordings``, ``dataset`` and ``from_arrays`` of ``tactbench`` return them."""

from __future__ import annotations

import atexit
import glob
import os
import re
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from tactbench.core.errors import FormatError, MissingRecordingError, UsageError, complaint, wrong
from tactbench.core.evaluation.channels import numbers
from tactbench.core.plugins.registry import installed
from tactbench.core.plugins.rigs import rig_of
from tactbench.core.recording.mapping import model as layout
from tactbench.core.recording.mapping.files import RawRecording
from tactbench.core.recording.mapping.importing import import_arrays
from tactbench.core.recording.mapping.table import Table
from tactbench.core.recording.reader import open_recording, read_meta
from tactbench.core.samples import FloatArray, StreamData
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec
from tactbench.core.spec.task import ChannelTarget, LabelTarget, VectorTarget

if TYPE_CHECKING:
    import pandas
    import xarray

AnyPath = str | os.PathLike[str]


@dataclass(frozen=True, repr=False)
class Stream(StreamData):
    """Channels of a recording with one clock: `data` (n, channels) as stored, `quality`, `t_ns`, `annotations`."""

    start_ns: int = 0
    """Time of the recording's first sample in any stream [ns]."""

    def __repr__(self) -> str:
        return f"<Stream {self.spec.name}: {len(self.data)} rows of {', '.join(one.name for one in self.channels)}>"

    @property
    def channels(self) -> tuple[ChannelSpec, ...]:
        """Return the facts about each channel: name, kind, unit, range, position."""
        return self.spec.channels

    @property
    def time_s(self) -> FloatArray | None:
        """Return (n,) times since the recording's first sample [s]; None if the stream has no clock."""
        return None if self.t_ns is None else np.asarray((self.t_ns - self.start_ns) * 1e-9)


class Recording:
    """A recording, by the `path` of its file. Meta and samples are read at first use and kept; no file stays open."""

    def __init__(self, path: AnyPath) -> None:
        self.path = Path(path)

    def __repr__(self) -> str:
        return f"<Recording {self.meta.name}: {self.sensor.name}>"

    @cached_property
    def meta(self) -> RecordingMeta:
        """Metadata of the recording; raises FormatError if the file is no recording."""
        return read_meta(self.path)

    @property
    def sensor(self) -> SensorSpec:
        """Return the complete specification of the sensor."""
        return self.meta.sensor

    @cached_property
    def streams(self) -> Mapping[str, Stream]:
        """Streams with data, by name: first those of the sensor, then those of the reference."""
        with open_recording(self.path) as file:
            read = {name: file.read(name) for name in file.stream_names}
        start_ns = min((int(one.t_ns[0]) for one in read.values() if one.t_ns is not None and len(one.t_ns)), default=0)
        return {name: Stream(**vars(one), start_ns=start_ns) for name, one in read.items()}

    @property
    def reference(self) -> Mapping[str, Stream]:
        """Return the streams of other devices than the sensor: force-torque sensor, probe."""
        names = {spec.name for spec in self.meta.reference}
        return {name: stream for name, stream in self.streams.items() if name in names}

    def to_dataframe(self, stream: str | None = None) -> pandas.DataFrame:
        """Return a stream (None: the sensor's first) as a pandas DataFrame: a column for each channel, then row labels.

        NaN: no sample. Raises FormatError if there is no such stream, UsageError if pandas is not installed.
        """
        pd, one = library("pandas"), self._stream(stream)
        index = None if one.time_s is None else pd.Index(one.time_s, name="time_s")
        columns = dict(zip((channel.name for channel in one.channels), numbers(one).T, strict=True))
        return pd.DataFrame({**columns, **one.annotations}, index=index)

    def to_xarray(self, stream: str | None = None) -> xarray.Dataset:
        """Return a stream as an xarray Dataset with time and channel coordinates.

        It equals ``xarray.open_dataset(path, group="streams/NAME", engine="h5netcdf")``, with the addition of labels
        of rows and units of channels. Errors are as in :meth:`to_dataframe`; UsageError if xarray is not installed.
        """
        xr, one = library("xarray"), self._stream(stream)
        rows, times = ("row", np.arange(len(one.data))) if one.t_ns is None else ("t_ns", one.t_ns)
        found: dict[str, Any] = {name: (rows, values) for name, values in one.annotations.items()}
        found["data"] = ((rows, "channel"), one.data)
        if one.quality is not None:
            found["quality"] = ((rows, "channel"), one.quality)
        names, units = zip(*((channel.name, channel.unit) for channel in one.channels), strict=True)
        coordinates = {rows: times, "channel": list(names), "unit": ("channel", list(units))}
        coordinates |= {} if one.time_s is None else {"time_s": (rows, one.time_s)}
        made: xarray.Dataset = xr.Dataset(found, coordinates)
        return made

    def _stream(self, name: str | None) -> Stream:
        found = self.streams.get(next(iter(self.streams), "") if name is None else name)
        if found is None:
            raise FormatError(f"{self.path} has no stream {name!r}.", hint=f"Its streams: {', '.join(self.streams)}.")
        return found


def library(name: str) -> Any:
    """Import and return an optional library; raise UsageError if it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        raise UsageError(
            f"The call needs {name}, which cannot be imported: {error}.", hint=f"Install it with `pip install {name}`."
        ) from error


Recordings = Recording | AnyPath | Iterable[Recording | AnyPath]
"""Recordings as arguments of functions: results of :func:`open_recordings`, files, folders or globs, one or several."""


def open_recordings(path_or_paths: Recordings) -> list[Recording]:
    """Open recordings; their samples are read at first use.

    Parameters
    ----------
    path_or_paths
        A file, a folder (with all folders below it), a glob such as ``"recordings/**/*.h5"``, or several of these.

    Returns
    -------
    list of Recording
        Each file once; files of a folder or a glob are in order of their paths. MissingRecordingError: no file.
    """
    return opened_as("path_or_paths", path_or_paths)


def opened_as(argument: str, given: Recordings) -> list[Recording]:
    """Return the recordings given as the argument `argument`, as :func:`open_recordings` does."""
    if isinstance(given, Recording):
        return [given]
    takes = "recordings, files, folders or globs, one or several"
    if not isinstance(given, str | os.PathLike):
        several = given if isinstance(given, Iterable) else ()
        if found := list({one.path: one for each in several for one in opened_as(argument, each)}.values()):
            return found
        raise wrong(argument, given, takes)
    path = Path(given).expanduser()
    if path.is_dir():
        replay: Any = rig_of("replay", installed(), path)
        return [Recording(one) for one in replay.recordings()]
    if path.is_file():
        return [Recording(path)]
    paths = sorted(glob.glob(str(path), recursive=True))  # noqa: PTH207  (it takes absolute ones too)
    if not paths:
        raise MissingRecordingError(f"{argument}={str(given)!r}: there is no such file.", hint=f"Give {takes}.")
    return opened_as(argument, paths)


def dataset(name: str, root: AnyPath | None = None) -> list[Recording]:
    """Return the recordings of a public data set; missing files are fetched, checked, imported and kept.

    Parameters
    ----------
    name
        Name of a data set in ``tactbench datasets``, or a mapping file that states its source.
    root
        Folder that contains, itself or in a sub-folder, a copy of the files.

    Raises
    ------
    UnknownNameError
        If there is no data set of that name.
    MissingRecordingError, NotApplicable
        If a file cannot be fetched, has the wrong checksum, or has no public address.
    """
    from tactbench.core.recording.datasets import dataset_called

    for argument, given, types in (("name", name, str), ("root", root, str | os.PathLike | None)):
        if not isinstance(given, types):
            raise wrong(argument, given, "a name" if argument == "name" else "a folder")
    return open_recordings(dataset_called(name).recordings(None if root is None else Path(root)))


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
        mapping = layout.Mapping.model_validate({
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
