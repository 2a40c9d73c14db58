"""The marks that stand behind scores, and what each of them means."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from itertools import chain, compress
from typing import Any

from tactbench.core.leaderboard.column_table import ColumnTable
from tactbench.core.leaderboard.text import visible

DAGGER = (
    "† test-set statistics were used: the protocol drops test rows by the test set's own mean and deviation, and "
    "`karl2016` scales each set, the test set too, by its own. A deployed sensor cannot; protocol `deployable` shows "
    "what it can."
)


def score_marks(by_key: ColumnTable) -> list[str]:
    """Return what stands behind each score: † for test-set statistics, ‡ for what its row is stamped with."""
    given = zip(by_key["dagger"], by_key["stamps"], strict=True)
    return [(" †" if dagger else "") + (" ‡" if stamps else "") for dagger, stamps in given]


def mark_notes(by_key: ColumnTable) -> list[str]:
    """Return what the marks behind scores mean: ‡ and †, each once."""
    dagger = [DAGGER] if any(by_key["dagger"]) else []
    stamps = dict.fromkeys(f"‡ {visible(str(stamp))}" for stamp in chain.from_iterable(filter(None, by_key["stamps"])))
    return [*stamps, *dagger]


def simulation_notes(by_key: ColumnTable) -> list[str]:
    """Return what SIM and EMULATED mean, and what the simulations assumed."""
    assumed = list(compress(by_key["assumptions"], by_key["simulated"]))
    told = dict.fromkeys(map(_assumptions, {id(one): one for one in assumed}.values()))
    emulated = by_key.known("emulated")
    marks = [
        text
        for text, some in (
            ("SIM: simulated by the twin", [*compress(map(operator.not_, emulated), by_key["simulated"])]),
            ("EMULATED: read through the drivers from emulated devices that the twin moved", emulated),
        )
        if any(some)
    ]
    return [f"{'; '.join(marks)}; never ranked against hardware. Assumed: {one}." for one in told]


def _assumptions(assumptions: Mapping[str, Any]) -> str:
    told = ", ".join(f"{key} {value}" for key, value in sorted(assumptions.items()))
    return visible(told) or "see docs/twin.md"
