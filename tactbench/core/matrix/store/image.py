"""The bytes of a shard, before HDF5 looks at them."""

from __future__ import annotations

from pathlib import Path

from tactbench.core.errors import FormatError
from tactbench.core.files import read_regular
from tactbench.core.matrix.store import limits

SEE = "Delete it, and the next run computes the cell again."


def read_image(path: Path) -> bytes:
    """Return the bytes of a shard.

    Raises
    ------
    FormatError
        If there is no such file, it is a link or no file at all, or larger than any shard of ours.
    """
    try:
        image = read_regular(path, limits.SHARD_BYTES, follow=False)  # links may lead anywhere
    except OSError as error:
        raise FormatError(f"The shard {path} cannot be read: {error}.", hint=SEE) from error
    if len(image) > limits.SHARD_BYTES:
        raise FormatError(f"The shard {path} is larger than {limits.SHARD_BYTES // 2**20} MiB.", hint=SEE)
    return image
