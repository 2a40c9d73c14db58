"""The ledger: how every cell ended, one a line, only ever appended to."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tactbench.core.errors import FolderError
from tactbench.core.files import read_regular, sha256, write_all
from tactbench.core.matrix.store import limits
from tactbench.core.matrix.store.rows import Row, fault_in_row, too_deep
from tactbench.core.matrix.store.sharing import DEFINITION, canonical, definition, joined, parted

NAME = "index.jsonl"


@dataclass(frozen=True, slots=True)
class Entry:
    """One line."""

    row: Row
    shard: tuple[str, int] | None = None
    """SHA-256 and bytes of the cell's shard; None for a cell that did not finish."""

    @property
    def key(self) -> str:
        """Key of the cell; empty where none could be made."""
        return str(self.row.get("key", ""))


@dataclass
class Ledger:
    """What a ledger says, oldest line first."""

    path: Path
    entries: list[Entry] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)
    """What could not be used, in sentences."""
    known: set[str] = field(default_factory=set)
    """Digests of the values that have been written."""

    def append(self, entry: Entry) -> None:
        """Write one line, and before it what it shares with no earlier one, at once.

        A line that a crash cut short is cut away first: nothing is ever glued to it.

        Raises
        ------
        OSError
            If the disk refuses; the ledger ends where it ended before.
        """
        lines, fresh = _lines(entry, self.known)
        text = "".join(f"{line}\n" for line in lines).encode()
        file = os.open(self.path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o666)
        try:
            end = os.fstat(file).st_size
            if end and os.pread(file, 1, end - 1) != b"\n":
                end = os.pread(file, end, 0).rfind(b"\n") + 1
                os.ftruncate(file, end)
            try:
                write_all(file, text)
            except BaseException:
                os.ftruncate(file, end)
                raise
        finally:
            os.close(file)
        self.known |= fresh
        self.entries.append(entry)


def read_ledger(folder: Path) -> Ledger:
    """Read the ledger of a result folder; a folder without one has an empty one.

    Lines that make no sense, or are larger than `limits` allows, are left out and counted.

    Raises
    ------
    FolderError
        If it is larger than any ledger of ours, or the system refuses to read it.
    """
    path = folder / NAME
    ledger = Ledger(path)
    try:
        content = read_regular(path, limits.LEDGER_BYTES)
    except FileNotFoundError:
        return ledger
    except OSError as error:
        raise FolderError(
            f"{path} cannot be read: {error.strerror or error}.", hint="Check its permissions."
        ) from error
    if len(content) > limits.LEDGER_BYTES:
        raise FolderError(
            f"{path} is larger than {limits.LEDGER_BYTES // 2**20} MiB, more than any ledger that tactbench reads.",
            hint="Split the matrix over several folders, or delete this one if it is not yours.",
        )
    _take_in(ledger, content)
    return ledger


def _take_in(ledger: Ledger, content: bytes) -> None:
    """Turn the bytes of a ledger into entries."""
    broken, altered, lost, over, characters = 0, 0, 0, 0, 0
    shared: dict[str, Any] = {}
    sizes: dict[str, int] = {}
    for line, record in _parsed(content):
        if not isinstance(record, dict) or _is_monstrous(line, record):
            broken += 1
        elif "shared" in record:
            digest = definition(line)
            if digest is None:
                broken += 1
            else:
                shared.setdefault(digest, record["value"])
                sizes[digest] = len(line)
        elif _is_altered(line):
            altered += 1
        elif isinstance(record.get("row"), dict):
            references, shard = record.get("refs", {}), record.get("shard")
            try:
                characters += len(line) + sum(sizes[digest] for digest in references.values())
                if characters > limits.SHARED_CHARACTERS:
                    over += 1
                    continue
                row = {"key": "", **joined(record["row"], references, shared)}
            except (KeyError, TypeError, AttributeError):
                lost += 1
                continue
            fault = fault_in_row(row) or _fault_in_names(row, shard)
            if fault:
                name = str(row.get("cell", ""))[:200]
                ledger.troubles.append(f"{f'{name!r}' if name else 'a row'} is left out: {fault}")
            else:
                ledger.entries.append(Entry(row, (shard[0], shard[1]) if shard and row["status"] == "done" else None))
        else:
            broken += 1
    ledger.known = set(shared)
    for count, what in (
        (broken, "could not be read"),
        (altered, "do not hold what was written"),
        (lost, "refer to what is not there"),
        (over, "are left out: written out, they would fill the memory"),
    ):
        if count:
            ledger.troubles.append(f"{count} line{'s' if count > 1 else ''} of {ledger.path} {what}")


def _fault_in_names(row: Row, shard: Any) -> str:
    """Return what is wrong with the key of a row, or with what its line says of the shard, as a clause."""
    done, key = row["status"] == "done", row.get("key", "")
    if done and not (_is_shard(shard) and limits.is_key(key)):
        return "it names no shard: it is of another version"
    return "its key is none" if key and not limits.is_key(key) else ""


def whole_text(entries: Sequence[Entry]) -> str:
    """Return a ledger with these lines: the same text for the same lines."""
    known: set[str] = set()
    lines: list[str] = []
    for entry in entries:
        some, fresh = _lines(entry, known)
        lines += some
        known |= fresh
    return "".join(f"{line}\n" for line in lines)


def _lines(entry: Entry, known: set[str]) -> tuple[list[str], set[str]]:
    slim, references, texts = parted(entry.row)
    fresh = {digest: text for digest, text in texts.items() if digest not in known}
    record: dict[str, Any] = {"row": slim}
    if references:
        record["refs"] = references
    if entry.shard is not None:
        record["shard"] = list(entry.shard)
    text = canonical(record)
    shared = (DEFINITION.format(digest, value) for digest, value in fresh.items())
    return [*shared, f'{text[:-1]}{_DIGEST}{sha256(text)[:32]}"}}'], set(fresh)


_DIGEST = ', "sha256": "'
"""Ends a line, with the digest of what it would be without: earlier versions wrote none."""
_ITS_DIGEST = re.compile(r'(.*), "sha256": "([0-9a-f]{32})"}')


def _is_altered(line: str) -> bool:
    found = _ITS_DIGEST.fullmatch(line)
    return found is not None and sha256(f"{found[1]}}}")[:32] != found[2]


def _parsed(content: bytes) -> Iterator[tuple[str, Any]]:
    """Yield every line that is not empty with what it says, or None."""
    at_most = limits.ENTRIES
    for raw in content.split(b"\n"):
        if not raw:
            continue
        at_most -= 1
        if at_most < 0 or len(raw) > limits.LINE_BYTES:
            yield "", None
            continue
        try:
            line = raw.decode()
            yield line, json.loads(line)
        except (ValueError, RecursionError):
            yield "", None


def _is_monstrous(line: str, record: Any) -> bool:
    """Return whether a line is nested without end, or holds half characters that cannot be printed."""
    # What is empty can only be the innermost.
    holding = line.count("[") - line.count("[]") + line.count("{") - line.count("{}")
    if holding >= limits.DEPTH and too_deep(record):
        return True
    if "\\ud" not in line and "\\uD" not in line:
        return False
    try:
        json.dumps(record, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        return True
    return False


def _is_shard(shard: Any) -> bool:
    return (
        isinstance(shard, list) and len(shard) == 2 and isinstance(shard[0], str) and len(shard[0]) == 64
        and type(shard[1]) is int and 0 < shard[1] <= limits.SHARD_BYTES
    )  # fmt: skip
