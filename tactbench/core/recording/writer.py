"""Writing a recording, so that a crash loses at most the block in flight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from tactbench.core.errors import RecordingError, RigError, UnwritableError
from tactbench.core.recording import format as layout
from tactbench.core.recording import image
from tactbench.core.recording.partial import Annotations, Columns, Partial, read_blocks
from tactbench.core.recording.reader import Recording
from tactbench.core.recording.times import with_clock_fits
from tactbench.core.samples import Block
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec


class RecordingWriter:
    """Writes one recording; use it as a context manager.

    While it is open the file is called ``<path>.partial`` and holds, after every block, all blocks so far. Leaving
    the context completes it: times of devices put on the host's clock, compressed anew, content digest, sync, rename
    to `path`. Leaving it by an exception removes it, for the caller knows that it failed and can record again, or
    keeps what there is with :meth:`complete_at`; only a crash of the process leaves the ``.partial`` behind, for
    :func:`tactbench.core.recording.salvage.salvage`.

    Parameters
    ----------
    path
        Where the finished recording shall lie; a file that is there is replaced at the end, not before.
    meta
        What it says about itself; :meth:`revise` changes it until the end.

    Raises
    ------
    RecordingError
        If the file cannot be written, or `meta` cannot be stored.
    """

    def __init__(self, path: Path, meta: RecordingMeta) -> None:
        self.path = path
        self.meta = meta
        self._aside = layout.partial_path(path)
        self._specs = layout.specs_by_name(meta)
        self.content_digest = ""
        """Digest of what was written, once the recording is complete."""
        self._annotations: Annotations = {}
        self._has: dict[str, tuple[bool, bool]] = {}
        self._partial: Partial | None = None
        self._keep_journal = False

    def __enter__(self) -> RecordingWriter:
        text = self._text()
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._partial = Partial(self._aside, text)
        except OSError as error:
            raise cannot_write(self.path, error) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._complete(self._open, self.path)
        except OSError as failure:
            raise cannot_write(self.path, failure) from failure
        finally:
            self._clear()

    @property
    def rows(self) -> Mapping[str, int]:
        """Rows of the streams that have had a block."""
        return dict(self._open.rows)

    def complete_at(self, target: Path) -> None:
        """Complete the recording at `target` instead, before the context is left by an exception.

        Raises
        ------
        RecordingError
            If the disk refuses it; the journal then stays, as after a crash.
        """
        self._keep_journal = True
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            self._complete(self._open, target)
        except OSError as failure:
            raise cannot_write(target, failure) from failure
        self._keep_journal = False

    def revise(self, **changes: Any) -> None:
        """Change fields of the meta that are known only later (`drawn`, `counts`, `provenance` …).

        Raises
        ------
        RecordingError
            If a field is unknown or a value does not fit it, or cannot be stored; sensor and reference cannot change
            any more, nor whether there is a clock. If the disk refuses it.
        """
        fixed = sorted({"sensor", "reference"} & set(changes))
        if (changes.get("clock", self.meta.clock) == "none") != (self.meta.clock == "none"):
            fixed.append("clock")
        if fixed:
            raise RecordingError(f"{', '.join(fixed)} cannot change once a recording is open.", hint="Open another.")
        try:
            self.meta = RecordingMeta.model_validate({**dict(self.meta), **changes})
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            where = ".".join(str(part) for part in first["loc"])
            raise RecordingError(
                f"The recording {self.meta.name!r} cannot say {where}: {first['msg']}.", hint="Correct the rig."
            ) from error
        try:
            self._open.revise(self.meta.model_dump(mode="json", include=set(changes)))
        except ValueError as error:
            raise self._not_storable(error) from error
        except OSError as error:
            raise cannot_write(self.path, error) from error

    def append(self, block: Block) -> None:
        """Add `block` to its stream and flush it.

        Raises
        ------
        RigError
            If the block does not fit its stream: unknown name, wrong number of channels or of times, a clock where
            there is none, readings that do not fit the stored type.
        RecordingError
            If the disk refuses it.
        """
        spec = self._checked(block)
        columns = _columns(block, spec)
        has = (block.sequence is not None, block.device_ns is not None)
        if self._has.setdefault(spec.name, has) != has:
            raise RigError(
                f"Some blocks of stream {spec.name!r} have sequence numbers or device times and some have none.",
                hint="Give them with all blocks of a stream, or with none.",
            )
        if spec.name in self._annotations:
            raise RigError(
                f"A block of stream {spec.name!r} came after its rows were labelled.",
                hint="Label after the last block.",
            )
        try:
            self._open.append(spec.name, columns)
        except OSError as error:
            raise cannot_write(self.path, error) from error

    def annotate(self, stream: str, name: str, values: Sequence[str] | npt.NDArray[Any]) -> None:
        """Attach a label to every row of `stream`: text or whole numbers, one a row, after its last block.

        Raises
        ------
        RigError
            If the stream has no rows yet, or another number of them, or the values are neither.
        RecordingError
            If the disk refuses it.
        """
        column = np.asarray(values)
        rows = self._open.rows.get(stream)
        if column.shape != (rows,):
            raise RigError(
                f"The annotation {name!r} has shape {column.shape} for {rows or 'no'} rows of {stream!r}.",
                hint="Give one value a row, after the last block.",
            )
        if column.dtype.kind not in "iuU" or any("\0" in text for text in column.tolist() if isinstance(text, str)):
            raise RigError(
                f"The annotation {name!r} holds {column.dtype}; labels are text without NUL, or whole numbers.",
                hint="Turn other labels into text.",
            )
        try:
            self._open.annotate(stream, name, column)
        except OSError as error:
            raise cannot_write(self.path, error) from error
        self._annotations.setdefault(stream, {})[name] = column

    @property
    def _open(self) -> Partial:
        if self._partial is None:
            raise RecordingError(f"The recording {self.path} is not open.", hint="Use it as a context manager.")
        return self._partial

    def _text(self) -> str:
        try:
            return layout.meta_text(self.meta)
        except ValueError as error:
            raise self._not_storable(error) from error

    def _not_storable(self, error: ValueError) -> RecordingError:
        return RecordingError(
            f"What the recording {self.meta.name!r} says about itself cannot be stored: {error}.",
            hint="Use text and finite numbers; leave out what is not known.",
        )

    def _checked(self, block: Block) -> StreamSpec:
        spec = self._specs.get(block.stream)
        if spec is None:
            raise RigError(
                f"A block of stream {block.stream!r} came; the recording has {', '.join(sorted(self._specs))}.",
                hint="Declare the stream in the sensor's spec or the rig's reference.",
            )
        if block.data.ndim != 2 or block.data.shape[1] != len(spec.channels):
            raise RigError(
                f"A block of stream {block.stream!r} has shape {block.data.shape}, not (n, {len(spec.channels)}).",
                hint="A block is rows by channels, in the order of the stream's spec.",
            )
        for name, values in (
            ("t_ns", block.t_ns), ("sequence", block.sequence), ("device_ns", block.device_ns),
            ("quality", block.quality),
        ):  # fmt: skip
            if values is not None and len(values) != len(block.data):
                raise RigError(
                    f"A block of stream {block.stream!r} has {len(block.data)} rows but {len(values)} of {name}.",
                    hint="Give one of each a row.",
                )
        if (block.t_ns is None) != (self.meta.clock == "none"):
            has = "no times" if block.t_ns is None else "times"
            raise RigError(
                f"A block of stream {block.stream!r} has {has}; the recording's clock is {self.meta.clock!r}.",
                hint="Give every block its times, or say that there is no clock; never invent one.",
            )
        return spec

    def _complete(self, partial: Partial, target: Path) -> None:
        if any(timed for _, timed in self._has.values()):
            self.meta = with_clock_fits(self.meta, read_blocks(self._aside))
        text, memory = self._text(), BytesIO()
        with image.build(memory, self.meta, text, read_blocks(self._aside), self._annotations) as file:
            self.content_digest = self._check(Recording(self._aside, file, text, complete=True), partial)
            image.store(memory, file, self.content_digest, target)

    def _check(self, recording: Recording, partial: Partial) -> str:
        """Return the digest of the stored bytes, after making sure that every row that came is there."""
        rows = {name: len(recording.stream(name)) for name in recording.stream_names}
        if any(rows.get(name, 0) < count for name, count in partial.rows.items()):
            raise RecordingError(
                f"The recording {self.path} lost rows while it was made: {rows} of {partial.rows} are there.",
                hint="Did another process write to it, or did the disk fail? Record it again.",
            )
        return recording.content_digest()

    def _clear(self) -> None:
        """Remove the journal, unless it is all that is left of the recording."""
        if self._partial is not None:
            self._partial.close()
            self._partial = None
        if not self._keep_journal:
            with suppress(OSError):  # a disk that refuses this has refused the recording before
                self._aside.unlink(missing_ok=True)


def _columns(block: Block, spec: StreamSpec) -> Columns:
    """Return what is stored of `block`, by column; quality only if something is not good."""
    columns: Columns = {"data": _stored(block.data, spec)}
    for name, numbers in (("t_ns", block.t_ns), ("sequence", block.sequence), ("device_ns", block.device_ns)):
        if numbers is not None:
            columns[name] = _whole(np.asarray(numbers), name, spec)
    if block.quality is not None:
        if block.quality.shape != block.data.shape:
            raise RigError(
                f"A block of stream {spec.name!r} has data {block.data.shape} and quality {block.quality.shape}.",
                hint="Give one quality a sample of each channel.",
            )
        if block.quality.any():
            columns["quality"] = np.asarray(block.quality, dtype=np.uint8)
    return columns


def _whole(numbers: npt.NDArray[Any], name: str, spec: StreamSpec) -> npt.NDArray[np.int64]:
    if numbers.dtype.kind not in "iu" and not (
        numbers.dtype.kind == "f" and np.array_equal(np.rint(numbers), numbers) and (np.abs(numbers) < 2.0**63).all()
    ):
        raise RigError(
            f"A block of stream {spec.name!r} has {name} that are no whole numbers, NaN perhaps.",
            hint="Give times as whole nanoseconds and sequence numbers as counted; never invent one.",
        )
    return numbers.astype(np.int64)


def _stored(data: npt.NDArray[Any], spec: StreamSpec) -> npt.NDArray[Any]:
    declared = np.dtype(spec.dtype)
    if declared.kind == "f" or data.dtype == declared:
        return data.astype(declared, copy=False)
    limits = np.iinfo(declared)
    fits = data.dtype.kind in "iuf" and bool(
        np.all((data >= limits.min) & (data <= limits.max)) and np.array_equal(np.rint(data), data)
    )
    if not fits:
        raise RigError(
            f"Stream {spec.name!r} stores {spec.dtype}, and a reading does not fit it without loss.",
            hint="Round and clip in the rig, or declare a wider dtype in the sensor's spec.",
        )
    return data.astype(declared)


def cannot_write(path: Path, error: OSError) -> UnwritableError:
    """Return the error to raise when the disk refuses."""
    reason = error.strerror or error
    return UnwritableError(
        f"The recording {path} cannot be written: {reason}.",
        hint="Check the folder's permissions and the free space, or give another with --out.",
    )
