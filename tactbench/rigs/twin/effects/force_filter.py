"""A low-pass on the recorded force."""

from __future__ import annotations

from tactbench.rigs.twin.effects.memory import lag, time_constant_s
from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Filter the reference force, noise included, by a first-order low-pass at the scene's ``force_filter``.

    Exact for a force that is straight between samples, whatever the steps. It begins settled on the first sample.
    Tangential components pass the same filter.
    """
    cutoff = run.scene.environment.force_filter
    if cutoff is None:
        return
    tau_s = time_constant_s(cutoff.to("Hz"))
    run.reference_n = lag(run.t_s, run.reference_n, tau_s)
    for name, (channel, read) in run.reference_more.items():
        if channel.kind == "force":
            run.reference_more[name] = (channel, lag(run.t_s, read, tau_s))
