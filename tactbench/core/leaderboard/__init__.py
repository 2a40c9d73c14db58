"""The leaderboard: one table object, and the ways to show it."""
