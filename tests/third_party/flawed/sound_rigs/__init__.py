"""A simulated rig that ramps a force, and one that moves a motor."""

from tactbench.plugin import RigDescriptor, hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_rigs():
    return [
        RigDescriptor(name="sound-rig", title="A ramp", where="sound_rigs.code:build", simulated=True),
        RigDescriptor(name="sound-press", title="A motor presses", where="sound_rigs.code:build_press"),
    ]
