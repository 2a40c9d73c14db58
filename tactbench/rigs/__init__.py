"""Rigs: the simulated twin, replayed recordings, devices of a parallel manipulator."""
