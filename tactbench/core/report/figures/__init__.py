"""Figures of the results in a folder: figures as in the paper, published scores, and accuracy against time."""
