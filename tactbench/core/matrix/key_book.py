"""What went into the keys of a result folder, kept so that a miss can be explained.

::

    OUT/cache/keys/
      keys.jsonl        one line a key: name, key, configuration, and the digests of what else went into it
      DIGEST.json       what several keys share: descriptors, versions and sources; the digests of the recordings

It only explains: losing it costs no result.
"""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

from tactbench.core.files import read_regular, replace_file, sha256
from tactbench.core.matrix.keys import KEY_DIGITS, Fixed, Section

Sections = Mapping[str, Section]

_DIGEST = re.compile(r"[0-9a-f]{32}")
_LARGEST = 512 * 2**20
"""Bytes of a file that are still read: folders come from strangers."""


class Entry(NamedTuple):
    """One key, and what went into it."""

    name: str
    key: str
    configuration: Section
    fixed: Fixed
    data: Mapping[str, Mapping[str, str]] = {}
    """``digest`` and ``path`` of each recording, by a name that does not depend on its key."""


@dataclass
class KeyBook:
    """The book of one result folder."""

    folder: Path
    """``OUT/cache/keys``."""
    _lines: dict[str, dict[str, Any]] | None = None

    def write(self, entries: Iterable[Entry]) -> None:
        """Add the entries that the book lacks; a folder that refuses them costs no result."""
        known = self._read()
        fresh = [entry for entry in entries if (known.get(entry.name) or {}).get("key") != entry.key]
        if not fresh:
            return
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            kept: dict[int, str] = {}
            """Digests of parts by identity: many entries share one object."""
            lines: list[dict[str, Any]] = []
            for entry in fresh:
                parts = {name: part for name, part in (("fixed", entry.fixed.sections), ("data", entry.data)) if part}
                for part in parts.values():
                    if id(part) in kept:
                        continue
                    content = json.dumps(part, sort_keys=True, separators=(",", ":"), default=repr)
                    kept[id(part)] = digest = sha256(content)[:KEY_DIGITS]
                    path = self.folder / f"{digest}.json"
                    if not path.exists():
                        replace_file(path, content.encode(), sync=False)  # what a power cut takes costs an explanation
                digests = {name: kept[id(part)] for name, part in parts.items()}
                configuration = dict(entry.configuration)
                lines.append({"name": entry.name, "key": entry.key, "configuration": configuration, **digests})
            path = self.folder / "keys.jsonl"
            torn = path.exists() and not path.read_bytes().endswith(b"\n")
            with path.open("a", encoding="utf-8") as book:
                text = "".join(json.dumps(line, sort_keys=True, default=repr) + "\n" for line in lines)
                book.write("\n" * torn + text)
        except OSError:
            return
        known.update((line["name"], line) for line in lines)

    def take(self, books: Iterable[tuple[KeyBook, Collection[str]]]) -> None:
        """Add what each of other books says of its keys; of two lines on one key the one whose text is smaller."""
        found: dict[str, tuple[tuple[str, int], Entry]] = {}
        for book, keys in books:
            parts: dict[str, dict[str, Any]] = {}
            """Many lines share one: it is read once, and written once."""
            for line in book._read().values():
                key = str(line["key"])
                if key not in keys:
                    continue
                for digest in map(str, (line.get("fixed"), line.get("data"))):
                    if digest not in parts:
                        parts[digest] = book._part(digest)
                fixed, data = (parts[str(line.get(name))] for name in ("fixed", "data"))
                order = json.dumps(line, sort_keys=True), (not fixed) + (not data)
                if key not in found or order < found[key][0]:
                    found[key] = order, Entry(str(line["name"]), key, line["configuration"], Fixed("", fixed), data)
        self.write(entry for _, entry in sorted(found.values(), key=itemgetter(0)))

    def sections(self, name: str, key: str = "") -> Sections | None:
        """Return what went into `key`, or into the latest key of that name; None if the book does not know."""
        lines = self._read()
        line = lines.get(key) or lines.get(name)
        if line is None:
            return None
        sections = {**self._part(line.get("fixed")), "configuration": line["configuration"]}
        return {**sections, "data": self._part(line["data"])} if line.get("data") else sections

    def _part(self, digest: object) -> dict[str, Any]:
        if not isinstance(digest, str) or not _DIGEST.fullmatch(digest):
            return {}
        path = self.folder / f"{digest}.json"
        try:
            content = read_regular(path, _LARGEST)
            found = json.loads(content) if sha256(content)[:KEY_DIGITS] == digest else None
        except (OSError, ValueError, RecursionError):
            found = None
        return found if isinstance(found, dict) and all(isinstance(one, dict) for one in found.values()) else {}

    def _read(self) -> dict[str, dict[str, Any]]:
        """Return the latest line of each name, and every line by its key."""
        if self._lines is None:
            self._lines = {}
            path = self.folder / "keys.jsonl"
            try:
                lines = read_regular(path, _LARGEST).decode().splitlines()
            except (OSError, ValueError):
                lines = []
            for text in lines:
                try:
                    line = json.loads(text)
                    if isinstance(line["configuration"], dict):
                        self._lines[str(line["name"])] = self._lines[str(line["key"])] = line
                except (ValueError, KeyError, TypeError, RecursionError):
                    continue  # a line cut short
        return self._lines


def book_of(folder: Path) -> KeyBook:
    """Return the book of a result folder, which may have none yet."""
    return KeyBook(folder / "cache" / "keys")


def recording_key(path: Path) -> str:
    """Return the key of a recording of a run, which its name ends with."""
    return path.stem[-12:]


def recording_names(paths: Sequence[Path]) -> list[str]:
    """Return names of recordings that stay the same when they are made anew, each once."""
    above = Path(os.path.commonpath([path.parent for path in paths])) if paths else Path()
    stems = [re.sub(r"-[0-9a-f]{12}$", "", path.relative_to(above).with_suffix("").as_posix()) for path in paths]
    number: Counter[str] = Counter()
    names = []
    for stem in stems:
        number[stem] += 1
        names.append(stem if number[stem] == 1 else f"{stem} ({number[stem]})")
    return names
