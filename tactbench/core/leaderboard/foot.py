"""What stands at the foot of every table: who computed it, with what, where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.text import visible
from tactbench.core.matrix import provenance

Row = Mapping[str, Any]


def foot_of(several: Sequence[Row]) -> tuple[str, ...]:
    """Return the sentences on the runs that rows are from; they are as many as there are kinds of runs."""
    told = getattr(provenance, "foot", None)
    return tuple(visible(sentence) for sentence in told(several)) if several and told else ()
