"""All groups of oracles, in the order in which a reader would ask for them."""

from __future__ import annotations

from collections.abc import Sequence

from tactbench.plugin.simulation import Check


def checks() -> Sequence[Check]:
    """Return every check of the twin against what must be true."""
    from tactbench.rigs.twin.verification import contact, memory, omission, tangential

    return [
        *contact.checks(),
        *memory.checks(),
        *tangential.checks(),
        *omission.checks(),
    ]
