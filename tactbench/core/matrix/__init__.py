"""The matrix: planning of cells, running them, and storage of their results."""
