"""The matrix floor."""
