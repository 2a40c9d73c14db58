"""The shard of a finished cell: its row, its provenance, and what it answered, in one HDF5 file."""

from __future__ import annotations

import hashlib
import json
import os
import uuid
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from tactbench.core.errors import FormatError
from tactbench.core.matrix.store import limits
from tactbench.core.matrix.store.rows import Row, row_checker, too_deep
from tactbench.core.matrix.store.sharing import canonical

if TYPE_CHECKING:
    from tactbench.core.samples import Answers
    from tactbench.core.spec.scene import Role

FORMAT = "tactbench-cell"
VERSION = 3
ENDING = ".h5"
_COMPRESSED_BYTES = 2**14
"""Columns of fewer bytes are stored as they are: compressing them takes longer than they take room."""
_FILTERS = {1, 2}
"""Deflate and shuffle, which every HDF5 library has: no other is asked to run."""
_SEE = "Delete it, and the next run computes the cell again."


def build(row: Row, provenance: str, sets: Mapping[Role, Answers]) -> bytes:
    """Return the bytes of a shard.

    Notes
    -----
    Built in memory: HDF5 cannot give up a file on a full disk without crashing the process, and what is written is
    known, byte by byte, before any of it is.
    """
    import h5py

    text = canonical(row)
    # The oldest format that HDF5 writes; the name is nobody's, but must be unique in the process.
    name = f"cell-{uuid.uuid4().hex}"
    with h5py.File(name, "w", driver="core", backing_store=False, libver="earliest", track_order=False) as file:
        file.attrs["format"] = FORMAT
        file.attrs["format_version"] = VERSION
        file.attrs["row"] = text
        file.attrs["provenance"] = provenance
        content = _Content(text, provenance)
        for role in sorted(sets):
            group = file.create_group(role)
            for column in _columns():
                values = getattr(sets[role], column)
                content.add(role, column, values)
                if values.nbytes < _COMPRESSED_BYTES:
                    group.create_dataset(column, data=values)
                else:
                    group.create_dataset(column, data=values, compression="gzip", shuffle=True)
        file.attrs["content_sha256"] = content.hexdigest()
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def digest_of(image: bytes) -> str:
    """Return the digest under which the ledger knows a shard."""
    return hashlib.sha256(image).hexdigest()


def read_image(path: Path) -> bytes:
    """Return the bytes of a shard.

    Raises
    ------
    FormatError
        If there is no such file, it is a link or no file at all, or larger than any shard of ours.
    """
    try:
        # Not through links: they may lead anywhere. Not blocking: it might be a pipe.
        opened = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
        with open(opened, "rb") as file:  # noqa: PTH123  (a descriptor)
            image = file.read(limits.SHARD_BYTES + 1)
    except (OSError, TypeError) as error:
        raise FormatError(f"The shard {path} cannot be read: {error}.", hint=_SEE) from error
    if len(image) > limits.SHARD_BYTES:
        raise FormatError(f"The shard {path} is larger than {limits.SHARD_BYTES // 2**20} MiB.", hint=_SEE)
    return image


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
    fault = "its row is none" if not isinstance(row, dict) or too_deep(row) else row_checker()(row)
    if not fault and (row["status"] != "done" or row.get("key") != path.name.removesuffix(ENDING)):
        fault = "its row is of another cell"
    if fault:
        raise _damaged(path, fault)
    return dict(row)


class _Content:
    """Digest of what a shard says, whatever bytes HDF5 made of it."""

    def __init__(self, row: str, provenance: str) -> None:
        self._sha = hashlib.sha256(f"{FORMAT} {VERSION}\n{row}\n{provenance}\n".encode())

    def add(self, role: str, column: str, values: Any) -> None:
        """Add a column by name, type, length and little-endian bytes."""
        plain = values.astype(values.dtype.newbyteorder("<"), order="C", copy=False)
        self._sha.update(f"{role}/{column} {plain.dtype.str} {plain.shape}\n".encode())
        self._sha.update(plain.data)

    def hexdigest(self) -> str:
        """Return the digest so far."""
        return self._sha.hexdigest()


def _opened(path: Path, image: bytes) -> tuple[str, dict[str, Answers]]:
    """Return the text of the row, and the answers, after comparing them with the shard's own digest."""
    import io

    import h5py

    from tactbench.core.recording.trust import READ_FAILURES
    from tactbench.core.samples import Answers
    from tactbench.core.spec.scene import Role

    try:
        with h5py.File(io.BytesIO(image), "r") as file:
            if file.attrs.get("format") != FORMAT or int(file.attrs["format_version"]) != VERSION:
                raise FormatError(f"{path} is no shard of this version.", hint=_SEE)
            text, provenance = str(file.attrs["row"]), str(file.attrs["provenance"])
            content = _Content(text, provenance)
            found = {}
            for role in sorted(set(get_args(Role)) & set(file)):
                columns = _read(path, file, role)
                for column, values in columns.items():
                    content.add(role, column, values)
                found[role] = Answers(**columns)
            if content.hexdigest() != file.attrs["content_sha256"]:
                raise FormatError(f"{path} does not hold what was written: its digest differs.", hint=_SEE)
    except FormatError:
        raise
    except (*READ_FAILURES, MemoryError) as error:
        raise _damaged(path, error) from error
    return text, found


def _read(path: Path, file: Any, role: str) -> dict[str, Any]:
    """Return the columns of a role, each looked at before it is read."""
    from tactbench.core.recording import trust

    group = trust.subgroup(path, file, role)
    columns = {}
    for column in _columns():
        dataset = trust.numbers(path, group, column, "iuf", 1, strict=True)
        if dataset is None:
            raise _damaged(path, f"{role} has no {column}")
        if dataset.size * dataset.dtype.itemsize > limits.ARRAY_BYTES:
            raise _damaged(path, f"{role}/{column} claims {dataset.size} values")
        plist = dataset.id.get_create_plist()
        if not {plist.get_filter(place)[0] for place in range(plist.get_nfilters())} <= _FILTERS:
            raise _damaged(path, f"{role}/{column} asks for a filter")
        columns[column] = dataset[()]
    if len({len(values) for values in columns.values()}) != 1:
        raise _damaged(path, f"the columns of {role} differ in length")
    return columns


def _columns() -> tuple[str, ...]:
    from tactbench.core.samples import Answers

    return tuple(column.name for column in fields(Answers))


def _damaged(path: Path, why: object) -> FormatError:
    return FormatError(f"The shard {path} is damaged: {why}.", hint=_SEE)
