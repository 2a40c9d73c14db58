"""The shard of a finished cell: its row, its provenance, and what it answered, in one HDF5 file."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, get_args

import h5py  # noqa: TID253  (this module is imported where a shard is opened)
import numpy as np
import numpy.typing as npt

from tactbench.core.errors import FormatError
from tactbench.core.matrix.store import limits
from tactbench.core.matrix.store.image import SEE
from tactbench.core.matrix.store.rows import Row, fault_in_row, too_deep
from tactbench.core.samples import Answers
from tactbench.core.spec.scene import Role

FORMAT = "tactbench-cell"
VERSION = 3
ENDING = ".h5"
_COMPRESSED_BYTES = 2**15
"""Tables of fewer bytes are stored as they are: compressing them takes longer than they take room."""
_CHUNK_ROWS = 4096
_ATTRIBUTE_BYTES = 60_000
"""An attribute of HDF5 holds 64 KiB with its name and type."""
_COLUMNS = tuple(column.name for column in fields(Answers))


def build(row: str, provenance: str, sets: Mapping[Role, Answers]) -> bytes:
    """Return the bytes of a shard: a table of answers for each role; the texts of row and provenance as attributes.

    Notes
    -----
    Built in memory: HDF5 cannot give up a file on a full disk without crashing the process, and what is written is
    known, byte by byte, before any of it is.
    """
    tables = {str(role): _table(sets[role]) for role in sorted(sets)}
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        for role, table in tables.items():
            stored: dict[str, Any] = {}
            if table.nbytes >= _COMPRESSED_BYTES:
                stored = {"chunks": (min(len(table), _CHUNK_ROWS),), "shuffle": True, "compression": 4}
            file.create_dataset(role, data=table, **stored)
        facts = {
            "format": f"{FORMAT} {VERSION}",
            "row": row,
            "provenance": provenance,
            "sha256": _digest(row, provenance, tables),
        }
        for name, fact in facts.items():
            text = np.bytes_(fact.encode())
            if len(text) <= _ATTRIBUTE_BYTES:
                file.attrs[name] = text
            else:
                file.create_dataset(name, data=text)
    return image.getvalue()


def _table(answers: Answers) -> npt.NDArray[Any]:
    """Return (n,) answers, a field for each column."""
    columns = {name: getattr(answers, name) for name in _COLUMNS}
    types = [(name, values.dtype.newbyteorder("<"), values.shape[1:]) for name, values in columns.items()]
    table = np.empty(len(answers), dtype=types)
    for name, values in columns.items():
        table[name] = values
    return table


def answers_in(path: Path, image: bytes) -> dict[str, Answers]:
    """Return the answers of a shard whose bytes were compared with the ledger, by role.

    Raises
    ------
    FormatError
        If it is no shard, or declares more than it can hold.
    """
    return _opened(path, image)[1]


def row_in(path: Path, image: bytes) -> Row:
    """Return the row of a shard that no ledger vouches for; its own digest must.

    Raises
    ------
    FormatError
        If it is no shard, is damaged, or its row makes no sense.
    """
    text, _ = _opened(path, image)
    try:
        row = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _damaged(path, error) from error
    fault = "its row is none" if not isinstance(row, dict) or too_deep(row) else fault_in_row(row)
    if not fault and (row["status"] != "done" or row.get("key") != path.name.removesuffix(ENDING)):
        fault = "its row is of another cell"
    if fault:
        raise _damaged(path, fault)
    return dict(row)


def _digest(row: str, provenance: str, tables: Mapping[str, npt.NDArray[Any]]) -> str:
    """Return the digest of what a shard says, whatever bytes HDF5 made of it; `tables` in the order of their names."""
    sha = hashlib.sha256(f"{FORMAT} {VERSION}\n{row}\n{provenance}\n".encode())
    for role, table in tables.items():
        sha.update(f"{role} {table.dtype.descr} {table.shape}\n".encode())
        sha.update(table.tobytes())
    return sha.hexdigest()


def _opened(path: Path, image: bytes) -> tuple[str, dict[str, Answers]]:
    """Return the text of the row, and the answers, after comparing them with the shard's own digest."""
    try:
        with h5py.File(io.BytesIO(image), "r") as file:
            if _text(path, file, "format") != f"{FORMAT} {VERSION}":
                raise FormatError(f"{path} is no shard of this version.", hint=SEE)
            row = _text(path, file, "row")
            tables = {str(role): _read(path, file, role) for role in sorted(set(get_args(Role)) & set(file))}
            if _digest(row, _text(path, file, "provenance"), tables) != _text(path, file, "sha256"):
                raise FormatError(f"{path} does not hold what was written: its digest differs.", hint=SEE)
    except FormatError:
        raise
    except (
        OSError,
        LookupError,
        RuntimeError,
        ValueError,
        TypeError,
        AttributeError,
        OverflowError,
        MemoryError,
    ) as error:
        raise _damaged(path, error) from error
    return row, {role: Answers(**{name: table[name].copy() for name in _COLUMNS}) for role, table in tables.items()}


def _text(path: Path, file: Any, name: str) -> str:
    """Return a text that is an attribute, or a dataset where it is a long one; empty if it is not there."""
    value = file.attrs.get(name)
    if value is None:
        value = file[name][()] if name in file else b""
    return value.decode() if isinstance(value, bytes) else str(value)


def _read(path: Path, file: Any, role: str) -> npt.NDArray[Any]:
    """Return the table of a role, looked at before it is read."""
    dataset = file[role]
    kinds = {dataset.dtype[name].base.kind for name in dataset.dtype.names or ()}
    if dataset.dtype.names != _COLUMNS or not kinds <= set("iuf"):
        raise _damaged(path, f"{role} holds {dataset.dtype}")
    most = max(limits.FEW_BYTES, limits.LARGEST_RATIO * dataset.file.id.get_filesize())
    if dataset.size * dataset.dtype.itemsize > most:
        raise _damaged(path, f"{role} claims {dataset.size} rows")
    table: npt.NDArray[Any] = dataset[()]
    return table


def _damaged(path: Path, why: object) -> FormatError:
    return FormatError(f"The shard {path} is damaged: {why}.", hint=SEE)
