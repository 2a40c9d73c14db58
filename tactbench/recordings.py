"""Recordings in Python, as ``tactbench.open_recordings`` and ``tactbench.dataset`` return them."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.core.errors import FormatError, MissingRecordingError, UsageError, wrong
from tactbench.core.evaluation.channels import numbers
from tactbench.core.plugins.registry import installed
from tactbench.core.plugins.rigs import rig_of
from tactbench.core.recording.reader import open_recording, read_meta
from tactbench.core.samples import FloatArray, StreamData
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec

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
