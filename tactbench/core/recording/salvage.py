"""What a crash left behind: looked at, or turned into a recording that says so."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from tactbench.core.errors import FormatError
from tactbench.core.recording import format as layout
from tactbench.core.recording import image
from tactbench.core.recording.partial import Columns, read_partial
from tactbench.core.recording.reader import Recording, parse_meta
from tactbench.core.recording.writer import cannot_write
from tactbench.core.spec.sensor import StreamSpec

REMARK = "Rescued: the recording broke off and is not whole."


def salvage(path: Path) -> Recording:
    """Open an unfinished recording (``….partial``): every block that had been written can be read.

    It may still be growing: what is there now is what is seen.

    Raises
    ------
    MissingRecordingError
        If there is no such file.
    FormatError
        If it is not an unfinished recording.
    """
    path = Path(path)
    text, blocks = read_partial(path)
    specs = layout.specs_by_name(parse_meta(path, text))
    file = image.build(text, specs, _fitting(path, specs, blocks), {})
    return Recording(path, file, text, complete=False)


def rescue(path: Path, target: Path) -> None:
    """Turn an unfinished recording into a finished one at `target`; its remarks say that it broke off.

    The unfinished one stays where it is.

    Raises
    ------
    MissingRecordingError
        If there is no such file.
    FormatError
        If it is not an unfinished recording.
    RecordingError
        If `target` cannot be written.
    """
    path, target = Path(path), Path(target)
    text, blocks = read_partial(path)
    meta = parse_meta(path, text)
    specs = layout.specs_by_name(meta)
    text = layout.meta_text(meta.model_copy(update={"remarks": (*meta.remarks, REMARK)}))
    with image.build(text, specs, _fitting(path, specs, blocks), {}) as file:
        digest = Recording(path, file, text, complete=True).content_digest()
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            image.store(file, digest, target)
        except OSError as error:
            raise cannot_write(target, error) from error


def _fitting(
    path: Path, specs: Mapping[str, StreamSpec], blocks: Iterable[tuple[str, Columns]]
) -> Iterator[tuple[str, Columns]]:
    """Yield the blocks; FormatError for one that the meta does not know."""
    for stream, columns in blocks:
        data = columns.get("data")
        if stream not in specs or data is None or data.shape[1:] != (len(specs[stream].channels),):
            raise FormatError(
                f"{path} holds a block of {stream!r} that its meta does not know.", hint="Was it put together by hand?"
            )
        yield stream, columns
