"""The HDF5 file of one cell: its row, the sections of its key, its provenance and its answers."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from tactbench.core.errors import FormatError
from tactbench.core.files import hdf5_image
from tactbench.core.samples import Answers

FORMAT = b"tactbench-cell 5 "
_USER_BLOCK = 512
_COLUMNS = tuple(column.name for column in fields(Answers))


@dataclass(frozen=True)
class CellFile:
    """Content of a cell's file: row, sections of the key, provenance and answers."""

    row: dict[str, Any]
    """Result row with the keys of `tactbench.core.spec.row.RowModel`."""
    sections: Mapping[str, Any] = field(default_factory=dict)
    """Sections of the cell's key; see `tactbench.core.matrix.keys`."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    ended_ns: int = 0
    """Time of writing [ns since the epoch]; the latest file of a cell is valid."""
    answers: Mapping[str, Answers] = field(default_factory=dict)
    """Answers by role; empty for a cell that did not finish."""

    @property
    def text(self) -> str:
        """Everything except for the answers, as JSON."""
        head = {"row": self.row, "sections": self.sections, "provenance": self.provenance, "ended_ns": self.ended_ns}
        return json.dumps(head, allow_nan=False)

    @property
    def digests(self) -> dict[str, str]:
        """SHA-256 digests of the answers by role."""
        return {role: hashlib.sha256(_table(one).tobytes()).hexdigest() for role, one in self.answers.items()}

    def content(self) -> bytes:
        """Return the content of the HDF5 file as bytes."""
        import numpy as np

        text = self.text.encode()

        def fill(file: Any) -> None:
            file["head"] = np.bytes_(text)
            for role, answers in self.answers.items():
                file.create_dataset(f"answers/{role}", data=_table(answers), shuffle=True, compression=4)

        body = hdf5_image(fill)
        return _opening(body).ljust(_USER_BLOCK, b"\0") + body


def read_cell(path: Path, *, answers: bool = True) -> CellFile:
    """Return the content of a cell's file, with or without its answers.

    Raises
    ------
    FormatError
        If the file is not a cell's file of this version, or was changed after writing.
    """
    import h5py

    try:
        content = path.read_bytes()
    except OSError as error:
        raise FormatError(f"{path} cannot be read: {error}.", hint="Run the cell again.") from error
    begins = content[:_USER_BLOCK].rstrip(b"\0")
    if begins != _opening(content[_USER_BLOCK:]):
        what = "was changed after writing" if begins.startswith(FORMAT) else "is not a cell's file of this version"
        raise FormatError(f"{path} {what}.", hint="Run the cell again.")
    with h5py.File(io.BytesIO(content), "r") as file:
        head = json.loads(file["head"][()])
        row = head["row"]
        if number := row.pop("repeat", None):  # until replicates were named by their seeds
            name = f"{row['cell'].removesuffix(str(number))}{row['seed']}"
            row |= {"cell": name, "key": row["key"] or path.stem}
        tables = {role: table[()] for role, table in file.get("answers", {}).items()} if answers else {}
    columns = {role: {name: table[name].copy() for name in _COLUMNS} for role, table in tables.items()}
    return CellFile(**head, answers={role: Answers(**values) for role, values in columns.items()})


def _opening(body: bytes) -> bytes:
    """Return the user block with a digest, to detect damaged files, on which the HDF5 library may crash."""
    return FORMAT + hashlib.sha256(body).hexdigest().encode()


def _table(answers: Answers) -> Any:
    """Return the (n,) structured array of answers with one field for each column, little-endian."""
    import numpy as np

    columns = {name: getattr(answers, name) for name in _COLUMNS}
    types = [(name, values.dtype.newbyteorder("<"), values.shape[1:]) for name, values in columns.items()]
    table = np.empty(len(answers), dtype=types)
    for name, values in columns.items():
        table[name] = values
    return table
