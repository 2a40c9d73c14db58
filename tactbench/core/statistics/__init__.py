"""Statistics of scores: replicates, intervals of differences, ranks. See docs/statistics.md."""
