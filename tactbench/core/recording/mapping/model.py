"""Models of a mapping file; ``docs/mappings.md`` explains every key with examples."""

from __future__ import annotations

import re
from pathlib import PurePosixPath
from typing import Annotated, Literal
from zoneinfo import ZoneInfo

from pydantic import Field, field_validator, model_validator

from tactbench.core.errors import UsageError
from tactbench.core.spec import units
from tactbench.core.spec.quantity import Frozen, Quantity, Source
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.sensor import ChannelKind
from tactbench.core.spec.task import DeclaredTask

Column = int | str
"""A column is given by its place, counted from 0, or by its name in the header."""

WORD = r"^[a-z][a-z0-9_]*$"
MUST_NAME_SENTINELS = {"force": "N", "torque": "N*m"}
"""Kinds of channels that estimators learn, and the unit to which a channel's unit must convert. A mapping must list the
numbers that mean "no sample" in such channels, as these would be learnt too."""


class Tabular(Frozen):
    """A table of rows and cells; most keys are those of ``pandas.read_csv``."""

    header: bool
    """True: the first line names the columns. False: the file has no such line, and columns are numbered from 0."""
    skiprows: int | tuple[int, ...] = 0
    """Lines to leave out: their number at the beginning of the file, or a list of their places, counted from 0."""
    no_sample: tuple[str, ...] = ()
    """Texts that stand for "no sample" where a cell holds nothing else, for example "" or "NA"."""
    decimal: str = Field(default=".", min_length=1, max_length=1)
    thousands: str | None = Field(default=None, min_length=1, max_length=1)
    """The mark between groups of three digits; None: digits are not grouped."""
    comment: str | None = Field(default=None, min_length=1, max_length=1)
    """The mark that begins a comment, which ends with its line; None: the file has no comments."""

    @model_validator(mode="after")
    def _marks_differ(self) -> Tabular:
        if self.thousands == self.decimal:
            raise ValueError(f"thousands and decimal are both {self.decimal!r}")
        return self


class Csv(Tabular):
    """A text file whose cells are separated by a delimiter."""

    format: Literal["csv"] = "csv"
    delimiter: str = Field(default=",", min_length=1, max_length=1)


class Text(Tabular):
    """A text file whose cells are separated by spaces or tabs."""

    format: Literal["text"] = "text"


class Records(Tabular):
    """A text file in which several lines of numbers make a row; columns are numbered from 0 across these lines."""

    format: Literal["records"] = "records"
    header: Literal[False] = False
    numbers_per_line: tuple[Annotated[int, Field(ge=1)], ...] = Field(min_length=1)


class Xlsx(Tabular):
    """A sheet of an Excel workbook; reading it needs the extra ``[xlsx]``."""

    format: Literal["xlsx"] = "xlsx"
    sheet: str | None = None
    """Name of the sheet; None: the workbook has only one."""


class Arrays(Frozen):
    """An array in a NumPy archive, in a NumPy file of its own, or in a MATLAB file of version 7 or before.

    Pickled objects are refused, and arrays inside structures and cells of MATLAB are not read.
    """

    format: Literal["npz", "npy", "mat"]
    array: str = ""
    """Name of the array in its file; `npy` has none."""
    axes: tuple[Literal["recording", "row", "channel"], ...] = Field(min_length=1)
    """Meaning of each axis of the array, in order; an axis that is left out has length 1. Several axes of channels are
    read as one, of which the last axis varies fastest."""
    per_recording: dict[Annotated[str, Field(pattern=WORD)], str] = Field(default_factory=dict)
    """Names of arrays that hold the value of a word for each recording, by word; with `npy`, names of their files in
    the same folder, in which ``{word}`` is filled in."""

    @model_validator(mode="after")
    def _axes_differ(self) -> Arrays:
        if max(self.axes.count("recording"), self.axes.count("row")) > 1:
            raise ValueError("axes name recording or row twice; only channel may occur several times")
        return self


class Bag(Frozen):
    """A topic of an MCAP bag; rows are messages, columns are paths of fields, ``wrench.force.z`` or ``data.0..63``."""

    format: Literal["mcap"] = "mcap"
    topic: str


class Parquet(Frozen):
    """A Parquet file, which needs the extra ``[parquet]``. Values in a list are columns: ``observation.state.0..5``."""

    format: Literal["parquet"] = "parquet"


class Time(Frozen):
    """The clock of a table: the column with the time of each row. Times are never computed from a rate."""

    column: Column
    unit: str
    epoch: Literal["unix", "start", "unknown"]
    """Meaning of time zero: `unix` is 1970-01-01 UTC, `start` the beginning of the recording."""
    zone: str | None = None
    """Time zone of dates that have none of their own, for example ``Europe/Berlin`` or ``UTC``."""
    wraps_at: int | None = Field(default=None, ge=2)
    """Number at which the counter restarts at 0, for example 4294967296; None: it never restarts."""
    offset_s: float = 0.0
    """Seconds that are added to all times, where one clock is known to lag behind another."""

    @field_validator("unit")
    @classmethod
    def _is_time(cls, unit: str) -> str:
        _convertible(unit, "s")
        return unit

    @field_validator("zone")
    @classmethod
    def _is_known(cls, zone: str | None) -> str | None:
        try:
            return zone and ZoneInfo(zone).key
        except (OSError, ValueError, KeyError) as error:
            raise ValueError(
                f"no time zone {zone!r} is known here (a machine without zones: pip install tzdata)"
            ) from error


class TableSource(Frozen):
    """The files of one table: all have the same columns, and each belongs to one recording or to several."""

    files: str
    """Pattern of the files' paths below the root folder: ``*`` matches within a folder, ``**`` across folders."""
    path: re.Pattern[str] = re.compile("")
    """Regular expression that is searched for in each path; its named groups become words."""
    read: Annotated[Csv | Text | Records | Xlsx | Arrays | Bag | Parquet, Field(discriminator="format")]
    time: Time | None = None

    @field_validator("files")
    @classmethod
    def _below_root(cls, files: str) -> str:
        if files.startswith("/") or ".." in PurePosixPath(files).parts:
            raise ValueError("a pattern of files stays below the root folder: it begins with no / and has no ..")
        return files


class Join(Frozen):
    """The rule by which rows of several tables belong together."""

    by: Literal["rows", "clock"]
    """`rows`: rows with the same number belong together. `clock`: every table keeps its own rows and its own times."""
    times_within_ms: float | None = Field(default=None, gt=0)
    """Largest difference between the times of joined rows [ms]; required if tables with clocks are joined by rows."""


class Word(Frozen):
    """A word (a named value) that is derived from another word."""

    of: str = Field(pattern=WORD)
    values: dict[Scalar, str] | None = None
    """Translation of the other word's values; a value that is not listed is an error."""
    divided_by: int | None = Field(default=None, ge=1)
    """Divisor of a whole-number division of the other word, which maps consecutive numbers to one block number."""

    @model_validator(mode="after")
    def _one_way(self) -> Word:
        if (self.values is None) == (self.divided_by is None):
            raise ValueError("give either values or divided_by")
        return self


class ChannelGroup(Frozen):
    """Columns whose channels differ in their names and positions only."""

    columns: Column | tuple[Column, ...]
    """Places or names of the columns, and ranges of either: ``1..15``, ``ff_biotac_1..24``."""
    name: str
    """Name of the channel; of several columns a pattern, in which ``{column}`` or the words of `over` are filled in."""
    over: dict[Annotated[str, Field(pattern=WORD)], tuple[Scalar, ...] | str] = Field(default_factory=dict)
    """Words and their values, a list or a range like ``1..12``: columns are named by all combinations of the values, in
    which the last word varies fastest."""
    kind: ChannelKind
    unit: str
    """Unit in which the numbers are stored."""
    given_in: str | None = None
    """Unit of the numbers in the column; None: the same as `unit`."""
    sentinels: tuple[float, ...] | None = None
    """Numbers in the column that mean "no sample". A force or torque must list them, or state ``[]``."""
    lower: float | None = None
    upper: float | None = None
    sign: Literal[-1, 0, 1] = 0
    rest: float | None = None
    rest_source: Source | None = None
    """Source of `rest`; this key and the four above are fields of a `ChannelSpec`, in the unit of the channel."""

    @model_validator(mode="after")
    def _consistent(self) -> ChannelGroup:
        _convertible(self.given_in or self.unit, self.unit)
        measured = MUST_NAME_SENTINELS.get(self.kind)
        if measured is None:
            return self
        try:
            _convertible(self.unit, measured)
        except ValueError as error:
            raise ValueError(
                f"a {self.kind} needs the unit {measured} or a convertible unit ({error}); a scale's kg is "
                "`given_in: kgf`, a raw reading is `kind: taxel` or `other`"
            ) from error
        if self.sentinels is None:
            raise ValueError(
                f"a channel of kind {self.kind} must state its sentinels, the numbers that mean 'no sample': "
                "`sentinels: [-1]`, or `sentinels: []` if there are none"
            )
        return self


class Annotation(Frozen):
    """A label of every row: the text in a column, or the number of a stretch of equally many rows."""

    column: Column | None = None
    values: dict[Scalar, str] | None = None
    """Translation of the column's texts; a text that is not listed is an error. The empty text means "no label"."""
    rows_per: int | None = Field(default=None, ge=1)
    """Rows of a stretch; the label is ``row // rows_per``, and the table must hold whole stretches."""

    @model_validator(mode="after")
    def _one_way(self) -> Annotation:
        if (self.column is None) == (self.rows_per is None):
            raise ValueError("give either column or rows_per")
        return self


class StreamSource(Frozen):
    """A stream, which is a set of channels with one clock, and the table that it is read from."""

    table: str
    of: Literal["sensor", "reference"] = "sensor"
    rate_hz: float | None = Field(default=None, gt=0)
    """Nominal rate as the source states it [Hz]; None: no rate is stated."""
    rate_source: Source | None = None
    dtype: Literal["uint8", "uint16", "int16", "int32", "float32", "float64"] = "float64"
    channels: tuple[ChannelGroup, ...] = Field(min_length=1)
    annotations: dict[Annotated[str, Field(pattern=WORD)], Annotation] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _rate_has_a_source(self) -> StreamSource:
        if (self.rate_hz is None) != (self.rate_source is None):
            raise ValueError("rate_hz and rate_source are given together: a rate needs a source")
        return self


class SensorDeclaration(Frozen):
    """Description of the sensor, as far as the source of the tables gives one."""

    name: str = Field(pattern=r"^[a-z{][a-z0-9_{}-]*$")
    """Name of the sensor; ``{word}`` is replaced by the word's value, so that one mapping covers several devices."""
    title: str
    principle: str
    principle_source: Source
    link_delay: Quantity | None = None
    """Time from taking a sample to its receipt by the host [time]; None: not known."""
    references: tuple[str, ...] = ()


class RecordingNames(Frozen):
    """Texts for the name and the labels of each recording, in which ``{word}`` is replaced by the word's value."""

    name: str
    session: str
    trial: str = ""
    role: str = ""
    """Role of the recording: train, validation, test or empty, after ``{word}`` is replaced."""
    labels: dict[Annotated[str, Field(pattern=WORD)], Scalar] = Field(default_factory=dict)


class Exclusion(Frozen):
    """Files whose recordings are imported, but marked as excluded from all evaluations, with the reason."""

    files: str
    reason: str = Field(min_length=1)


class DataSource(Frozen):
    """Address, files and licence of a public data set."""

    address: str = Field(default="", pattern=r"^(https?://.*/)?$")
    """URL of the folder with `files`, in a fixed version; empty: the files have no public address."""
    licence: str
    citation: str
    measured: str
    """The measured quantity or event of the data set, in one line."""
    tasks: tuple[str, ...] = Field(min_length=1)
    """Tasks that the recordings can answer; a command that names no task runs all of these."""
    bytes: int = Field(ge=1)
    """Size of all files together [bytes]."""
    files: dict[str, Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]] = Field(min_length=1)
    """SHA-256 of each file, by its path below `address` and below the root folder."""


class Mapping(Frozen):
    """A mapping file: rules for converting the tables of a data set to recordings."""

    version: Literal[1]
    title: str
    sensor: SensorDeclaration
    clock: Literal["device", "host", "none"]
    """The clock from which the times come: the device's, the host's, or none."""
    remarks: tuple[str, ...] = ()
    """Sentences that are shown with every score from these recordings."""
    tables: dict[Annotated[str, Field(pattern=WORD)], TableSource] = Field(min_length=1)
    """Tables by name. Each file of the first table is joined with the files of the others that have the same words."""
    join: Join | None = None
    split_by: dict[Annotated[str, Field(pattern=WORD)], Column] = Field(default_factory=dict)
    """Columns of the first table by word: each combination of their values becomes a recording, with the values as
    words."""
    words: dict[Annotated[str, Field(pattern=WORD)], Word] = Field(default_factory=dict)
    recording: RecordingNames
    streams: dict[str, StreamSource] = Field(min_length=1)
    exclude: tuple[Exclusion, ...] = ()
    tasks: tuple[DeclaredTask, ...] = ()
    """Tasks defined for these recordings, in addition to the installed tasks."""
    source: DataSource | None = None
    """Source of the files; None: the files must already be on this machine."""

    @model_validator(mode="after")
    def _hangs_together(self) -> Mapping:
        for name, stream in self.streams.items():
            if stream.table not in self.tables:
                raise ValueError(f"stream {name} names the table {stream.table!r}; tables are {', '.join(self.tables)}")
            if (self.tables[stream.table].time is None) != (self.clock == "none"):
                raise ValueError(f"table {stream.table}: `time` is required, but not allowed with `clock: none`")
        join, several = self.join, len(self.tables) > 1
        if several and (join is None or any(isinstance(table.read, Arrays) for table in self.tables.values())):
            raise ValueError("several tables need `join`, by rows or by clock, and cannot be arrays")
        if join is not None and join.by == "rows" and join.times_within_ms is None and several and self.clock != "none":
            raise ValueError("tables with a clock each, joined by rows, need `times_within_ms`")
        if join is not None and join.by == "clock" and (self.clock == "none" or self.split_by):
            raise ValueError("join by clock needs `clock: device` or `host`, and cannot be used with split_by")
        return self


def _convertible(given: str, required: str) -> None:
    try:
        units.conversion(given, required)
    except UsageError as error:
        raise ValueError(str(error).rstrip(".")) from error
