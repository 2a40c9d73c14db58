"""The rig `bench`: real or emulated devices, pressed by hand."""

from __future__ import annotations

from tactbench.plugin import RigDescriptor, hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_rigs() -> list[RigDescriptor]:
    """Register the rig `bench` with the plugin manager."""
    return [
        RigDescriptor(
            name="bench", title="real devices, pressed by hand", where="tactbench.rigs.bench.rig:build",
            references={"force": (), "torque": ()},
        )
    ]  # fmt: skip
