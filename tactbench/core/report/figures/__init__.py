"""The paper's figures, one a file, from the results in a folder."""

from tactbench.core.report.figures.drawing import draw_figures

__all__ = ["draw_figures"]
