"""What the makers of eFlesh published, for the tasks that it may stand beside."""

from __future__ import annotations

from tactbench.plugin import Published


def published(score_n: float, sensor: str, title: str) -> Published:
    """Return one of their errors [N], with what must be known to compare with it."""
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
