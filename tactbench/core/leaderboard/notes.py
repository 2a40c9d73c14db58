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
    """Return what an answer chose on validation data: k of `window_grid` with its meaning, others by name."""
    parts = []
    for key, value in sorted(row["chosen"].items()):
        name, _, fold = str(key).partition(" of fold ")
        text = f"{value:g}" if isinstance(value, int | float) else str(value)
        where = f" of fold {fold}" if fold else ""
        if name == "k":
            parts.append(f"k = {text} samples before the newest in the mean filter{where}")
        elif name == "threshold":
            parts.append(f"{name} = {text}{where} (of the score that {row['estimator']} gives a frame)")
        else:
            parts.append(f"{name.rstrip('_')} = {text}{where} (parameter of {row['estimator']})")
    return ", ".join(parts)


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
