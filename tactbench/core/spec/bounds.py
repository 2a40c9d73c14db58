"""The most that a run is asked for: what lies above is a slip of the keyboard, and would overflow or never end."""

MOST_REPEATS = 1000
"""Replicates; each is recorded anew, and the interval of so many is already within 6 % of their spread."""
MOST_SECONDS = 366 * 86400.0
"""Of a time limit: a year."""
MOST_MEMORY_MB = 2**30
"""Of a memory limit: a pebibyte."""
