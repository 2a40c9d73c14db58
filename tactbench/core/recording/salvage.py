"""Opening of unfinished recordings, and their conversion into recordings that state so."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tactbench.core.recording import format as layout
from tactbench.core.recording import image
from tactbench.core.recording.clock_fit import with_clock_fits
from tactbench.core.recording.partial import Columns, Journal, read_journal
from tactbench.core.recording.reader import Recording, parse_meta
from tactbench.core.spec.recording import RecordingMeta

REMARK = "Rescued: the recording broke off and is not whole."


def salvage(path: Path) -> Recording:
    """Open an unfinished recording (``….partial``), in which every block can be read that had been written.

    It may still be growing: what is there now is what is seen.

    Raises
    ------
    MissingRecordingError
        If there is no such file.
    FormatError
        If it is not an unfinished recording.
    """
    import h5py

    journal = read_journal(path)
    meta = _fitted(journal, parse_meta(path, journal.text))
    file = image.build(meta, journal.blocks(), journal.annotations, complete=False)
    recording = Recording(path, h5py.File(h5py.h5f.open_file_image(file)), layout.meta_text(meta), complete=False)
    recording.verify()
    return recording


def rescue(path: Path, target: Path) -> None:
    """Convert an unfinished recording into a finished one at `target`, excluded from evaluations since it broke off.

    The unfinished one stays where it is.

    Raises
    ------
    MissingRecordingError
        If there is no such file.
    FormatError
        If it is not an unfinished recording.
    RecordingError
        If `target` exists, or cannot be written.
    """
    image.require_free(target)
    journal = read_journal(path)
    meta = parse_meta(path, journal.text)
    excluded = meta.excluded or "interrupted: it broke off, and was rescued"
    update = {"remarks": (*meta.remarks, REMARK), "excluded": excluded}
    meta = _fitted(journal, meta.model_copy(update=update))
    image.store(target, meta, journal.blocks(), journal.annotations, aside=layout.completing_path(target))


def _fitted(journal: Journal, meta: RecordingMeta) -> RecordingMeta:
    """Return the meta with clock fits and counts of rows from the blocks."""
    rows: Counter[str] = Counter()

    def counted() -> Iterator[tuple[str, Columns]]:
        for stream, columns in journal.blocks():
            rows[stream] += len(columns["data"])
            yield stream, columns

    fitted = with_clock_fits(meta, counted())
    streams = {name: counts.model_copy(update={"written": rows[name]}) for name, counts in meta.streams.items()}
    return fitted.model_copy(update={"streams": streams})
