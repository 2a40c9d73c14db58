"""What the effects of a plan cost on this machine, measured by carrying the plan out."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from tactbench.plugin import IndenterDescriptor, Scene, SensorDescriptor
from tactbench.plugin.simulation import Explained
from tactbench.rigs.twin.contact.stages import forget_tables
from tactbench.rigs.twin.fidelity import DEFAULT
from tactbench.rigs.twin.planner import Plan
from tactbench.rigs.twin.preparation import carried_out

_SEED = 1
"""Costs do not depend on what is drawn."""


def explained(
    indenters: Sequence[IndenterDescriptor],
    sensor: SensorDescriptor,
    scene: Scene,
    plan: Plan,
    rounds: int,
) -> list[Explained]:
    """Return the plan's entries, those included with their median cost over `rounds` recordings."""
    if not rounds:
        return [Explained(entry, None) for entry in plan.entries]
    runs = []
    for _ in range(rounds + 1):
        forget_tables()
        runs.append(carried_out(sensor, scene, _SEED, plan, DEFAULT, indenters))
    del runs[0]  # it paid for imports
    rows = []
    for entry in plan.settled(runs[-1].settled):
        if not entry.included:
            rows.append(Explained(entry, None))
        elif entry.effect in plan.lent:
            rows.append(Explained(entry, None, "part of the contact"))
        else:
            rows.append(Explained(entry, statistics.median(run.spent_s[entry.effect] for run in runs)))
    forget_tables()  # the next recording of the scene solves its contact itself
    return rows
