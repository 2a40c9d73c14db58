"""Writing of recordings so that a crash loses at most the last block."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from tactbench.core.errors import RecordingError, RigError, TactbenchError, complaint
from tactbench.core.files import writable
from tactbench.core.recording import format as layout
from tactbench.core.recording import image
from tactbench.core.recording.format import Annotations, Array, Columns
from tactbench.core.recording.partial import JournalBlocks, Partial
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec


class RecordingWriter:
    """Writer of one recording, and context manager.

    While the writer is open, a journal ``<path>.partial`` (if this file exists, ``<path>.2.partial`` and so on)
    contains all blocks so far. Leaving the context completes the recording: device times are converted to the host's
    clock, the file is written under a temporary name, read back, and renamed to `path`; only then is the journal
    removed. After an exception, or if the recording cannot be completed, the journal of a recording from devices is
    kept, and the error names the command that converts it to a recording. Entering the context raises RecordingError
    if the file exists, or the disk refuses to write.
    """

    def __init__(self, path: Path, meta: RecordingMeta) -> None:
        self.path = path
        self.meta = meta
        self._specs = layout.specs_by_name(meta)
        self._complete = False
        self._optional: dict[str, tuple[bool, bool]] = {}
        """By stream, two booleans: blocks have sequence numbers, blocks have device times."""
        self._partial: Partial

    def __enter__(self) -> RecordingWriter:
        image.require_free(self.path)
        with writable(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._partial = Partial(self.path, layout.meta_text(self.meta))
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        try:
            if error is None:
                self.complete()
        except BaseException as failure:
            error = failure
            raise
        finally:
            self._leave(error)

    @property
    def _unique(self) -> bool:
        """True if the recording cannot be made again, or is of emulated devices, which are treated like real ones."""
        return not self.meta.simulated or self.meta.emulation is not None

    @property
    def rows(self) -> Mapping[str, int]:
        """Number of rows written so far, by stream, for streams with at least one block."""
        return self._partial.rows

    def complete(self) -> None:
        """Complete the recording now, as leaving the context does; for use inside the context after an exception.

        Raises RecordingError if the disk refuses to write; the journal is then kept, as after a crash.
        """
        journal, aside = self._partial, layout.completing_path(self._partial.path)
        blocks = JournalBlocks(journal.path, None, journal.rows)
        self.meta = image.store(self.path, self.meta, blocks, {}, aside=aside, sync=self._unique)
        self._complete = True

    def _leave(self, error: BaseException | None) -> None:
        """Close the journal, and remove it unless it has the only copy of rows that cannot be recorded again."""
        journal = self._partial
        journal.close()
        if not self._complete and any(journal.rows.values()) and self._unique:
            found = recovery(journal.path, self.path)
            if isinstance(error, TactbenchError):
                error.hint = f"{error.hint} {found}".strip()
            elif error is not None:
                error.add_note(found)
            return
        with suppress(OSError):  # a disk that refuses this has refused the recording before
            journal.path.unlink(missing_ok=True)

    def revise(self, **changes: Any) -> None:
        """Change fields of the meta that are known only later (`drawn`, `counts`, `provenance` …).

        Raises RecordingError if a field is unknown, a value does not fit its field, or the disk refuses to write.
        """
        try:
            self.meta = RecordingMeta.model_validate({**dict(self.meta), **changes})
        except ValidationError as error:
            raise RecordingError(
                f"The meta of {self.meta.name!r} would not be valid: {complaint(error)}.", hint="Correct the rig."
            ) from error
        with writable(self.path):
            self._partial.revise(self.meta.model_dump(mode="json", include=set(changes)))

    def append(self, block: Block) -> None:
        """Add `block` to its stream, and write it to the journal at once.

        Raises RecordingError if the disk refuses to write, and RigError if the block does not fit its stream: unknown
        name, wrong number of channels or of times, times in a recording without a clock, readings that do not fit the
        stored type, a force of the reference that is NaN and not marked missing.
        """
        columns = stored_columns(block, self.meta, self._specs)
        has = (block.sequence is not None, block.device_ns is not None)
        if self._optional.setdefault(block.stream, has) != has:
            raise RigError(
                f"Some blocks of stream {block.stream!r} have sequence numbers or device times and some have none.",
                hint="Give either of them with all blocks of a stream, or with no block.",
            )
        with writable(self.path):
            self._partial.append(block.stream, columns)


def write_recording(
    path: Path, meta: RecordingMeta, blocks: Iterable[Block], annotations: Annotations, *, replace: bool = False
) -> None:
    """Write a recording from blocks in memory that can be made again, so that no journal is needed.

    The clock fits of devices are added to `meta`. Raises RigError if a block does not fit its stream, and
    RecordingError if the file exists and `replace` is False, or the disk refuses to write.
    """
    specs = layout.specs_by_name(meta)
    stored = [(block.stream, stored_columns(block, meta, specs)) for block in blocks]
    aside = layout.completing_path(path)
    image.store(path, meta, stored, annotations, aside=aside, replace=replace, sync=False)


def stored_columns(block: Block, meta: RecordingMeta, specs: Mapping[str, StreamSpec]) -> Columns:
    """Return the columns of `block` in their stored types; quality only if a sample is not good.

    Raises RigError if the block does not fit its stream, one of `specs`, as :meth:`RecordingWriter.append` lists.
    """
    spec = specs.get(block.stream)
    if spec is None:
        raise RigError(
            f"A block is of stream {block.stream!r}; the recording's streams are {', '.join(sorted(specs))}.",
            hint="Declare the stream in the sensor's spec or the rig's reference.",
        )
    name = f"A block of stream {block.stream!r}"
    numbers = {"t_ns": block.t_ns, "sequence": block.sequence, "device_ns": block.device_ns}
    columns = {one: np.asarray(values) for one, values in numbers.items() if values is not None}
    if block.quality is not None:
        columns["quality"] = np.asarray(block.quality)
    for one, values in {"data": block.data, **columns}.items():
        shape = (len(block.data), len(spec.channels))[: 1 if one in numbers else 2]
        if np.shape(values) != shape or (one in numbers and values.dtype.kind not in "iu"):
            raise RigError(
                f"{name} has {one} ({values.dtype}) of shape {np.shape(values)}, where {shape} is expected.",
                hint="Give samples as (rows, channels), in the order of the spec; times and sequence numbers as "
                "whole numbers, one for each row, never invented.",
            )
    if (block.t_ns is None) != (meta.clock == "none"):
        raise RigError(
            f"{name} has {'no times' if block.t_ns is None else 'times'}; the recording's clock is {meta.clock!r}.",
            hint="Give every block its times, or declare the clock `none`; never invent times.",
        )
    quality = columns.pop("quality", np.zeros(np.shape(block.data), dtype=np.uint8)).astype(np.uint8)
    learnt = [one.kind in ("force", "torque") and spec in meta.reference for one in spec.channels]
    if (~np.isfinite(block.data) & ((quality & Quality.MISSING) == 0) & learnt).any():
        raise RigError(
            f"{name} of the reference has a force or torque that is NaN and not marked as missing.",
            hint="Mark rows without a sample by the quality MISSING.",
        )
    flags = {"quality": quality} if quality.any() else {}
    times = {one: values.astype(np.int64) for one, values in columns.items()}
    return {"data": _stored(block.data, spec), **times, **flags}


def _stored(data: Array, spec: StreamSpec) -> Array:
    declared = np.dtype(spec.dtype)
    if declared.kind == "f" or data.dtype == declared:
        return data.astype(declared, copy=False)
    limits = np.iinfo(declared)
    if (
        data.dtype.kind not in "iuf"
        or not ((data >= limits.min) & (data <= limits.max) & (np.rint(data) == data)).all()
    ):
        raise RigError(
            f"Stream {spec.name!r} stores {spec.dtype}, in which a reading cannot be stored without loss.",
            hint="Round and clip in the rig, or declare a wider dtype in the sensor's spec.",
        )
    return data.astype(declared)


def recovery(journal: Path, path: Path) -> str:
    """Return a sentence with the path of a journal, and the command that converts it to a recording."""
    import shlex

    rescued = path.with_name(f"{path.stem}-rescued{path.suffix}") if path.exists() else path
    command = shlex.join(["tactbench", "inspect", str(journal), "--rescue", str(rescued)])
    return f"The rows recorded so far are in {journal}; convert it to a recording:  {command}"
