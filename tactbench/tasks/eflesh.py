"""Published scores of the sensor eFlesh, for tasks that compare their results with them."""

from __future__ import annotations

from tactbench.plugin import Published


def published(score_n: float, sensor: str, title: str) -> Published:
    """Return a published error [N] of eFlesh, with remarks on the conditions of its measurement."""
    return Published(
        score=score_n,
        protocol="deployable",
        sensor=sensor,
        split="in-session",
        title=title,
        reference="Pattabiraman et al. 2025, arXiv 2506.09994",
        remark="a small network; the last fifth of one session's rows, as in the authors' published training code, "
        "which gives rows without a load-cell sample the nearest one and scales by all rows, tested ones too; "
        "which session the figure is of is not stated",
    )
