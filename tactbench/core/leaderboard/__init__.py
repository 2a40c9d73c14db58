"""The leaderboard floor."""
