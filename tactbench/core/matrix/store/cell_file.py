"""The file of one cell: its row, what its key is made of, its provenance and its answers, in HDF5."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from tactbench.core.errors import FormatError
from tactbench.core.samples import Answers

FORMAT = "tactbench-cell 5"
_COMPRESSED_BYTES = 2**15
"""Smaller tables are stored as they are: compressing them takes longer than it saves room."""
_COLUMNS = tuple(column.name for column in fields(Answers))


@dataclass(frozen=True)
class CellFile:
    """What the file of a cell holds."""

    row: dict[str, Any]
    """As `tactbench.core.spec.row.RowModel` describes it."""
    sections: Mapping[str, Any] = field(default_factory=dict)
    """What its key is made of, by section."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    ended_ns: int = 0
    """When it was written, nanoseconds since the epoch: of two files of one cell the later counts."""
    answers: Mapping[str, Answers] = field(default_factory=dict)
    """By role; none of a cell that did not finish."""
    digests: Mapping[str, str] = field(default_factory=dict)
    """Of the answers, by role; set when the file is read."""

    def content(self) -> bytes:
        """Return the bytes of the file; raises ValueError or TypeError if the row is not plain data.

        Notes
        -----
        Built in memory: on a full disk the HDF5 library cannot even close a file.
        """
        import h5py
        import numpy as np

        head = {"row": self.row, "sections": self.sections, "provenance": self.provenance, "ended_ns": self.ended_ns}
        tables = {role: _table(answers) for role, answers in self.answers.items()}
        digests = {role: _digest(table) for role, table in tables.items()}
        text = json.dumps({**head, "digests": digests}, sort_keys=True, allow_nan=False).encode()
        image = io.BytesIO()
        with h5py.File(image, "w") as file:
            file.attrs["format"] = FORMAT
            file.attrs["sha256"] = hashlib.sha256(text).hexdigest()
            file["head"] = np.bytes_(text)
            for role, table in tables.items():
                packed = {"shuffle": True, "compression": 4} if table.nbytes >= _COMPRESSED_BYTES else {}
                file.create_dataset(f"answers/{role}", data=table, **packed)
        return image.getvalue()


def read_cell(path: Path, *, answers: bool = True) -> CellFile:
    """Read the file of a cell, with or without its answers.

    Raises
    ------
    FormatError
        If it is none, or does not hold what was written.
    """
    import h5py

    tables = {}
    try:
        with h5py.File(path, "r") as file:
            if file.attrs.get("format") != FORMAT:
                raise FormatError(f"{path} is not a cell of this version.", hint="Run the cell again.")
            text = bytes(file["head"][()])
            sound = hashlib.sha256(text).hexdigest() == file.attrs["sha256"]
            head = json.loads(text)
            digests = head.pop("digests")
            for role, digest in digests.items() if answers else ():
                table = file[f"answers/{role}"][()]
                sound &= _digest(table) == digest
                tables[role] = Answers(**{name: table[name].copy() for name in _COLUMNS})
    except (OSError, KeyError, ValueError, TypeError, RuntimeError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{path} cannot be read: {error}.", hint="Run the cell again.") from error
    if not sound:
        raise FormatError(f"{path} does not hold what was written: its digest differs.", hint="Run the cell again.")
    return CellFile(**head, answers=tables, digests=digests)


def _table(answers: Answers) -> Any:
    """Return (n,) answers, a field for each column, little-endian."""
    import numpy as np

    columns = {name: getattr(answers, name) for name in _COLUMNS}
    types = [(name, values.dtype.newbyteorder("<"), values.shape[1:]) for name, values in columns.items()]
    table = np.empty(len(answers), dtype=types)
    for name, values in columns.items():
        table[name] = values
    return table


def _digest(table: Any) -> str:
    return hashlib.sha256(f"{table.dtype.descr} {table.shape}\n".encode() + table.tobytes()).hexdigest()
