"""Reading columns of Parquet files into tables; the extra ``[parquet]``."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.mapping.model import Column
from tactbench.core.recording.mapping.table import ParquetTable, names_listed


def read_parquet(path: Path, shown: str, columns: Sequence[Column]) -> ParquetTable:
    """Read some columns; the places of a list, equally long in every row, are columns called ``name.0``, ``name.1`` ...

    Raises
    ------
    MappingError
        If pyarrow is not installed, the file is damaged, a column is not in it, or lists differ in length.
    """
    try:
        parquet: Any = importlib.import_module("pyarrow.parquet")
    except ImportError as error:
        raise MappingError(
            f"{shown} is a Parquet file, which needs pyarrow: {error}.",
            hint="Install it with `pip install 'tactbench[parquet]'`.",
        ) from error
    try:
        schema = parquet.read_schema(path)
        used = [name for name in schema.names if any(str(one) == name or _list_of(one) == name for one in columns)]
        read = parquet.read_table(path, columns=used)
    except Exception as error:  # whatever a damaged file makes of the library
        raise MappingError(f"{shown} cannot be read as a Parquet file: {error}.", hint="Get it again.") from error
    found: dict[Column, npt.NDArray[Any]] = {}
    for name in used:
        found |= _flat(shown, name, read.column(name))
    for column in columns:
        if column not in found:
            names = [*dict.fromkeys([*map(str, found), *schema.names])]
            hint = f"{did_you_mean(str(column), names)}It has: {names_listed(names)}."
            raise MappingError(f"{shown} has no column {column!r}.", hint=hint)
    if not read.num_rows:
        raise MappingError(f"{shown} has no rows.", hint="Remove the file.")
    every = (*found, *(name for name in schema.names if name not in used))
    return ParquetTable(shown, found, every, np.arange(read.num_rows))


def _list_of(column: Column) -> str:
    return str(column).rpartition(".")[0]


def _flat(shown: str, name: str, values: Any) -> dict[Column, npt.NDArray[Any]]:
    """Return a column, or those of its lists; dates as ISO 8601 texts."""
    import pyarrow.types as kinds

    if kinds.is_timestamp(values.type):
        return {name: values.cast("string").to_numpy(zero_copy_only=False)}
    if not (kinds.is_list(values.type) or kinds.is_large_list(values.type) or kinds.is_fixed_size_list(values.type)):
        return {name: values.to_numpy(zero_copy_only=False)}
    rows = values.combine_chunks()
    lengths = rows.value_lengths().to_numpy(zero_copy_only=False)
    other = np.flatnonzero(lengths != lengths[:1])
    if len(other):
        raise MappingError(
            f"{shown}, row {other[0]}: {name!r} has {lengths[other[0]]} values, {lengths[0]:g} in row 0.",
            hint="Lists of different lengths are no columns.",
        )
    places = rows.flatten().to_numpy(zero_copy_only=False).reshape(len(rows), -1)
    return {f"{name}.{place}": places[:, place] for place in range(places.shape[1])}
