"""The leaderboard: one table object, and the ways to show it."""

AXES = ("protocol", "split", "fold")
"""What may stand side by side in a comparison; here, so that asking for help loads nothing else."""
