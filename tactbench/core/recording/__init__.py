"""The recording floor."""
