"""The leaderboard: a table object of ranked results, and its output formats."""
