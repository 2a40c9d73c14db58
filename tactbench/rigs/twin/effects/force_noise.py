"""The reference force-torque sensor's own noise."""

from __future__ import annotations

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add white noise to the reference force, unfiltered as in the paper; the load itself stays the true one."""
    spread = run.scene.environment.force_noise.to("N")
    run.reference_n += spread * run.of_recording("force").standard_normal(run.t_s.size)
