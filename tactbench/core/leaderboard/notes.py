"""What an answer chose, and what was left out of its data, in words."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping

from tactbench.core.leaderboard.names import Row

_SET = re.compile(r"^(training|validation|test) (?=rows )")
_SIGMA = re.compile(r"^rows with (.+) beyond three sigma$")
MOST_CHANNELS = 4


def picked(row: Row) -> str:
    """Return what was chosen on validation data: parameters, and `k`, the samples that the mean filter looks back."""
    return ", ".join(
        f"{key} = {value:g}" if isinstance(value, int | float) else f"{key} = {value}"
        for key, value in sorted(row["chosen"].items())
    )


def count_texts(counts: Mapping[str, int]) -> list[str]:
    """Return one text a reason, of a cell's counts."""
    sums: Counter[str] = Counter()
    beyond: Counter[str] = Counter()
    for what, count in counts.items():
        reason = _SET.sub("", what)
        sigma = _SIGMA.match(reason)
        if sigma:
            beyond[sigma[1]] += count
        else:
            sums[reason] += count
    texts = [f"{what}: {count}" for what, count in sums.items() if count]
    if beyond:
        listed = ", ".join(f"{channel} {count}" for channel, count in beyond.most_common(MOST_CHANNELS))
        more = len(beyond) - MOST_CHANNELS
        texts.append(f"rows beyond three sigma in {listed}" + (f" and {more} more channels" if more > 0 else ""))
    return texts
