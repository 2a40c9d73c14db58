"""Rigs: the simulated twin, replayed recordings."""
