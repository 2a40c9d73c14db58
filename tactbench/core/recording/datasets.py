"""Public data sets by name, which are fetched, checked and imported once.

A data set is a mapping with a `source`. Mappings lie in the folder `datasets` of tactbench's own package and of every
package that brings a plugin, so that a plugin brings data sets as files; a path names one that lies anywhere.
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
"""Environment variable with the folder of data sets, in place of the user's folder for caches."""
FOLDER = "datasets"


@dataclass(frozen=True)
class DataSet:
    """A public data set: a mapping file with a source, known by its name.

    Parameters
    ----------
    path
        The mapping file; the data set has its name.
    """

    path: Path

    @property
    def name(self) -> str:
        """Name of the data set."""
        return self.path.stem

    @cached_property
    def mapping(self) -> Mapping:
        """The mapping of the file; raises ConfigError if the file is wrong."""
        return load_yaml(self.path, Mapping)

    @property
    def source(self) -> DataSource:
        """Address and digests of the files; raises ConfigError if the mapping states none."""
        if self.mapping.source is None:
            raise ConfigError(
                str(self.path), None, "It states no source, so that it is no data set.",
                hint=f"Add `source`, or import it: tactbench import {self.path}.",
            )  # fmt: skip
        return self.mapping.source

    @property
    def files(self) -> Path:
        """Folder in which the files are kept."""
        return cache() / self.name / "files"

    @property
    def imported(self) -> Path:
        """Folder of the recordings, another one whenever the mapping or the format of recordings changes."""
        stated = hashlib.sha256(self.path.read_bytes()).hexdigest()[:12]
        return cache() / self.name / f"recordings-{VERSION}-{stated}"

    def recordings(self, root: Path | None = None, progress: Progress | None = None) -> Path:
        """Return the folder of the recordings, after fetching, checking and importing what is missing.

        Parameters
        ----------
        root
            A folder that holds a copy, or whose sub-folder does. What is not there is fetched.
        progress
            Receives every file that is there, and every file that is imported.

        Raises
        ------
        MissingRecordingError
            If there is no `root`, a file cannot be had, or its SHA-256 is another than the data set states.
        NotApplicable
            If the files lie at no public address and no copy is named.
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
                    f"{self.name}: {name} lies at no public address{f', nor in {root}' if root else ''}.",
                    hint=f"Name a folder that holds it as `root` (--root DIR), or put it into {self.files}.",
                )
            try:
                there.fetch(name, downloader=None if copy is None else partial(_copy_file, copy / name))
            except ValueError as error:  # pooch's word for a digest that differs
                raise MissingRecordingError(
                    f"{self.name}: {origin} is not the file of the data set: its SHA-256 is not {files[name]}.",
                    hint="It is not kept. Files of another state are imported with `tactbench import MAPPING`.",
                ) from error
            except OSError as error:
                missed = f" (not in {root} either)" if root is not None and copy is None else ""
                raise MissingRecordingError(
                    f"{self.name}: {origin} could not be fetched{missed}: {error}. Its files belong into {self.files}.",
                    hint="Put them there by hand, or name a folder that holds a copy as `root` (--root DIR). "
                    "What was fetched before is kept.",
                ) from error
            progress.advance(name)


def cache() -> Path:
    """Return the folder in which data sets are kept."""
    if CACHE in os.environ:
        return Path(os.environ[CACHE])
    import pooch

    return Path(pooch.os_cache("tactbench"))


def datasets() -> dict[str, DataSet]:
    """Return the data sets of all installed packages by name; a mapping without a source is none.

    One whose file is wrong is among them, and raises ConfigError where its mapping is looked at.

    Raises
    ------
    DuplicateNameError
        If two packages have a data set of one name.
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
    """Return the data set of that name, or the one in the mapping file `given`; raises UnknownNameError."""
    path = mapping_called(given)
    if path is None:
        raise UnknownNameError("data set", given, datasets())
    return DataSet(path)


def mapping_called(given: str) -> Path | None:
    """Return the mapping file at a path, or of the data set of that name; None: there is none."""
    if given.endswith((".yaml", ".yml")):
        return Path(given)
    files = (folder / f"{given}.yaml" for folder in _folders().values())
    return next((path for path in files if path.is_file()), None)


def mappings_of(module: str) -> list[Path]:
    """Return the mapping files in the package of a plugin's module."""
    folder = _folders().get(module.partition(".")[0])
    return [] if folder is None else sorted(folder.glob("*.yaml"))


def _folders() -> dict[str, Path]:
    """Return the folders of mappings by package, without importing a plugin."""
    own = Path(tactbench.__file__).parent
    in_checkout = own.parent / "examples" / "mappings"
    found = {"tactbench": own / FOLDER if (own / FOLDER).is_dir() else in_checkout}
    for package in {point.module.partition(".")[0] for point in entry_points(group=hookspecs.GROUP)} - {"tactbench"}:
        spec = find_spec(package)
        for place in (spec.submodule_search_locations or ()) if spec is not None else ():
            found[package] = Path(place) / FOLDER
    return found


def copy_in(root: Path | None, first: str) -> Path | None:
    """Return `root` or the sub-folder of it that holds the first file; None if none does."""
    if root is None:
        return None
    if not root.is_dir():
        raise MissingRecordingError(f"There is no folder {root}.", hint="Name the folder of the copy.")
    places = (root, *sorted(path for path in root.iterdir() if path.is_dir()))
    return next((place for place in places if (place / first).is_file()), None)


def _copy_file(path: Path, _url: str, output_file: str, _there: Any) -> None:
    """Download a file for pooch by copying `path`."""
    shutil.copyfile(path, output_file)
