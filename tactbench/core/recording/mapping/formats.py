"""Recognition of a file's format; readers of arrays, Excel workbooks, Parquet files and MCAP bags (ROS 2, Foxglove)."""

from __future__ import annotations

import importlib
import json
import struct
import warnings
import zipfile
from array import array
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import date, time
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.format import Array
from tactbench.core.recording.mapping.channels import fill
from tactbench.core.recording.mapping.model import Arrays, Bag, Column, Time, Xlsx
from tactbench.core.recording.mapping.table import (
    Table,
    Used,
    nanoseconds_per,
    no_column,
    plain,
    skipped,
    table_of,
)

Words = dict[str, str]

_UTF_16 = "is text in UTF-16", "", "Convert it: `iconv -f UTF-16 -t UTF-8 FILE > NEW`."
_WEB_PAGE = "is a web page", "", "Download the file itself: a link to the raw file, or after signing in."
_SIGNATURES: dict[bytes, tuple[str, str, str]] = {
    b"\x1f\x8b": ("is compressed with gzip", "", "Unpack it: `gunzip FILE`."),
    b"PK\x03\x04": ("is a zip archive", "", "Unpack it: `unzip FILE`."),
    b"\xd0\xcf\x11\xe0": ("is a workbook of Excel before 2007 (.xls)", "", "Save the sheet as .xlsx or CSV."),
    b"\xff\xfe": _UTF_16,
    b"\xfe\xff": _UTF_16,
    b"version https://git-lfs": ("is a Git LFS pointer; the table is not here", "", "Fetch it: `git lfs pull`."),
    b"/annex/objects/": ("is a git-annex pointer; the table is not here", "", "Fetch it: `datalad get FILE`."),
    b"<!doctype html": _WEB_PAGE,
    b"<html": _WEB_PAGE,
    b"#ROSBAG V": ("is a bag of ROS 1", "", "Make a bag of ROS 2 in MCAP of it: `rosbags-convert`."),
    b"SQLite format 3\0": ("is an SQLite database, as bags of ROS 2 are", "",
                           "Convert a bag: `mcap convert FILE NEW.mcap`; of another database, save a table as CSV."),
    b"\x89HDF\r\n\x1a\n": ("is an HDF5 file", "", "A recording of tactbench needs no import; save another as CSV."),
    b"MATLAB 7.3": ("is a MATLAB file of version 7.3", "", "Save it with -v7, or the table as CSV."),
    b"MATLAB 5.0": ("is a MATLAB file", "mat", ""),
    b"PAR1\x15": ("is a Parquet file", "parquet", ""),
    b"\x93NUMPY": ("is a NumPy array", "npy", ""),
    b"\x89MCAP0": ("is an MCAP bag", "mcap", ""),
}  # fmt: skip
"""By a file's first bytes: its kind, the name of the format that can read it, and the next step if no format can."""

MESSAGE_TIMES = ("log_time", "publish_time")
"""Columns that every message has beside its fields: its times of writing and of sending [ns]."""

Topic = tuple[Bag, Used, Time | None]
"""A topic of a bag, the topic's columns that a mapping uses, and the topic's clock."""


def require_format(path: Path, shown: str, wanted: str) -> None:
    """Raise MappingError if a file cannot be read, or if its first bytes show another format than `wanted`."""
    try:
        with path.open("rb") as opened:
            first = opened.read(64).removeprefix(b"\xef\xbb\xbf").lstrip()
    except OSError as error:
        raise MappingError(f"{shown} cannot be read: {error.strerror}.", hint="Check its permissions.") from error
    for begins, (what, read_by, step) in _SIGNATURES.items():
        # The letters of a web page may have either case; those of other files may not: a table may begin with "par1".
        if not (first.lower() if begins.startswith(b"<") else first).startswith(begins):
            continue
        if begins.startswith(b"PK"):
            names: list[str] = []
            with suppress(zipfile.BadZipFile, OSError), zipfile.ZipFile(path) as archive:
                names = archive.namelist()
            if "xl/workbook.xml" in names:
                what, read_by = "is an Excel workbook", "xlsx"
            elif names and all(name.endswith(".npy") for name in names):
                what, read_by = "is an archive of NumPy arrays", "npz"
        if read_by != wanted:
            raise MappingError(
                f"{shown} {what}, where `format: {wanted}` is expected.",
                hint=f"Write `format: {read_by}` under `read`." if read_by else step.replace("FILE", shown),
            )


@contextmanager
def whole(shown: str, what: str, hint: str) -> Iterator[None]:
    """Return a context manager that raises any error of a library with a damaged file as MappingError."""
    try:
        yield
    except MappingError:
        raise
    except Exception as error:
        raise MappingError(f"{shown} is not a valid {what}: {type(error).__name__}: {error}.", hint=hint) from error


def extra(name: str, shown: str, *modules: str) -> list[Any]:
    """Return the modules of the optional extra `name`; raises MappingError, with its name, if it is not installed."""
    try:
        return [importlib.import_module(module) for module in modules]
    except ImportError as error:
        raise MappingError(
            f"Reading {shown} needs an optional extra: {error}.", hint=f"Install it: `pip install 'tactbench[{name}]'`."
        ) from error


def read_arrays(path: Path, shown: str, how: Arrays, known: Words) -> Iterator[tuple[Words, Table]]:
    """Yield the table of each recording, with its words: ``index`` (from 0, with leading zeros) and `per_recording`.

    `known` are the words in the file's path, which replace ``{word}`` in the names of further files. Raises
    MappingError if the file has another format or lacks an array, or an array has the wrong shape or type.
    """
    hint = "Store plain arrays (numpy.save, numpy.savez, -v7 of MATLAB); pickled objects are refused."
    with whole(shown, f"file of `format: {how.format}`", hint):
        arrays = _load(path, shown, how, known)
    values = arrays[how.array]
    if values.ndim != len(how.axes) or values.dtype.kind not in "iufb" or not values.size:
        raise MappingError(
            f"{shown}: array {how.array!r} of {values.dtype} has the shape {values.shape}; axes {', '.join(how.axes)} "
            "of numbers are expected.",
            hint="Name each axis: recording, row or channel; or name another array.",
        )
    order = ("recording", "row", "channel")
    ordered = np.transpose(values, sorted(range(values.ndim), key=lambda axis: order.index(how.axes[axis])))
    lengths = [values.shape[how.axes.index(axis)] if axis in how.axes else 1 for axis in order[:2]]
    ordered = ordered.reshape(*lengths, -1)
    for word, name in how.per_recording.items():
        if arrays[name].shape != (len(ordered),):
            raise MappingError(
                f"{shown}: array {name!r} for {word!r} has shape {arrays[name].shape}, not ({len(ordered)},).",
                hint="It must have one value for each recording.",
            )
    wide = len(str(len(ordered) - 1))
    for index, rows in enumerate(ordered):
        words = {word: plain(arrays[name][index].item()) for word, name in how.per_recording.items()}
        where = f"{shown}[{f'{how.array}, ' if how.array else ''}{index}]"
        columns: dict[Column, Any] = dict(enumerate(rows.T))
        yield {"index": f"{index:0{wide}d}", **words}, Table(where, tuple(columns), range(len(rows)), columns)


def _load(path: Path, shown: str, how: Arrays, known: Words) -> dict[str, Array]:
    """Return the arrays that `how` names; with `npy`, each is in a file of its own."""
    axes = dict.fromkeys(how.per_recording.values(), 1) | {how.array: len(how.axes)}
    if how.format == "npy":
        files = {name: path.parent / fill(name, known, shown) if name else path for name in axes}
        return {name: np.load(file, allow_pickle=False) for name, file in files.items()}
    mat = how.format == "mat"
    with path.open("rb") as opened:
        found = importlib.import_module("scipy.io").loadmat(opened) if mat else np.load(opened, allow_pickle=False)
        arrays = [name for name in found if not name.startswith("__")]
        for name in axes:
            if name not in arrays:
                hint = f"{did_you_mean(name, arrays)}Its arrays: {', '.join(sorted(arrays))}."
                raise MappingError(f"{shown} has no array {name!r}.", hint=hint)
        return {name: _shaped(found[name], count) if mat else found[name] for name, count in axes.items()}


def _shaped(values: Array, axes: int) -> Array:
    """Return an array with `axes` axes; MATLAB stores n values as (n, 1) or (1, n), and drops last axes of length 1."""
    shape = (-1,) if axes < 2 and 1 in values.shape else values.shape + (1,) * (axes - values.ndim)
    return values.reshape(shape)


def read_sheet(path: Path, shown: str, how: Xlsx) -> Table:
    """Return the table in one sheet of a workbook, with the values that Excel has stored for its formulas.

    Raises MappingError if openpyxl is not installed, the file is no workbook, or the sheet is missing or empty.
    """
    (openpyxl,) = extra("xlsx", shown, "openpyxl")
    hint = "Open it and save the sheet as CSV."
    with whole(shown, "Excel workbook", hint), warnings.catch_warnings(), path.open("rb") as opened:
        warnings.simplefilter("ignore")  # styles and extensions that openpyxl does not know
        book = openpyxl.load_workbook(opened, read_only=True, data_only=True)
        names = book.sheetnames
        name = names[0] if how.sheet is None and len(names) == 1 else how.sheet
        if name not in names:
            raise MappingError(
                f"{shown} has {len(names)} sheets, but no sheet {name!r}.",
                hint=f"Write `sheet:` with one of: {', '.join(names)}.",
            )
        lines = []
        for number, row in enumerate(book[name].iter_rows(values_only=True)):
            cells = [] if skipped(number, how) else [_text(value) for value in row]
            if cells and how.comment and cells[0].startswith(how.comment):
                continue
            while cells and not cells[-1]:
                cells.pop()
            if cells:
                lines.append((number + 1, cells))
    wide = len(lines[0][1]) if lines else 0
    return table_of(shown, [(number, cells + [""] * (wide - len(cells))) for number, cells in lines], how)


def _text(value: Any) -> str:
    if value is None:
        return ""
    return value.isoformat() if isinstance(value, date | time) else plain(value)


def read_parquet(path: Path, shown: str, used: Used) -> Table:
    """Return the table of the `used` columns; lists of equal length become columns ``name.0``, ``name.1`` ...

    Raises MappingError if pyarrow is not installed, the file is damaged or empty, lacks a column, lists differ in
    length, or there are no numbers where numbers are expected.
    """
    arrow, parquet, compute = extra("parquet", shown, "pyarrow", "pyarrow.parquet", "pyarrow.compute")
    wanted = {part for column in map(str, used) for part in (column, column.rpartition(".")[0])}
    with whole(shown, "Parquet file", "Get it again."):
        names = parquet.read_schema(path).names
        read = parquet.read_table(path, columns=[one for one in names if one in wanted])
    if not read.num_rows:
        raise MappingError(f"{shown} has no rows.", hint="Remove the file.")
    found: dict[str, Any] = {}
    for name in read.column_names:
        column = read.column(name)
        first = column[0].as_py()
        parts = {f"{name}.{place}": place for place in range(len(first))} if isinstance(first, list) else {}
        with whole(shown, f"table: the lists of {name!r} differ in length", "Only lists of equal length can be read."):
            found |= {part: compute.list_element(column, place) for part, place in parts.items()} or {name: column}
    every = (*found, *(name for name in names if name not in read.column_names))
    values: dict[Column, Any] = {}
    for column, is_reading in used.items():
        if str(column) not in found:
            raise no_column(shown, str(column), every)
        one = found[str(column)]
        try:
            if is_reading:
                values[column] = one.cast("float64").to_numpy(zero_copy_only=False)
            else:
                values[column] = (one.cast("string") if arrow.types.is_timestamp(one.type) else one).to_pylist()
        except arrow.ArrowException as error:
            hint = f"Name another column; {error}."
            raise MappingError(f"{shown}: {column!r} has values that are not numbers.", hint=hint) from error
    return Table(shown, every, range(read.num_rows), values)


def read_bag(path: Path, shown: str, topics: Mapping[str, Topic]) -> dict[str, Table]:
    """Return a table for each of `topics`, by name, read in one pass through an MCAP bag.

    Raises MappingError if the extra is missing, the bag is damaged or cut short or has no such topic, messages lack a
    field, or the mapping gives another unit for a time in nanoseconds.
    """
    values: dict[str, dict[Column, Any]] = {
        name: {column: array("d") if is_reading else [] for column, is_reading in used.items()}
        for name, (_, used, _) in topics.items()
    }
    counts = dict.fromkeys(topics, 0)
    decoders: dict[int, Any] = {}
    seen: set[str] = set()
    reader, ros = extra("mcap", shown, "mcap.reader", "mcap_ros2.decoder")
    damaged = whole(shown, "bag", "If its recorder was killed: `mcap recover` keeps the part that can be read.")
    with damaged, path.open("rb") as opened:
        # In the order of the file, which ends with the bag's footer; a bag that was cut short has none.
        bag = reader.NonSeekingReader(opened, validate_crcs=True).iter_messages(log_time_order=False)
        for schema, channel, record in bag:
            seen.add(channel.topic)
            for name, wanted in topics.items():
                if wanted[0].topic == channel.topic:
                    if channel.id not in decoders:
                        decoders[channel.id] = _decoder(ros, channel, schema, shown)
                    where = f"{shown}, message {counts[name]} of {name}"
                    _take(record, decoders[channel.id], wanted, values[name], where)
                    counts[name] += 1
    tables = {}
    for name, (how, used, clock) in topics.items():
        topic = how.topic
        if not counts[name]:
            hint = f"{did_you_mean(topic, seen - {topic})}Its topics: {', '.join(sorted(seen))}."
            raise MappingError(f"{shown} has no message of topic {topic!r}.", hint=hint)
        if clock is not None and isinstance(values[name][clock.column][0], int) and nanoseconds_per(clock) != 1:
            raise MappingError(
                f"{shown} {topic}: {clock.column} is in nanoseconds.", hint="Write `unit: ns` under `time`."
            )
        tables[name] = Table(f"{shown} {topic}", tuple(used), range(counts[name]), values[name], ", message ")
    return tables


def _decoder(ros: Any, channel: Any, schema: Any, shown: str) -> Callable[[bytes], Any]:
    """Return the decoder of a topic's messages; raises MappingError for an encoding that cannot be read."""
    if channel.message_encoding == "json":
        return json.loads
    found: Callable[[bytes], Any] | None = ros.DecoderFactory().decoder_for(channel.message_encoding, schema)
    if found is None:
        raise MappingError(
            f"{shown}: topic {channel.topic!r} is encoded as {channel.message_encoding} "
            f"({schema.encoding if schema else 'no schema'}).",
            hint="ROS 2 messages (cdr, ros2msg) and JSON can be read; `rosbags-convert` converts ROS 1 bags.",
        )
    return found


def _take(record: Any, decode: Any, topic: Topic, values: dict[Column, Any], where: str) -> None:
    """Append the used fields of one message to the columns in `values`."""
    column: Column | None = None
    try:
        message = decode(record.data)
        for column, is_reading in topic[1].items():
            value = getattr(record, str(column)) if column in MESSAGE_TIMES else _field(message, str(column))
            if topic[2] is not None and column == topic[2].column:
                value = _stamp(value)
            values[column].append(float(value) if is_reading else value)
    except (AttributeError, KeyError, IndexError, TypeError, ValueError, struct.error) as error:
        what = "cannot be decoded" if column is None else f"has no {column!r} of the kind that the mapping expects"
        raise MappingError(
            f"{where} {what} ({type(error).__name__}: {error}).",
            hint="Fields are named by their path: header.stamp, wrench.force.z, data.0; or log_time.",
        ) from error


def _field(message: Any, path: str) -> Any:
    """Return the value at a path like ``data.0``: of fields of ROS 2 messages, keys of JSON and places in arrays."""
    for part in path.split("."):
        if part.isdecimal():
            message = message[int(part)]
        else:
            message = message[part] if isinstance(message, dict) else getattr(message, part)
    return message


def _stamp(value: Any) -> Any:
    """Return a time stamp of ROS 1 or 2 (seconds and nanoseconds) in whole nanoseconds; a number unchanged."""
    if isinstance(value, int | float):
        return value if isinstance(value, float) else Decimal(value)
    fields = value if isinstance(value, dict) else {name: getattr(value, name) for name in value.__slots__}
    return int(fields["sec"]) * 10**9 + int(fields["nanosec"] if "nanosec" in fields else fields["nsec"])
