"""Figures from the results in a folder: those of the paper, published scores, and what accuracy costs in time."""
