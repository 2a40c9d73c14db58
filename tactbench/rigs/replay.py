"""The rig `replay`: recordings that were made elsewhere, or earlier, instead of new ones."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from tactbench.plugin import MissingRecordingError, ReplayRig, RigContext, RigDescriptor, UsageError, hookimpl

TACTBENCH_API = 2

ENDING = ".h5"
_HINT = "Make recordings with `tactbench import MAPPING.yaml --out DIR` or `tactbench record --out FILE`."


class RecordingFolder(ReplayRig):
    """The recordings in one folder and in all folders below it.

    Parameters
    ----------
    folder
        Folder with the recordings. Unfinished files of a crash (``….h5.partial``) and hidden files are skipped.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def recordings(self) -> Sequence[Path]:
        """Return the recordings' files, sorted by their path below the folder.

        Raises
        ------
        MissingRecordingError
            If the folder does not exist or has no recordings, or an import into it was interrupted.
        """
        if not self.folder.is_dir():
            what = f"{self.folder} is not a folder" if self.folder.exists() else f"There is no folder {self.folder}"
            raise MissingRecordingError(f"{what}.", hint=_HINT)
        found, unfinished = [], 0
        for below, folders, names in os.walk(self.folder):  # skips folders that vanish or cannot be read
            if any(name.startswith(".placing-") for name in folders):
                raise MissingRecordingError(
                    f"An import into {below} was interrupted while its recordings were moved there: files are missing.",
                    hint="Run the same import again, or wait until it ends.",
                )
            folders[:] = [name for name in folders if not name.startswith(".")]
            for name in names:
                unfinished += name.endswith(".partial")
                path = Path(below, name)
                if name.endswith(ENDING) and not name.startswith(".") and path.is_file():
                    found.append(path)
        if not found:
            left = f" ({unfinished} unfinished ones, `….partial`, are not replayed)" if unfinished else ""
            raise MissingRecordingError(f"There is no recording (*{ENDING}) in {self.folder}{left}.", hint=_HINT)
        # By parts, not by text: the order must not depend on how a separator sorts.
        return sorted(found, key=lambda path: path.relative_to(self.folder).parts)


def build(context: RigContext) -> RecordingFolder:
    """Build the rig `replay`.

    Raises
    ------
    UsageError
        If the context has no folder of recordings.
    """
    if context.recordings is None:
        raise UsageError(
            "The rig 'replay' needs a folder of recordings.",
            hint=f"Give the folder by --recordings DIR. {_HINT}",
        )
    return RecordingFolder(Path(context.recordings))


@hookimpl
def tactbench_rigs() -> list[RigDescriptor]:
    """Register the rig `replay` with the plugin manager."""
    here = __name__
    return [RigDescriptor(name="replay", title="recordings made elsewhere", where=f"{here}:build", replays=True)]
