"""Columns of a large table, written small: one plane of bytes each, deflated, as text that a browser reads back.

A column is one value a row. Two ways of writing it stand in rooms of their own: `words` (few different values, each
written once) and `digits` (numbers as they are shown). Both end as planes: the lowest bytes of all rows first, then the
next higher ones, which deflate far better than rows do.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LEVEL = 6
"""Of zlib: 9 saves one part in two hundred and takes four times as long."""
Column = dict[str, Any]
"""What the page's script needs to read a column: its kind, and the numbers of its blobs."""


def deflated(content: bytes) -> str:
    """Return bytes as a zlib stream in base64."""
    return base64.b64encode(zlib.compress(content, LEVEL)).decode()


class Pack:
    """Blobs by number; equal ones are kept once."""

    def __init__(self) -> None:
        self._numbers: dict[bytes, int] = {}
        self._blobs: list[str] = []
        self.size = 0
        """Characters of all blobs."""

    def add(self, content: bytes) -> int:
        """Return the number of a blob with this content."""
        number = self._numbers.get(content)
        if number is None:
            blob = deflated(content)
            number = self._numbers[content] = len(self._blobs)
            self._blobs.append(blob)
            self.size += len(blob)
        return number

    def forget_from(self, number: int) -> None:
        """Forget the blobs from `number` on."""
        for blob in self._blobs[number:]:
            self.size -= len(blob)
        del self._blobs[number:]
        self._numbers = {content: known for content, known in self._numbers.items() if known < number}

    @property
    def blobs(self) -> list[str]:
        """The blobs in order: zlib streams in base64, whose alphabet cannot end a script."""
        return self._blobs

    def zeros(self, count: int) -> list[int]:
        """Return the same as `planes` of zeros."""
        return [self.add(bytes(count)), 1]

    def planes(self, values: Sequence[int] | NDArray[np.integer[Any]]) -> list[int]:
        """Return the blob of whole numbers from 0 to 2^53, and the bytes that each of them takes."""
        import numpy as np

        whole = np.asarray(values, dtype="<u8")
        width = max(1, (int(whole.max(initial=0)).bit_length() + 7) // 8)
        content = whole.view(np.uint8).reshape(len(whole), 8)[:, :width].T.tobytes()
        return [self.add(content), width]
