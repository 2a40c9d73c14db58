"""Upper bounds of the numbers of a run; a larger number is a typing error, and would overflow or never end."""

MOST_REPEATS = 1000
"""Largest number of replicates: each is recorded anew, and the interval of so many is already within 6 % of their
spread."""
MOST_SECONDS = 366 * 86400.0
"""Largest time limit [s]: a year."""
MOST_MEMORY_MB = 2**30
"""Largest memory limit [MB]: a pebibyte."""
