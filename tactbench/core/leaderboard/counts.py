"""What was left out, told shortly: sums over the sets, the busiest channels first; the JSON row has every count."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping

_SET = re.compile(r"^(training|validation|test) (rows .*)$")
_SIGMA = re.compile(r"^rows with (.+) beyond three sigma$")
MOST_CHANNELS = 4


def told_counts(counts: Mapping[str, int]) -> list[str]:
    """Return one text a reason, of a cell's counts."""
    sums: Counter[str] = Counter()
    beyond: Counter[str] = Counter()
    for what, count in counts.items():
        in_a_set = _SET.match(what)
        reason = in_a_set[2] if in_a_set else what
        sigma = _SIGMA.match(reason)
        if sigma:
            beyond[sigma[1]] += count
        else:
            sums[reason] += count
    told = [f"{what}: {count}" for what, count in sums.items() if count]
    if beyond:
        listed = ", ".join(f"{channel} {count}" for channel, count in beyond.most_common(MOST_CHANNELS))
        more = len(beyond) - MOST_CHANNELS
        rest = f" and {more} more channels" if more > 0 else ""
        told.append(f"rows beyond three sigma in {listed}{rest}")
    return told
