"""Noise and low-pass filter of the reference force sensor."""

from __future__ import annotations

from tactbench.rigs.twin.effects.memory import lag, time_constant_s
from tactbench.rigs.twin.synthesis import Synthesis


def noise(run: Synthesis) -> None:
    """Add white noise to the reference force, unfiltered as in the paper; the load itself stays the true one.

    Tangential components come from the same sensor and get the same noise, each its own numbers.
    """
    spread = run.scene.environment.force_noise.to("N")
    run.reference_n += spread * run.of_recording("force").standard_normal(run.t_s.size)
    for name, (channel, true) in run.reference_more.items():
        if channel.kind == "force":
            own = spread * run.of_recording("force", name).standard_normal(run.t_s.size)
            run.reference_more[name] = (channel, true + own)


def low_pass(run: Synthesis) -> None:
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
