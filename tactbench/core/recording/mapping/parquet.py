"""Reader of Parquet files; it needs the extra ``[parquet]``."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from tactbench.core.errors import MappingError
from tactbench.core.recording.mapping.model import Column
from tactbench.core.recording.mapping.table import ColumnTable, UsedColumns, no_column


def read_parquet(path: Path, shown: str, used: UsedColumns) -> ColumnTable:
    """Return the table of the columns that are used; values of lists of one length are ``name.0``, ``name.1`` ...

    Raises
    ------
    MappingError
        If pyarrow is not installed, the file is damaged or empty, lacks a column, lists differ in length, or there are
        no numbers where numbers are expected.
    """
    try:
        arrow, parquet = importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
    except ImportError as error:
        raise MappingError(
            f"{shown} is a Parquet file, which needs pyarrow: {error}.",
            hint="Install it with `pip install 'tactbench[parquet]'`.",
        ) from error
    wanted = [str(column) for column in used.columns]
    try:
        names = parquet.read_schema(path).names
        read = parquet.read_table(path, columns=[one for one in names if {one} & {*wanted, *map(_list_of, wanted)}])
    except Exception as error:  # whatever a damaged file makes of the library
        raise MappingError(f"{shown} cannot be read as a Parquet file: {error}.", hint="Get it again.") from error
    if not read.num_rows:
        raise MappingError(f"{shown} has no rows.", hint="Remove the file.")
    found: dict[str, Any] = {}
    for name in read.column_names:
        found |= _flat(shown, name, read.column(name))
    every = (*found, *(name for name in names if name not in read.column_names))
    values: dict[Column, Any] = {}
    for column in used.columns:
        if str(column) not in found:
            raise no_column(shown, str(column), every)
        one = found[str(column)]
        try:
            if used.as_float(column):
                values[column] = one.cast("float64").to_numpy(zero_copy_only=False)
            else:
                values[column] = (one.cast("string") if arrow.types.is_timestamp(one.type) else one).to_pylist()
        except arrow.ArrowException as error:
            hint = f"Name another column; {error}."
            raise MappingError(f"{shown}: {column!r} holds no numbers.", hint=hint) from error
    return ColumnTable(shown, every, range(read.num_rows), values)


def _list_of(column: str) -> str:
    return column.rpartition(".")[0]


def _flat(shown: str, name: str, values: Any) -> dict[str, Any]:
    """Return a column by its name, or the columns that its lists hold."""
    kinds, compute = importlib.import_module("pyarrow.types"), importlib.import_module("pyarrow.compute")
    if not (kinds.is_list(values.type) or kinds.is_large_list(values.type) or kinds.is_fixed_size_list(values.type)):
        return {name: values}
    first, *other = compute.list_value_length(values).unique().to_pylist()
    if other:
        raise MappingError(
            f"{shown}: the lists of {name!r} have {first} values, and {other[0]}.",
            hint="Only lists of one length are read.",
        )
    return {f"{name}.{place}": compute.list_element(values, place) for place in range(first)}
