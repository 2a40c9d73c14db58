"""Tactbench: benchmark tactile sensors, and show what each score costs in time."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from os import PathLike

    from tactbench.core.recording.reader import Recording

__version__ = "0.1.0"


def dataset(name: str, root: str | PathLike[str] | None = None) -> list[Recording]:
    """Return the recordings of a public data set, opened; they are read where they are asked.

    Parameters
    ----------
    name
        As `tactbench datasets` lists them, or a mapping file that states its source.
    root
        A folder that holds a copy, or whose sub-folder does. What is not there is fetched, checked and kept.

    Raises
    ------
    UnknownNameError
        If there is no data set of that name.
    MissingRecordingError, NotApplicable
        If a file cannot be had, is not the one that is meant, or lies at no public address.
    """
    from pathlib import Path

    from tactbench.core.recording.datasets import dataset_called
    from tactbench.core.recording.reader import open_recording

    folder = dataset_called(name).recordings(None if root is None else Path(root))
    return [open_recording(path) for path in sorted(folder.glob("*.h5"))]
