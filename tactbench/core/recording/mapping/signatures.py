"""Recognition of a file's format by its first bytes, which the name and the mapping may contradict."""

from __future__ import annotations

import zipfile
from contextlib import suppress
from pathlib import Path

from tactbench.core.errors import MappingError

_FORMAT = "Write `format: {}` under `read`."
_SIGNATURES: tuple[tuple[bytes, str, str, str], ...] = (
    # first bytes; what the file is; the format that reads it; the next step
    (b"\x1f\x8b", "is compressed with gzip", "", "Unpack it: `gunzip FILE`."),
    (b"PK\x03\x04", "is a zip archive", "", "Unpack it: `unzip FILE`."),
    (b"\xd0\xcf\x11\xe0", "is a workbook of Excel before 2007 (.xls)", "", "Save the sheet as .xlsx or CSV."),
    (b"\xff\xfe", "is text in UTF-16", "", "Convert it: `iconv -f UTF-16 -t UTF-8 FILE > NEW`."),
    (b"\xfe\xff", "is text in UTF-16", "", "Convert it: `iconv -f UTF-16 -t UTF-8 FILE > NEW`."),
    (b"version https://git-lfs", "is a Git LFS pointer; the table is not here", "", "Fetch it: `git lfs pull`."),
    (b"/annex/objects/", "is a git-annex pointer; the table is not here", "", "Fetch it: `datalad get FILE`."),
    (b"<!doctype html", "is a web page", "", "Download the file itself: a link to the raw file, or after signing in."),
    (b"<html", "is a web page", "", "Download the file itself: a link to the raw file, or after signing in."),
    (b"#ROSBAG V", "is a bag of ROS 1", "",
     "Make a bag of ROS 2 in MCAP of it with `rosbags-convert` (pip install rosbags), then `format: mcap`."),
    (b"SQLite format 3\0", "is an SQLite database, as bags of ROS 2 are", "",
     "Convert a bag: `mcap convert FILE NEW.mcap`, then `format: mcap`; of another database, save a table as CSV."),
    (b"\x89HDF\r\n\x1a\n", "is an HDF5 file", "",
     "A recording of tactbench needs no import: `--recordings`. Of another file, save the table as CSV or .npz."),
    (b"MATLAB 7.3", "is a MATLAB file of version 7.3", "", "Save it with -v7, or the table as CSV."),
    (b"MATLAB 5.0", "is a MATLAB file", "mat", _FORMAT.format("mat")),
    (b"PAR1\x15", "is a Parquet file", "parquet", _FORMAT.format("parquet")),
    (b"\x93NUMPY", "is a NumPy array", "npy", _FORMAT.format("npy")),
    (b"\x89MCAP0", "is an MCAP bag", "mcap", _FORMAT.format("mcap")),
)  # fmt: skip


def require_format(path: Path, shown: str, wanted: str) -> None:
    """Raise MappingError if a file cannot be read, or is by its first bytes of another format than `wanted`."""
    try:
        with path.open("rb") as opened:
            first = opened.read(64).removeprefix(b"\xef\xbb\xbf").lstrip()
    except OSError as error:
        raise MappingError(f"{shown} cannot be read: {error.strerror}.", hint="Check its permissions.") from error
    for begins, what, read_by, step in _SIGNATURES:
        # The letters of a web page may have either case; those of other files may not: a table may begin with "par1".
        if not (first.lower() if begins.startswith(b"<") else first).startswith(begins):
            continue
        if what == "is a zip archive":
            what, read_by, step = _zipped(path) or (what, read_by, step)
        if read_by != wanted:
            raise MappingError(
                f"{shown} {what}, where `format: {wanted}` is expected.", hint=step.replace("FILE", shown)
            )


def _zipped(path: Path) -> tuple[str, str, str] | None:
    """Return the entry for a zip archive that is a workbook or holds arrays; None for another archive."""
    names: list[str] = []
    with suppress(zipfile.BadZipFile, OSError), zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    if "xl/workbook.xml" in names:
        return "is an Excel workbook", "xlsx", _FORMAT.format("xlsx")
    if names and all(name.endswith(".npy") for name in names):
        return "is an archive of NumPy arrays", "npz", _FORMAT.format("npz")
    return None
