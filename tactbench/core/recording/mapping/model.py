"""What a mapping file may say; ``docs/mappings.md`` explains it with examples."""

from __future__ import annotations

import re
from pathlib import PurePosixPath
from typing import Annotated, Literal
from zoneinfo import ZoneInfo

from pydantic import AliasChoices, Field, ValidationInfo, field_validator, model_validator

from tactbench.core.errors import UsageError
from tactbench.core.spec import units
from tactbench.core.spec.declared_task import DeclaredTask
from tactbench.core.spec.quantity import Frozen, Quantity, Source
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.sensor import ChannelKind, Vector

Column = int | str
"""A column by its place (from 0) or by its name in the header."""

WORD = r"^[a-z][a-z0-9_]*$"
MUST_NAME_SENTINELS = {"force": "N", "torque": "N*m"}
"""Kinds that are targets, and what their units are converted to; a number that means "no sample" would be learnt."""


class Tabular(Frozen):
    """Rows of cells."""

    header: bool
    """True: the first line names the columns. False: there is no such line, columns are numbered from 0."""
    skiprows: Annotated[int, Field(ge=0)] | tuple[Annotated[int, Field(ge=0)], ...] = Field(
        default=0, validation_alias=AliasChoices("skiprows", "skip_lines")
    )
    """As in pandas: how many lines at the beginning mean nothing, or the places, from 0, of those that do not."""
    no_sample: tuple[str, ...] = ()
    """Cells with exactly one of these texts hold no sample, for example "" or "NA"."""
    transposed: bool = False
    """True: a line holds all samples of one channel; with `header` its first cell is the name."""


class Written(Tabular):
    """Rows of text; the keys are those of ``pandas.read_csv``."""

    decimal: str = Field(default=".", min_length=1, max_length=1)
    thousands: str | None = Field(default=None, min_length=1, max_length=1)
    """What stands between groups of three digits."""
    comment: str | None = Field(default=None, min_length=1, max_length=1)
    """What begins a comment; it ends with the line."""

    @model_validator(mode="after")
    def _marks_differ(self) -> Written:
        if self.thousands == self.decimal:
            raise ValueError(f"thousands and decimal are both {self.decimal!r}")
        return self


class Csv(Written):
    """Cells between delimiters."""

    format: Literal["csv"] = "csv"
    delimiter: str = Field(default=",", min_length=1, max_length=1)


class Text(Written):
    """Cells between spaces or tabs."""

    format: Literal["text"] = "text"


class Records(Frozen):
    """Several lines of numbers make one row; columns are numbered from 0 through all lines of it."""

    format: Literal["records"] = "records"
    numbers_per_line: tuple[Annotated[int, Field(ge=1)], ...] = Field(min_length=1)
    first_line: str | None = None
    """What the first line must be; it is dropped. None: the first line is data."""
    no_sample: tuple[str, ...] = ()


class Xlsx(Tabular):
    """A sheet of an Excel workbook; the extra ``[xlsx]``."""

    format: Literal["xlsx"] = "xlsx"
    sheet: str | None = None
    """None: the only one."""


class Arrays(Frozen):
    """Arrays in one file."""

    array: str
    axes: tuple[Literal["recording", "row", "channel"], ...] = Field(min_length=1)
    """What each axis of the array counts; an axis that is left out has length 1. Several axes of channels are one, the
    last fastest."""
    per_recording: dict[Annotated[str, Field(pattern=WORD)], str] = Field(default_factory=dict)
    """Words taken from arrays with one value a recording: word -> array, of `npy` the file, with ``{word}`` in it."""

    @model_validator(mode="after")
    def _axes_differ(self) -> Arrays:
        if max(self.axes.count("recording"), self.axes.count("row")) > 1:
            raise ValueError("an axis is named twice; only channels may have several")
        if self.per_recording and "recording" not in self.axes:
            raise ValueError("per_recording needs an axis called recording")
        return self


class Npz(Arrays):
    """Arrays in one NumPy archive, never pickled ones."""

    format: Literal["npz"] = "npz"


class Npy(Arrays):
    """One array in a file of its own, never pickled; those of `per_recording` are in files in the same folder."""

    format: Literal["npy"] = "npy"
    array: Literal[""] = ""


class Mat(Arrays):
    """Arrays in one MATLAB file of version 7 or before, never in structures or cells."""

    format: Literal["mat"] = "mat"


class Bag(Frozen):
    """A topic of an MCAP bag, a row a message; columns are paths of fields: ``wrench.force.z``, ``data.0..63``."""

    format: Literal["mcap"] = "mcap"
    topic: str


class Parquet(Frozen):
    """Columns of a Parquet file; the extra ``[parquet]``. Places of lists are columns: ``observation.state.0..5``."""

    format: Literal["parquet"] = "parquet"


class Time(Frozen):
    """The clock of a table: a column, never `row / rate`."""

    column: Column
    unit: str
    epoch: Literal["unix", "start", "unknown"]
    """What zero is: 1970-01-01 UTC, the beginning of the recording, or nobody knows."""
    zone: str | None = None
    """Time zone of dates that state none, for example ``Europe/Berlin`` or ``UTC``."""
    wraps_at: int | None = Field(default=None, ge=2)
    """The counter begins at 0 again instead of reaching this number, for example 4294967296."""
    offset_s: float = 0.0
    """Added to the stamps [s]: the known lag of one clock behind another."""

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
    """A family of files of one shape."""

    files: str
    """Which: a pattern below the root, with ``*`` within a folder and ``**`` across folders."""
    path: str = ""
    """Regular expression searched in each path; its named groups become words."""
    read: Annotated[Csv | Text | Records | Xlsx | Npz | Npy | Mat | Bag | Parquet, Field(discriminator="format")]
    time: Time | None = None

    @field_validator("files")
    @classmethod
    def _below_root(cls, files: str) -> str:
        if files.startswith("/") or ".." in PurePosixPath(files).parts:
            raise ValueError("the pattern starts and stays below the root folder")
        return files

    @field_validator("path")
    @classmethod
    def _compiles(cls, path: str) -> str:
        try:
            groups = re.compile(path).groupindex
        except re.error as error:
            raise ValueError(f"not a regular expression: {error}") from error
        for name in groups:
            if not re.match(WORD, name):
                raise ValueError(f"the group {name!r} must be a word in lower case")
        return path


class Join(Frozen):
    """How several tables make one recording."""

    by: Literal["rows", "clock"]
    """`rows`: row i of each belongs together. `clock`: each keeps its own rows and its own time."""
    times_within_ms: float | None = Field(default=None, gt=0)
    """With `rows` and two clocks: how far the times of one row may differ."""


class Word(Frozen):
    """A word made from another one."""

    of: str = Field(pattern=WORD)
    values: dict[Scalar, str] | None = None
    """Translation; a value that is not in it is an error."""
    divided_by: int | None = Field(default=None, ge=1)
    """Whole-number division, to make blocks of consecutive numbers."""

    @model_validator(mode="after")
    def _one_way(self) -> Word:
        if (self.values is None) == (self.divided_by is None):
            raise ValueError("give either values or divided_by")
        return self


class ChannelGroup(Frozen):
    """Columns that are alike in everything but their name."""

    columns: Column | tuple[Column, ...]
    """Places, names, and ranges of either: ``1..15``, ``ff_biotac_1..24``."""
    name: str
    """Name of the channel; with several columns a pattern with the words of `over`, or ``{column}``."""
    over: dict[Annotated[str, Field(pattern=WORD)], tuple[Scalar, ...] | str] = Field(default_factory=dict)
    """Words that run through all their combinations, the last one fastest: lists, or ranges like ``1..12``."""
    kind: ChannelKind
    unit: str
    """Unit of the stored numbers."""
    given_in: str | None = None
    """Unit of the column, if another."""
    sentinels: tuple[float, ...] | None = None
    """Numbers in the column that mean "no sample"; a force or torque must say, if only ``[]``."""
    lower: float | None = None
    upper: float | None = None
    sign: Literal[-1, 0, 1] = 0
    rest: float | None = None
    rest_source: Source | None = None
    positions_m: tuple[Vector, ...] = ()
    position_source: Source | None = None

    @field_validator("unit")
    @classmethod
    def _measures_its_kind(cls, unit: str, info: ValidationInfo) -> str:
        kind = info.data.get("kind")
        if kind in MUST_NAME_SENTINELS:
            try:
                _convertible(unit, MUST_NAME_SENTINELS[kind])
            except ValueError as error:
                raise ValueError(
                    f"a {kind} is in {MUST_NAME_SENTINELS[kind]} or what converts to it ({error}); a scale's kg is "
                    "`given_in: kgf`, a raw reading is `kind: taxel` or `other`"
                ) from error
        return unit

    @model_validator(mode="after")
    def _consistent(self) -> ChannelGroup:
        _convertible(self.given_in or self.unit, self.unit)
        if self.kind in MUST_NAME_SENTINELS and self.sentinels is None:
            raise ValueError(
                f"a channel of kind {self.kind} must state its sentinels, the numbers that mean 'no sample': "
                "`sentinels: [-1]`, or `sentinels: []` if there are none"
            )
        if (self.rest is None) != (self.rest_source is None):
            raise ValueError("rest and rest_source belong together")
        if bool(self.positions_m) != (self.position_source is not None):
            raise ValueError("positions_m and position_source belong together")
        return self


class Annotation(Frozen):
    """A label of every row: from a column, or numbers of equal stretches of rows."""

    column: Column | None = None
    values: dict[Scalar, str] | None = None
    """Translation of the column; a value that is not in it is an error. An empty text is "no label"."""
    rows_per: int | None = Field(default=None, ge=1)
    """The label is ``row // rows_per``; the rows must come out even."""

    @model_validator(mode="after")
    def _one_way(self) -> Annotation:
        if (self.column is None) == (self.rows_per is None):
            raise ValueError("give either column or rows_per")
        return self


class StreamSource(Frozen):
    """Channels that share one clock."""

    table: str
    of: Literal["sensor", "reference"] = "sensor"
    rate_hz: float | None = Field(default=None, gt=0)
    """Nominal rate, if the source states one."""
    rate_source: Source | None = None
    dtype: Literal["uint8", "uint16", "int16", "int32", "float32", "float64"] = "float64"
    channels: tuple[ChannelGroup, ...] = Field(min_length=1)
    annotations: dict[Annotated[str, Field(pattern=WORD)], Annotation] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _rate_has_a_source(self) -> StreamSource:
        if (self.rate_hz is None) != (self.rate_source is None):
            raise ValueError("rate_hz and rate_source belong together: a rate is never invented")
        return self


class SensorDeclaration(Frozen):
    """The sensor, as far as its source describes it."""

    name: str = Field(pattern=r"^[a-z{][a-z0-9_{}-]*$")
    """A text with ``{word}`` in it where one mapping covers several devices; title alike."""
    title: str
    principle: str
    principle_source: Source
    link_delay: Quantity | None = None
    """From a sample taken to the sample in the host [time]."""
    references: tuple[str, ...] = ()


class RecordingNames(Frozen):
    """What a recording is called and belongs to; texts with ``{word}`` in them."""

    name: str
    session: str
    trial: str = ""
    role: str = ""
    """Empty, or a text that becomes train, validation or test."""
    labels: dict[Annotated[str, Field(pattern=WORD)], Scalar] = Field(default_factory=dict)


class Exclusion(Frozen):
    """Files that are imported, but marked: no evaluation uses them."""

    files: str
    reason: str = Field(min_length=1)


class DataSource(Frozen):
    """A public data set: where its files lie, and which they are."""

    address: str = Field(default="", pattern=r"^(https?://.*/)?$")
    """Of the folder that holds `files`, of one fixed state of it; empty: these files lie at no public address."""
    licence: str
    citation: str
    measured: str
    """What, in a line."""
    tasks: tuple[str, ...] = Field(min_length=1)
    """That the recordings can be asked; those that are asked where nobody names one."""
    bytes: int = Field(ge=1)
    """Size of all files."""
    files: dict[str, Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]] = Field(min_length=1)
    """Path below `address` and below the root -> SHA-256."""


class Mapping(Frozen):
    """A mapping file."""

    version: Literal[1]
    title: str
    sensor: SensorDeclaration
    clock: Literal["device", "host", "none"]
    """Who made the time stamps."""
    remarks: tuple[str, ...] = ()
    """What a reader of a score from these recordings must know."""
    tables: dict[Annotated[str, Field(pattern=WORD)], TableSource] = Field(min_length=1)
    """The first one leads: the others are found by the words they share with it."""
    join: Join | None = None
    split_by: dict[Annotated[str, Field(pattern=WORD)], Column] = Field(default_factory=dict)
    """One recording for each combination of values in these columns of the first table; they become words."""
    words: dict[Annotated[str, Field(pattern=WORD)], Word] = Field(default_factory=dict)
    recording: RecordingNames
    streams: dict[str, StreamSource] = Field(min_length=1)
    exclude: tuple[Exclusion, ...] = ()
    tasks: tuple[DeclaredTask, ...] = ()
    """Questions that the recordings can be asked, beside the installed ones."""
    source: DataSource | None = None
    """None: the tables are no data set that has a name."""

    @model_validator(mode="after")
    def _hangs_together(self) -> Mapping:
        for name, stream in self.streams.items():
            if stream.table not in self.tables:
                raise ValueError(f"stream {name} names the table {stream.table!r}; there are {', '.join(self.tables)}")
        if all(stream.of == "reference" for stream in self.streams.values()):
            raise ValueError("no stream is of the sensor")
        if len(self.tables) > 1 and self.join is None:
            raise ValueError("several tables need `join`: by rows, or by clock")
        timed = [name for name, table in self.tables.items() if table.time is not None]
        if self.clock == "none" and timed:
            raise ValueError(f"clock is none, but table {timed[0]} has a time column")
        if self.clock != "none" and len(timed) < len(self.tables):
            without = next(name for name in self.tables if name not in timed)
            raise ValueError(f"clock is {self.clock}, but table {without} has no time; write `clock: none`")
        join = self.join
        if join is not None and join.by == "rows" and len(timed) > 1 and join.times_within_ms is None:
            raise ValueError("tables with a clock each, joined by rows, need `times_within_ms`")
        if join is not None and join.by == "clock" and (self.clock == "none" or self.split_by):
            raise ValueError("a join by clock needs a clock, and rows that need not be split")
        arrays = [name for name, table in self.tables.items() if isinstance(table.read, Arrays)]
        if arrays and len(self.tables) > 1:
            raise ValueError(f"table {arrays[0]} is an archive and cannot be joined with others")
        return self


def _convertible(given: str, required: str) -> None:
    try:
        units.conversion(given, required)
    except UsageError as error:
        raise ValueError(str(error).rstrip(".")) from error
