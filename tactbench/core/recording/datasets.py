"""Public data sets, found by name; each is downloaded, checked and imported once.

A data set is a mapping file with the key `source`. Mapping files lie in the folder `datasets` of tactbench's package
and of every package with a plugin, so that a plugin can add data sets as files; a path names a mapping file elsewhere.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import tactbench
from tactbench.core.errors import (
    ConfigError,
    DuplicateNameError,
    MissingRecordingError,
    NotApplicable,
    UnknownNameError,
)
from tactbench.core.plugins import hookspecs
from tactbench.core.progress import Progress
from tactbench.core.recording.format import VERSION
from tactbench.core.recording.mapping.importing import aside, import_tables
from tactbench.core.recording.mapping.model import DataSource, Mapping
from tactbench.core.spec.yaml_file import load_yaml

CACHE = "TACTBENCH_CACHE"
"""Environment variable that names the folder for downloaded data sets; unset: the user's folder for caches."""
FOLDER = "datasets"


@dataclass(frozen=True)
class DataSet:
    """A public data set: a mapping file, with the name of the data set, that states the source of its files."""

    path: Path
    """Path of the mapping file, whose name without ending is the data set's name."""

    @property
    def name(self) -> str:
        """Name of the data set: the mapping file's name without its ending."""
        return self.path.stem

    @cached_property
    def mapping(self) -> Mapping:
        """Content of the mapping file; raises ConfigError if the file is not valid."""
        return load_yaml(self.path, Mapping)

    @property
    def source(self) -> DataSource:
        """Address and SHA-256 of the data set's files; raises ConfigError if the mapping file has no `source`."""
        if self.mapping.source is None:
            raise ConfigError(
                str(self.path), None, "The file has no key `source`; there is nothing to download.",
                hint=f"Add `source`, or import files that you have: tactbench import {self.path}.",
            )  # fmt: skip
        return self.mapping.source

    @property
    def files(self) -> Path:
        """Folder of the data set's downloaded files."""
        return cache() / self.name / "files"

    @property
    def imported(self) -> Path:
        """Folder of the imported recordings, a new one after a change of the mapping file or of the file format."""
        stated = hashlib.sha256(self.path.read_bytes()).hexdigest()[:12]
        return cache() / self.name / f"recordings-{VERSION}-{stated}"

    def recordings(self, root: Path | None = None, progress: Progress | None = None) -> Path:
        """Return the folder of the recordings, after downloading, checking and importing missing files.

        Without a copy of the files in the folder `root`, or in a sub-folder of it, they are downloaded. `progress`
        receives a step for every file once it is present, and for every file imported.

        Raises
        ------
        MissingRecordingError
            If the folder `root` does not exist, or a file cannot be fetched or has another SHA-256 than stated.
        NotApplicable
            If the files have no public address, and `root` has no copy.
        MappingError, UnwritableError
            As :func:`~tactbench.core.recording.mapping.importing.import_tables` raises them.
        """
        target, copy = self.imported, copy_in(root, next(iter(self.source.files)))
        if target.is_dir():
            return target
        progress = progress or Progress()
        self._fetch(copy, root, progress)
        with aside(target.parent) as folder:
            made = folder / "recordings"
            import_tables(self.path, root=self.files, out=made, progress=progress)
            with suppress(OSError):  # another process was quicker
                made.replace(target)
        return target

    def _fetch(self, copy: Path | None, root: Path | None, progress: Progress) -> None:
        import pooch

        address, files = self.source.address, self.source.files
        there = pooch.create(path=self.files, base_url=address or "file:///", registry=dict(files))
        pooch.get_logger().setLevel("WARNING")
        progress.begin(f"{'fetching' if copy is None else 'copying'} {self.name}", len(files))
        for name in files:
            origin = address + name if copy is None else str(copy / name)
            if copy is None and not address and not (self.files / name).is_file():
                raise NotApplicable(
                    f"{self.name}: {name} has no public address{f' and is not in {root}' if root else ''}.",
                    hint=f"Name a folder with the file as `root` (--root DIR), or put the file into {self.files}.",
                )
            try:
                there.fetch(name, downloader=None if copy is None else partial(_copy_file, copy / name))
            except (OSError, ValueError) as error:  # ValueError: the file has another digest
                missed = f" (not in {root} either)" if root is not None and copy is None else ""
                raise MissingRecordingError(
                    f"{self.name}: {origin} could not be fetched{missed}: {error}. The files belong in {self.files}.",
                    hint="Put the files into that folder, or name a folder with a copy as `root` (--root DIR); import "
                    "another version of a file with `tactbench import MAPPING`. Files fetched before are kept.",
                ) from error
            progress.advance(name)


def cache() -> Path:
    """Return the folder for downloaded data sets."""
    if CACHE in os.environ:
        return Path(os.environ[CACHE])
    import pooch

    return Path(pooch.os_cache("tactbench"))


def datasets() -> dict[str, DataSet]:
    """Return the data sets of all installed packages, by name; mapping files without `source` are left out.

    A data set with an invalid mapping file is included, and raises ConfigError when its mapping is read. Raises
    DuplicateNameError if two packages have data sets of the same name.
    """
    found: dict[str, tuple[str, DataSet]] = {}
    for package, folder in _folders().items():
        for path in sorted(folder.glob("*.yaml"), key=lambda one: one.stem):
            one = DataSet(path)
            with suppress(ConfigError):
                if one.mapping.source is None:
                    continue
            if one.name in found:
                raise DuplicateNameError("data set", one.name, (found[one.name][0], package))
            found[one.name] = package, one
    return {name: one for name, (_, one) in found.items()}


def dataset_called(given: str) -> DataSet:
    """Return the data set named `given`, or described by the mapping file at that path; raises UnknownNameError."""
    path = mapping_called(given)
    if path is None:
        raise UnknownNameError("data set", given, datasets())
    return DataSet(path)


def mapping_called(given: str) -> Path | None:
    """Return the path of the mapping file at `given`, or of the data set of this name; None for an unknown name."""
    if given.endswith((".yaml", ".yml")):
        return Path(given)
    files = (folder / f"{given}.yaml" for folder in _folders().values())
    return next((path for path in files if path.is_file()), None)


def mappings_of(module: str) -> list[Path]:
    """Return the paths of the mapping files in the package to which a plugin's module belongs."""
    folder = _folders().get(module.partition(".")[0])
    return [] if folder is None else sorted(folder.glob("*.yaml"))


def _folders() -> dict[str, Path]:
    """Return the folder of mapping files of each package, by package name, without importing plugins."""
    own = Path(tactbench.__file__).parent
    in_checkout = own.parent / "examples" / "mappings"
    found = {"tactbench": own / FOLDER if (own / FOLDER).is_dir() else in_checkout}
    for package in {point.module.partition(".")[0] for point in entry_points(group=hookspecs.GROUP)} - {"tactbench"}:
        spec = find_spec(package)
        for place in (spec.submodule_search_locations or ()) if spec is not None else ():
            found[package] = Path(place) / FOLDER
    return found


def copy_in(root: Path | None, first: str) -> Path | None:
    """Return `root`, or its sub-folder, that contains the file named `first`; None if neither does."""
    if root is None:
        return None
    if not root.is_dir():
        raise MissingRecordingError(f"There is no folder {root}.", hint="Name a folder with a copy of the files.")
    places = (root, *sorted(path for path in root.iterdir() if path.is_dir()))
    return next((place for place in places if (place / first).is_file()), None)


def _copy_file(path: Path, _url: str, output_file: str, _there: Any) -> None:
    """Copy `path` to `output_file`, as a downloader for pooch."""
    shutil.copyfile(path, output_file)
