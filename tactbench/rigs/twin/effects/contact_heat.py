"""Heat through the contact: how far it warms or cools the core."""

from __future__ import annotations

from tactbench.rigs.twin.contact.stages import round_contact_mm
from tactbench.rigs.twin.effects.heated_core import HeatedCore, disc_conductance_w_per_k
from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Let heat flow between the core and an indenter of known temperature, through the contact's own radius."""
    core = HeatedCore.of(run.scene, run.sensor.spec)
    indenter = run.scene.environment.indenter_temperature
    conductivity = run.sensor.spec.parameters.get("contact_conductivity")
    if core is None or indenter is None or conductivity is None:
        return
    for track in run.tracks:
        conductance = disc_conductance_w_per_k(round_contact_mm(run, track.force_n), conductivity.to("W/m/K"))
        track.warmth_k = core.warmth(run.scene, track.t_s, conductance, indenter.to("degC"))
