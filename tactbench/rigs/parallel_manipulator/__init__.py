"""Devices of the rig with a linear motor and a force-torque sensor: codecs and emulators, no rig yet.

Nothing here has met a real device: each codec is tested against public descriptions and against the emulator beside it.
"""
