"""What may be said of scores: intervals of differences, ranks, averages over tasks. See docs/statistics.md."""
