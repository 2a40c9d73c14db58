"""Numbers as they are shown, written small and read back letter by letter; beside them what they are sorted by.

``12.3 ms`` is the pattern ``##.# ms`` and the whole number 123. The pattern also says what the number shown is worth
(123e-4 s), so that the value it was rounded from takes one byte more: how far it is from the shown one, in parts of
the last digit. Texts that are no such thing are patterns of their own, without digits.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tactbench.core.leaderboard.board.pack import Column, Pack

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MASK = "#"
STEPS = 254
"""Parts of the last digit shown that a value is told to. One byte holds them and a sign for no value."""
FEW_STEPS = 14
"""The same where room is short: half a byte, once deflated."""
NO_VALUE = 255
MOST_DIGITS = 15
"""Digits that a float64 holds for sure, which is what the page's script counts in."""
MOST_NUMBERS = 3
"""An interval has two, and a mark behind it may be a third."""
BETWEEN = ("…", "–")
"""What stands between the two ends of an interval."""
FEW = 20
"""One value in so many may be written out because it is not what its text shows; if more are, all are."""

_SECONDS = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "min": 60.0, "h": 3600.0}
_MASKED = bytes.maketrans(b"0123456789", MASK.encode() * 10)
_NUMBER = re.compile(r"([-−]?)(#[#\u202f]*(?:\.(#+))?)")
_UNIT = re.compile(r"\s*(min|ms|µs|s|h)(?![A-Za-z])")


@dataclass(frozen=True)
class Pattern:
    """A text without its digits."""

    text: str
    counts: tuple[int, ...] = ()
    """Digits of each number in it."""
    scales: tuple[float, ...] = ()
    """What one in the last digit of each number is worth; negative after a minus."""
    shares: tuple[float, ...] = ()
    """How much of each number is the value that the text shows: an interval's middle, else the first number."""


def read_pattern(masked: str) -> Pattern | None:
    """Return the pattern that a text with ``#`` for each digit is, or None if it is none of ours."""
    found = list(_NUMBER.finditer(masked))
    counts = tuple(one[2].count(MASK) for one in found)
    if sum(counts) != masked.count(MASK) or sum(counts) > MOST_DIGITS or len(found) > MOST_NUMBERS:
        return None
    if re.search(r"#[eE][-+]?#", masked):
        return None
    ranged = len(found) > 1 and masked[found[0].end() : found[1].start()].strip() in BETWEEN
    unit = _UNIT.match(masked, found[1 if ranged else 0].end()) if found else None
    factor = _SECONDS[unit[1]] if unit else 1.0
    scales = tuple((-factor if one[1] else factor) / 10 ** len(one[3] or "") for one in found)
    shares = ((0.5, 0.5, 0.0) if ranged else (1.0, 0.0, 0.0))[: len(found)]
    return Pattern(masked, counts, scales, shares)


def write_digits(
    pack: Pack, texts: Sequence[str], values: Sequence[float | None] | None = None, steps: int = STEPS
) -> Column | None:
    """Write a column of texts, and what they are sorted by.

    Parameters
    ----------
    texts
        What is shown, one a row.
    values
        What each was rounded from, in seconds where it is a duration; None: what is shown is all there is. Of a text
        that is an interval it is the middle.
    steps
        Parts of the last digit that it is told to.

    Returns
    -------
    Column or None
        None if the texts cannot be written so: there are none, or one has a line break, a ``#`` or half a character.
    """
    import numpy as np

    encoded = _encoded(texts)
    if encoded is None:
        return None
    masked = encoded.translate(_MASKED).decode().split("\n")
    known = {shape: read_pattern(shape) for shape in dict.fromkeys(masked)}
    own = [place for place, shape in enumerate(masked) if known[shape] is None] if None in known.values() else []
    if own:  # texts of their own
        for place in own:
            masked[place] = texts[place]
        known = {shape: known.get(shape) or Pattern(shape) for shape in dict.fromkeys(masked)}
    patterns = [pattern for pattern in known.values() if pattern is not None]
    number = dict(zip(known, range(len(known)), strict=True))
    places = np.fromiter(map(number.__getitem__, masked), dtype=np.int64, count=len(masked))
    numbers, shown, last = _numbers(patterns, places, _whole(encoded, len(masked), own))
    column: Column = {
        "kind": "digits",
        "patterns": [[one.text, one.counts, one.scales, one.shares] for one in patterns],
        "at": pack.planes(places),
        "numbers": [pack.planes(one) for one in numbers],
    }
    if values is not None:
        column |= _write_values(pack, shown, last, np.array(values, dtype=np.float64), steps)
    return column


def _encoded(texts: Sequence[str]) -> bytes | None:
    """Return texts as lines, or None if one of them has a line break, a ``#``, or half a character."""
    joined = "\n".join(texts)
    if not texts or MASK in joined or joined.count("\n") != len(texts) - 1:
        return None
    try:
        return joined.encode()
    except UnicodeEncodeError:  # no file in UTF-8 can hold it
        return None


def _whole(encoded: bytes, count: int, own: Sequence[int]) -> NDArray[np.int64]:
    """Return (count,) all digits of each line as one whole number; 0 for those that are texts of their `own`."""
    import numpy as np

    letters = np.frombuffer(encoded, dtype=np.uint8)
    digits = letters - ord("0")  # anything else comes out larger than 9
    at = np.flatnonzero(digits < 10)
    line = np.searchsorted(np.flatnonzero(letters == ord("\n")), at)
    ends = np.cumsum(np.bincount(line, minlength=count))
    place = ends[line] - np.arange(1, len(at) + 1)
    place[place >= MOST_DIGITS] = 0  # of no number of ours
    # Of as many digits as these every sum is exact.
    whole = np.bincount(line, weights=digits[at] * (10.0 ** np.arange(MOST_DIGITS))[place], minlength=count)
    whole[list(own)] = 0
    return whole.astype(np.int64)


def _numbers(
    patterns: Sequence[Pattern], places: NDArray[np.int64], whole: NDArray[np.int64]
) -> tuple[list[NDArray[np.uint64]], NDArray[np.float64], NDArray[np.float64]]:
    """Return the numbers of each text, the value that it shows (NaN: none), and what its last digit is worth."""
    import numpy as np

    count = max((len(pattern.counts) for pattern in patterns), default=0)
    numbers = [np.zeros(len(places), dtype=np.uint64) for _ in range(count)]
    shown = np.full(len(places), np.nan)
    last = np.ones(len(places))
    order = np.argsort(places.astype(np.min_scalar_type(len(patterns))), kind="stable")
    edges = np.searchsorted(places[order], np.arange(len(patterns) + 1))
    for place, pattern in enumerate(patterns):
        if not pattern.counts:
            continue
        here = order[edges[place] : edges[place + 1]]
        rest = whole[here]
        parts: list[NDArray[np.int64]] = []
        for digits in reversed(pattern.counts):
            rest, part = np.divmod(rest, 10**digits)
            parts.insert(0, part)
        for target, part in zip(numbers, parts, strict=False):
            target[here] = part
        told = zip(parts, pattern.scales, pattern.shares, strict=True)
        shown[here] = sum(part * scale * share for part, scale, share in told)
        last[here] = abs(pattern.scales[0])
    return numbers, shown, last


def _write_values(
    pack: Pack, shown: NDArray[np.float64], last: NDArray[np.float64], values: NDArray[np.float64], steps: int
) -> Column:
    """Return the keys of a column that say what its rows are sorted by."""
    import numpy as np

    with np.errstate(invalid="ignore", over="ignore"):
        parts = np.round((values - shown) / last * steps)
        there = np.isfinite(values)
        near = there & (np.abs(parts) <= steps // 2)
        odd = np.flatnonzero(there & ~near)
        if len(odd) * FEW > len(values):
            # 32 bits: seven digits.
            return {"values": pack.add(np.where(there, values, np.nan).astype("<f4").tobytes())}
    rest = np.where(near, parts + steps // 2, NO_VALUE).astype(np.uint8)
    written: Column = {"rest": pack.add(rest.tobytes()), "steps": steps}
    if len(odd):
        written["odd"] = [[int(place), float(values[place])] for place in odd]
    return written
