"""The rig with a parallel manipulator, a linear motor and a force-torque sensor: its parts, no rig yet.

Codecs and emulators of the motor and of the force-torque sensor; and, without input or output, the kinematics of linear
and rotary deltas, permitted places and moves, trajectories, the force law and its stability.

Nothing here has met a real device: each codec is tested against public descriptions and against the emulator beside it.
"""
