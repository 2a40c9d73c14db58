"""A simulated rig that ramps a force."""

from tactbench.plugin import RigDescriptor, hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_rigs():
    return [RigDescriptor(name="sound-rig", title="A ramp", where="sound_rigs.code:build", simulated=True)]
