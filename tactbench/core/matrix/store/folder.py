"""A result folder: what a run writes into it, and what is read from it, which may be a stranger's."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import FormatError, RecordingError
from tactbench.core.files import read_regular, replace_file, sha256, write_file
from tactbench.core.matrix.store import leftovers, limits
from tactbench.core.matrix.store.disk import sync_path, writing
from tactbench.core.matrix.store.image import read_image
from tactbench.core.matrix.store.ledger import Entry, Ledger, read_ledger
from tactbench.core.matrix.store.lock import Lock
from tactbench.core.matrix.store.rows import NAMING, NotPlainError, Row, named, text_of
from tactbench.core.matrix.store.sharing import PROVENANCE_DIGITS, canonical

if TYPE_CHECKING:
    from tactbench.core.samples import Answers
    from tactbench.core.spec.scene import Role

_PARTS = ("recordings", "cells", "provenance", "cache")


class Store:
    """A result folder. Making one reads and writes nothing; :meth:`hold` makes the folder.

    Parameters
    ----------
    folder
        Where results lie, or will lie.
    recordings
        Folders of recordings that may be opened although they lie elsewhere.
    """

    def __init__(self, folder: Path, *, recordings: tuple[Path, ...] = ()) -> None:
        self.folder = folder
        self._cells = folder / "cells"
        self._allowed = [path.resolve() for path in recordings]
        self._same_content: dict[tuple[Path, str], bool] = {}
        self._lock: Lock | None = None
        self._ledger: Ledger | None = None
        self._done: dict[str, Entry] = {}
        self._latest: dict[str, Entry] = {}
        self._orphans: list[Entry] = []
        self._provenance = ("", "{}")

    # One run at a time

    @contextmanager
    def hold(self) -> Iterator[Store]:
        """Keep the folder to this run: made if it is not there, swept of what killed runs left, locked until the end.

        May be entered again by who holds it. The kernel lets go of it when the process ends, however it ends.

        Raises
        ------
        FolderError
            If another run holds it, or it cannot be made or written.
        """
        if self._lock is not None:
            yield self
            return
        with writing(self.folder):
            for part in _PARTS:
                (self.folder / part).mkdir(parents=True, exist_ok=True)
            self._lock = Lock(self.folder)
        try:
            leftovers.sweep(self.folder)
            yield self
        finally:
            self._lock.release()
            self._lock = None

    # What a run asks and writes

    def begin(self, provenance: Mapping[str, Any]) -> str:
        """Keep who computes from now on, with what, and return its id: equal provenances have equal ones."""
        text = canonical(dict(provenance))
        name = sha256(text)[:PROVENANCE_DIGITS]
        path = self.folder / "provenance" / f"{name}.json"
        with self._written():
            if not path.exists():
                path.parent.mkdir(exist_ok=True)
                replace_file(path, text.encode() + b"\n")
        self._provenance = (name, text)
        return name

    def finished(self, key: str) -> Row | None:
        """Return the row of a finished cell if its shard is there as it was written and holds this row, or None."""
        self._read()
        entry = self._done.get(key)
        return dict(entry.row) if entry is not None and self._is_sound(entry) else None

    def keep(self, key: str, row: Mapping[str, Any], sets: Mapping[Role, Answers]) -> Row:
        """Write a finished cell: its shard aside, synced; its line in the ledger; then the shard gets its name.

        In this order a process that is killed leaves a line without a shard, which is no finished cell, and never a
        shard beside a line that tells of another one.

        Returns
        -------
        row
            As the ledger will give it back.

        Raises
        ------
        FolderError
            If the disk refuses, or the folder is gone; what was finished before stays.
        NotPlainError
            If the row holds what is no plain data.
        """
        from tactbench.core.matrix.store import shard

        if not limits.is_key(key) or row.get("status") != "done":
            raise ValueError(f"a finished cell has the status 'done' and a key of 32 hexadecimal digits, not {key!r}")
        ledger = self._read()
        text = text_of({**row, "key": key})
        written: Row = json.loads(text)
        image = shard.build(text, self._provenance[1], sets)
        entry = Entry(written, (sha256(image), len(image)))
        path = self._shard(key)
        aside = self._cells / f".{key}.h5.{os.getpid()}.partial"
        with self._written():
            try:
                write_file(aside, image, sync=True)
                ledger.append(entry)
                aside.replace(path)
            except BaseException:
                with suppress(OSError):
                    aside.unlink(missing_ok=True)
                raise
            sync_path(self._cells)
        self._place(entry)
        return dict(written)

    def note(self, row: Mapping[str, Any]) -> Row:
        """Write how a cell ended that did not finish: failed, crashed, skipped.

        Returns
        -------
        row
            As the ledger will give it back.

        Raises
        ------
        FolderError
            If the disk refuses, or the folder is gone.
        """
        if row.get("status") == "done":
            raise ValueError("a finished cell has answers: keep() it")
        texts = ("log", "traceback", "reason")
        row = {"key": "", **{name: _clipped(value) if name in texts else value for name, value in row.items()}}
        ledger = self._read()
        written: Row = json.loads(canonical(row))
        before = self._latest.get(str(written.get("cell")))
        if before is None or before.row != written:
            with self._written():
                ledger.append(Entry(written))
            self._place(Entry(written))
        return dict(written)

    def reuse(self, row: Row) -> None:
        """Say that a finished cell was found again, under the name it has in `row`.

        Written only where the ledger's last word on this name is another: a cell that failed since, or had other data.
        """
        self._read()
        entry = self._done.get(str(row.get("key", "")))
        if entry is None:
            raise ValueError(f"no cell with the key {row.get('key')!r} is finished here")
        latest = self._latest.get(row["cell"])
        again = Entry({**entry.row, **{name: row[name] for name in NAMING if name in row}}, entry.shard)
        if latest is None or latest.shard != again.shard or any(latest.row.get(n) != again.row.get(n) for n in NAMING):
            with self._written():
                self._read().append(again)
            self._latest[again.row["cell"]] = again

    def write(self, name: str, text: str) -> Path:
        """Write one of the result files whole."""
        path = self.folder / name
        with self._written():
            replace_file(path, text.encode())
        return path

    # What is read

    @property
    def troubles(self) -> tuple[str, ...]:
        """What of this folder could not be used, in sentences."""
        return tuple(self._read().troubles)

    def rows(self) -> list[Row]:
        """Return how every cell ended that ever did, the latest of each name, in the order of their first lines."""
        return [dict(entry.row) for entry in self.entries()]

    def entries(self) -> list[Entry]:
        """Return the latest line of every cell; a finished cell whose shard or row was changed since is none."""
        ledger = self._read()
        latest: dict[str, Entry] = {}
        holes = set()
        for entry in (*self._orphans, *ledger.entries):
            if entry.shard is None or self._is_sound(entry):
                latest[entry.row["cell"]] = entry
            else:
                holes.add(entry.row["cell"])
        known = set(ledger.troubles)
        lost = sorted(holes - set(latest))
        messages = [
            f"{name!r} is left out: its shard is missing, cut or not of this row; run it again" for name in lost
        ]
        ledger.troubles += [one for one in messages if one not in known]
        return list(latest.values())

    def answers(self, key: str) -> dict[str, Answers]:
        """Return what a finished cell answered, by role; nothing for a cell that is not there or was changed since."""
        from tactbench.core.matrix.store import shard

        entry = self._read() and self._done.get(key)
        if not entry or entry.shard is None:
            return {}
        path = self._shard(key)
        try:
            image = self.image(entry)
            if image is None:
                raise FormatError(f"The shard {path} is not the one that was written.", hint="Run the cell again.")
            return shard.answers_in(path, image)
        except FormatError as error:
            if str(error) not in self._read().troubles:
                self._read().troubles.append(str(error))
            return {}

    def _is_sound(self, entry: Entry) -> bool:
        """Return whether a cell's shard is the one that its line tells of, and holds the line's row."""
        image = self.image(entry)
        if image is None:
            return False
        try:
            text = text_of(entry.row)
            if text.encode() in image:  # texts are stored as they are: no need to look where
                return True
            from tactbench.core.matrix.store import shard

            return text_of(named(shard.row_in(self._shard(entry.key), image), entry.row)) == text
        except (FormatError, NotPlainError):
            return False

    def image(self, entry: Entry) -> bytes | None:
        """Return the bytes of a cell's shard, or None if they are not those that the ledger tells of."""
        try:
            image = read_image(self._shard(entry.key))
        except FormatError:
            return None
        return image if (sha256(image), len(image)) == entry.shard else None

    def provenance(self, name: str) -> dict[str, Any]:
        """Return who computed a cell, with what, by the id in ``row["made_by"]``; empty if not known."""
        if len(name) != PROVENANCE_DIGITS or not name.isalnum():  # it becomes the name of a file
            return {}
        try:
            content = read_regular(self.folder / "provenance" / f"{name}.json", limits.PROVENANCE_BYTES).strip()
            provenance = json.loads(content)
        except (OSError, ValueError, RecursionError):
            return {}
        whole = sha256(content)[:PROVENANCE_DIGITS] == name and isinstance(provenance, dict)
        return provenance if whole else {}

    def recording(self, path: str, digest: str = "") -> Path | None:
        """Return the file of a recording that a row names, or None if it may not be opened.

        Opened are files inside the result folder; files in the folders that the user has named; and elsewhere regular
        files that hold the very content that the row names, so that one's own runs on recordings elsewhere need no
        naming, while a stranger's row shows nothing that the stranger does not have already.

        Parameters
        ----------
        path
            As it stands in ``row["recordings"]``: relative to the folder, or absolute.
        digest
            The content digest that stands beside it in ``row["digests"]``.
        """
        if "\0" in path:
            return None
        found = (self.folder / path).resolve()
        if any(found.is_relative_to(root) for root in (self.folder.resolve(), *self._allowed)):
            return found
        pair = (found, digest)
        if pair not in self._same_content:
            self._same_content[pair] = bool(digest) and found.is_file() and _content(found) == digest
        return found if self._same_content[pair] else None

    def recordings(self, row: Mapping[str, Any]) -> list[tuple[str, Path | None]]:
        """Return each recording that a row names, in its order, and its file, or None if it may not be followed."""
        digests = row.get("digests") or [""] * len(row["recordings"])
        return [(path, self.recording(path, digest)) for path, digest in zip(row["recordings"], digests, strict=False)]

    # The rest

    def _read(self) -> Ledger:
        if self._ledger is None:
            self._ledger = read_ledger(self.folder)
            for entry in self._ledger.entries:
                self._place(entry)
            with suppress(OSError):
                for path in sorted(self._cells.iterdir()):
                    if path.suffix == ".h5" and path.stem not in self._done and limits.is_key(path.stem):
                        self._adopt(path.stem, self._ledger)
        return self._ledger

    def _adopt(self, key: str, ledger: Ledger) -> None:
        """Take in a shard that the ledger has lost."""
        from tactbench.core.matrix.store import shard

        try:
            image = read_image(self._shard(key))
            entry = Entry(shard.row_in(self._shard(key), image), (sha256(image), len(image)))
        except FormatError as error:
            ledger.troubles.append(str(error))
            return
        self._orphans.append(entry)
        self._done[key] = entry

    def _place(self, entry: Entry) -> None:
        self._latest[entry.row["cell"]] = entry
        if entry.shard is not None:
            self._done[entry.key] = entry

    def _shard(self, key: str) -> Path:
        return self._cells / f"{key}.h5"

    @contextmanager
    def _written(self) -> Iterator[None]:
        with writing(self.folder):
            if self._lock is None:
                self._cells.mkdir(parents=True, exist_ok=True)
            elif not self._lock.in_place():
                raise FileNotFoundError(errno.ENOENT, "not where it was")
            yield


def _content(path: Path) -> str:
    """Return the digest of a recording's content, "" if it is none."""
    from tactbench.core.recording.reader import content_digest

    try:
        return content_digest(path)
    except RecordingError:
        return ""


def _clipped(text: Any) -> Any:
    if isinstance(text, str) and len(text) > limits.TEXT_CHARACTERS:
        return f"… {text[-limits.TEXT_CHARACTERS :]}"
    return text
