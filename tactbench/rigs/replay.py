"""Replay: recordings that were made elsewhere, or earlier."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tactbench.plugin import MissingRecordingError, ReplayRig, RigContext, RigDescriptor, UsageError, hookimpl

TACTBENCH_API = 1

ENDING = ".h5"
_HINT = "Make some with `tactbench import MAPPING.yaml --out DIR` or `tactbench record --out FILE`."


class RecordingFolder(ReplayRig):
    """The recordings of one folder and all folders below it.

    Parameters
    ----------
    folder
        Where to look. What a crash left behind (``….h5.partial``) and hidden files are passed over.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def recordings(self) -> Sequence[Path]:
        """Return the files, sorted by their path below the folder.

        Raises
        ------
        MissingRecordingError
            If there is no such folder, or nothing in it.
        """
        if not self.folder.is_dir():
            raise MissingRecordingError(f"There is no folder {self.folder}.", hint=_HINT)
        found = [path for path in self.folder.rglob(f"*{ENDING}") if path.is_file() and not self._hidden(path)]
        if not found:
            unfinished = sum(1 for _ in self.folder.rglob(f"*{ENDING}*.partial"))
            left = f" ({unfinished} unfinished ones, `….partial`, are not replayed)" if unfinished else ""
            raise MissingRecordingError(f"There is no recording (*{ENDING}) in {self.folder}{left}.", hint=_HINT)
        # By parts, not by text: the order must not depend on how a separator sorts.
        return sorted(found, key=lambda path: path.relative_to(self.folder).parts)

    def _hidden(self, path: Path) -> bool:
        return any(part.startswith(".") for part in path.relative_to(self.folder).parts)


def build(context: RigContext) -> RecordingFolder:
    """Return the rig.

    Raises
    ------
    UsageError
        If nobody said where the recordings are.
    """
    if context.recordings is None:
        raise UsageError(
            "The rig 'replay' needs to know where the recordings are.",
            hint=f"Name their folder with --recordings DIR. {_HINT}",
        )
    return RecordingFolder(Path(context.recordings))


@hookimpl
def tactbench_rigs() -> list[RigDescriptor]:
    """Offer the rig."""
    return [RigDescriptor(name="replay", title="recordings made elsewhere", where="tactbench.rigs.replay:build")]
