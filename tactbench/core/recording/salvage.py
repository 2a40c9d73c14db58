"""Opening of unfinished recordings, and their conversion into recordings that state so."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tactbench.core.files import writable
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
    meta, text = _fitted(journal, parse_meta(path, journal.text))
    file = image.build(meta, text, journal.blocks(), journal.annotations, complete=False)
    recording = Recording(path, h5py.File(h5py.h5f.open_file_image(file)), text, complete=False)
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
    meta, text = _fitted(journal, meta.model_copy(update=update))
    with writable(target):
        target.parent.mkdir(parents=True, exist_ok=True)
    aside = layout.completing_path(target)
    image.store(target, meta, text, journal.blocks(), journal.annotations, aside=aside, replace=False, sync=True)


def _fitted(journal: Journal, meta: RecordingMeta) -> tuple[RecordingMeta, str]:
    """Return the meta with clock fits and counts of rows from the blocks, and the same as text."""
    rows: Counter[str] = Counter()

    def counted() -> Iterator[tuple[str, Columns]]:
        for stream, columns in journal.blocks():
            rows[stream] += len(columns["data"])
            yield stream, columns

    fitted = with_clock_fits(meta, counted())
    streams = {name: counts.model_copy(update={"written": rows[name]}) for name, counts in meta.streams.items()}
    fitted = fitted.model_copy(update={"streams": streams})
    return fitted, layout.meta_text(fitted)
