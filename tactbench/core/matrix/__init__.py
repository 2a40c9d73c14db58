"""The matrix: which cells there are, where their results lie, and how they are run."""
