"""The reference force-torque sensor's own noise."""

from __future__ import annotations

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add white noise to the reference force, unfiltered as in the paper; the load itself stays the true one.

    Tangential components come from the same sensor and get the same noise, each its own numbers.
    """
    spread = run.scene.environment.force_noise.to("N")
    run.reference_n += spread * run.of_recording("force").standard_normal(run.t_s.size)
    for name, (channel, true) in run.reference_more.items():
        if channel.kind == "force":
            noise = spread * run.of_recording("force", name).standard_normal(run.t_s.size)
            run.reference_more[name] = (channel, true + noise)
