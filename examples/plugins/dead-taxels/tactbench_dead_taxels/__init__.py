"""A simulation effect: taxels that have died and stay where they were. With ``--effects +dead-taxels``."""

from tactbench.plugin import hookimpl
from tactbench.plugin.simulation import EffectDescriptor

TACTBENCH_API = 2


@hookimpl
def tactbench_effects() -> list[EffectDescriptor]:
    """Offer the effect. What the converter stored is what stays."""
    return [
        EffectDescriptor(
            name="dead-taxels",
            title="Dead taxels",
            where="tactbench_dead_taxels.effect:apply",
            consumes=("stored",),
            produces=("stored",),
            called_for="tactbench_dead_taxels.called_for:dead",
        )
    ]
