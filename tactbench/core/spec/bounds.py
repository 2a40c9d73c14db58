"""Upper bounds of the numbers in the settings of a run; a larger number is a typing error, and would overflow."""

MOST_REPEATS = 1000
"""Largest number of replicates. Each is recorded anew; the 95 % interval of the mean of this many is already within 6 %
of their standard deviation."""
MOST_SECONDS = 366 * 86400.0
"""Largest time limit of a cell or a recording [s]: a year."""
MOST_MEMORY_MB = 2**30
"""Largest memory limit of a cell or a recording [MB of 2**20 bytes]: a pebibyte."""
