"""Result folders of several machines become one: the same bytes in whatever order, however often.

The result is the union of the folders' cells. Where two of them tell of one cell, the following holds, and because each
rule chooses the largest of an order or refuses, merging is idempotent, commutative and associative.

- Finished beats not finished. Of two that did not finish, the one whose status stands first in
  `tactbench.core.spec.status.STATUSES` is kept, then the one whose row is the smaller text.
- Two finished cells of one key (the same configuration, data, source and versions) that say the same about scores: the
  one of the host with the smaller id is kept, whole. The other's times are not mixed in, and that it is always the same
  host's makes most of a merged table times of one host. No clock is asked: those of two machines do not agree.
- Two of one key that differ in a score, or two of one name with different keys, contradict each other: refused.
- Recordings of one name hold the same content, else refused; of their bytes, which also tell when they were made, the
  smaller digest is kept.
- Of what the folders' books say of one key, the smaller text.
"""

from __future__ import annotations

import glob
import hashlib
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from tactbench.core.errors import FolderError, FormatError, MissingRecordingError
from tactbench.core.matrix.key_book import book_of, recording_key
from tactbench.core.matrix.store import Row, Store, leftovers
from tactbench.core.matrix.store.disk import sync_path, writing
from tactbench.core.matrix.store.ledger import NAME, Entry, whole_text
from tactbench.core.matrix.store.rows import NAMING, named
from tactbench.core.matrix.store.sharing import canonical
from tactbench.core.matrix.summary import SEED_DECIDES
from tactbench.core.matrix.why import short
from tactbench.core.spec.status import STATUSES

_SHOWN = 10
"""Contradictions named in a message; the others are counted."""


@dataclass(frozen=True)
class Merged:
    """What was merged."""

    rows: tuple[Row, ...]
    recordings: int
    left_out: tuple[str, ...]
    """What could not be used, in sentences."""


@dataclass
class _Found:
    """One line of one folder."""

    entry: Entry
    store: Store

    @property
    def cell(self) -> str:
        return str(self.entry.row["cell"])


@dataclass
class _Union:
    unfinished: dict[str, _Found] = field(default_factory=dict)
    finished: dict[str, _Found] = field(default_factory=dict)
    """By key: whose shard is taken."""
    names: dict[str, _Found] = field(default_factory=dict)
    """By cell: a line that gives a finished cell this name."""
    held: dict[Path, set[str]] = field(default_factory=dict)
    """By folder: keys of its finished cells and recordings."""
    against: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


def merge(folders: Sequence[Path], out: Path, *, also: Callable[[Path], None] | None = None) -> Merged:
    """Make `out` from all `folders`; nothing is left of it if anything goes wrong.

    Parameters
    ----------
    folders
        Result folders; they are only read.
    out
        A folder that does not exist yet.
    also
        Writes more files into the new folder, which it is given, before that gets its name.

    Raises
    ------
    FolderError
        If a folder holds no results, two contradict each other, or `out` exists or cannot be written.
    """
    if os.path.lexists(out):
        raise FolderError(f"{out} exists already.", hint="Give --out a folder that does not; merging changes none.")
    stores = [Store(folder) for folder in folders]
    union = _Union()
    for store in stores:
        entries = store.entries()
        if not entries:
            troubles = f" ({'; '.join(store.troubles)})" if store.troubles else ""
            raise FolderError(f"There are no results in {store.folder}{troubles}.", hint="Name what `run --out` wrote.")
        union.held[store.folder] = {entry.key for entry in entries if entry.shard is not None}
        for entry in entries:
            _add(union, _Found(entry, store))
        union.left_out += [f"{store.folder}: {trouble}" for trouble in store.troubles]
    recordings = _recordings(stores, union)
    if union.against:
        more = len(union.against) - _SHOWN
        listed = "; ".join(union.against[:_SHOWN]) + (f"; and {more} more" if more > 0 else "")
        raise FolderError(
            f"The folders contradict each other: {listed}.",
            hint="Nothing was written. Leave one of them out, or run the named cells again with the same version.",
        )
    entries = _lines(union)
    with _made(out) as aside:
        for found in union.finished.values():
            image = found.store.image(found.entry)
            if image is None:
                raise FolderError(f"The shard of {found.cell} changed in {found.store.folder}.", hint="Merge again.")
            (aside / "cells" / f"{found.entry.key}.h5").write_bytes(image)
        for name, content in _provenances(stores).items():
            (aside / "provenance" / name).write_text(content, encoding="utf-8")
        for relative, (_, path) in recordings.items():
            _link(path, aside / "recordings" / relative)
        (aside / NAME).write_text(whole_text(entries), encoding="utf-8")
        book_of(aside).take((book_of(folder), keys) for folder, keys in union.held.items())
        if also is not None:
            also(aside)
    return Merged(tuple(dict(entry.row) for entry in entries), len(recordings), tuple(union.left_out))


def _add(union: _Union, found: _Found) -> None:
    if found.entry.shard is None:
        before = union.unfinished.get(found.cell)
        if before is None or _how(found) < _how(before):
            union.unfinished[found.cell] = found
        return
    if found.store.image(found.entry) is None:
        union.left_out.append(f"{found.store.folder}: {found.cell!r}: its shard is not the one that was written")
        return
    known = union.names.get(found.cell)
    if known is not None and known.entry.key != found.entry.key:
        union.against.append(
            f"{found.cell!r} is of other code, data or versions in {found.store.folder} than in {known.store.folder}"
        )
        return
    same = union.finished.get(found.entry.key)
    if same is not None:
        other = _difference(same.entry.row, found.entry.row)
        if other:
            union.against.append(f"{found.cell!r} {other} in {found.store.folder} and {same.store.folder}")
            return
    if known is None or _repeats(found) > _repeats(known):
        union.names[found.cell] = found
    if same is None or _whose(found) < _whose(same):
        union.finished[found.entry.key] = found


def _lines(union: _Union) -> list[Entry]:
    """Return the lines of the merged ledger, in the order of the cells' names."""
    lines = {name: found.entry for name, found in union.unfinished.items()}
    for name, found in union.names.items():
        kept = union.finished[found.entry.key].entry
        lines[name] = Entry(named(kept.row, found.entry.row), kept.shard)
    return [lines[name] for name in sorted(lines)]


def _how(found: _Found) -> tuple[int, str]:
    row = found.entry.row
    return STATUSES.index(row["status"]), canonical(row)


def _whose(found: _Found) -> tuple[str, ...]:
    row = found.entry.row
    nameless = {name: value for name, value in row.items() if name not in NAMING}
    return (
        str(row.get("host", "")),
        str(row.get("made_by", "")),
        canonical(nameless),
        *map(str, found.entry.shard or ()),
    )


def _repeats(found: _Found) -> tuple[str, str]:
    """Return what orders lines of one name: the run with more repeats has the last word on how many there are."""
    return str(found.entry.row.get("repeats")).zfill(9), str(found.entry.row.get("repeat")).zfill(9)


def _difference(one: Row, other: Row) -> str:
    """Return where two rows of one key differ in what a seed decides, in words; empty if nowhere."""
    for name in SEED_DECIDES:
        if name not in NAMING and canonical(one.get(name)) != canonical(other.get(name)):
            return f"has two values of {name!r} under one key: {short(other.get(name))} and {short(one.get(name))}"
    return ""


def _provenances(stores: Iterable[Store]) -> dict[str, str]:
    found: dict[str, str] = {}
    for store in stores:
        with suppress(OSError):
            for path in sorted((store.folder / "provenance").iterdir()):
                provenance = store.provenance(path.stem) if path.suffix == ".json" else {}
                if provenance:
                    found[path.name] = canonical(provenance) + "\n"
    return found


def _recordings(stores: Iterable[Store], union: _Union) -> dict[Path, tuple[str, Path]]:
    """Return every recording of every folder: by its place, the digest of its bytes and a file that has them."""
    found: dict[Path, tuple[str, Path]] = {}
    contents: dict[Path, str] = {}
    for store in stores:
        root = store.folder / "recordings"
        for path in sorted(root.rglob("*.h5")):
            if path.is_symlink() or not path.is_file():
                continue
            relative = path.relative_to(root)
            try:
                content = _verified(path)
            except (FormatError, MissingRecordingError) as error:
                union.left_out.append(str(error))
                continue
            if contents.setdefault(relative, content) != content:
                union.against.append(f"the recording {relative} holds other data in {store.folder}")
                continue
            union.held[store.folder].add(recording_key(path))
            bytes_digest = _digest(path)
            if relative not in found or bytes_digest < found[relative][0]:
                found[relative] = (bytes_digest, path)
    return found


def _verified(path: Path) -> str:
    from tactbench.core.recording.reader import open_recording

    with open_recording(path) as recording:
        recording.verify()
        return recording.content_digest()


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _link(path: Path, target: Path) -> None:
    """Put a recording, which never changes, at a second place: as a link where the disk can, else as a copy."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(path, target)
    except OSError:
        shutil.copyfile(path, target)


@contextmanager
def _made(out: Path) -> Iterator[Path]:
    """Give a folder to fill, which becomes `out` when all went well and is removed when not."""
    name = out.absolute().name
    aside = out.absolute().with_name(f".{name}.{os.getpid()}.merging")
    with writing(out):
        for path in aside.parent.glob(f".{glob.escape(name)}.*.merging"):
            if path == aside or leftovers.is_left(path):
                shutil.rmtree(path, ignore_errors=True)  # of a merge that was killed
        try:
            for part in ("cells", "provenance", "recordings", "cache"):
                (aside / part).mkdir(parents=True, exist_ok=True)
            yield aside
            for path in (*aside.rglob("*"), aside):
                sync_path(path)
            aside.rename(out)
            sync_path(aside.parent)
        except BaseException:
            shutil.rmtree(aside, ignore_errors=True)
            raise
