"""The twin: a simulated rig, the embedded default (see ``docs/twin.md``)."""

from __future__ import annotations

from tactbench.plugin import EffectDescriptor, RigDescriptor, hookimpl

TACTBENCH_API = 1


@hookimpl
def tactbench_rigs() -> list[RigDescriptor]:
    """Offer the rig."""
    return [
        RigDescriptor(
            name="twin", title="Simulated parallel manipulator", where="tactbench.rigs.twin.rig:build", simulated=True
        )
    ]


@hookimpl
def tactbench_effects() -> list[EffectDescriptor]:
    """Offer the effects."""
    from tactbench.rigs.twin.effects.declarations import EFFECTS

    return list(EFFECTS)
