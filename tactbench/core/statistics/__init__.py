"""Statistics of scores: medians over replicates, intervals of differences and ranks; see docs/statistics.md."""
