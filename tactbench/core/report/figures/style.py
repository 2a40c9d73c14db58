"""Style of all figures: one column wide, letters of 7 pt, colours that colour-blind readers can distinguish."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from tactbench.core.files import replace_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN_IN = 3.5
"""Width of a column of a two-column paper [inch]; font and line sizes are chosen for this width."""
PAGE_IN = 7.16
"""Width of both columns [inch], for figures that do not fit into one column."""
FONT_PT = 7.0
PNG_DPI, RASTER_DPI = 150, 300
"""Resolution of PNG files, and of rasterised point clouds inside PDF files [dots per inch]."""

BLACK, GREY = "#000000", "#767676"
LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", BLACK)
"""Colours for categories: Okabe and Ito 2008, Color universal design."""
MARKERS = "os^DvPX*<>"

_RC: dict[str, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same figure on every machine
    "font.size": FONT_PT,
    **dict.fromkeys(("axes.titlesize", "axes.labelsize", "xtick.labelsize", "ytick.labelsize"), FONT_PT),
    **dict.fromkeys(("legend.fontsize", "figure.titlesize"), FONT_PT),
    **dict.fromkeys(("axes.linewidth", "xtick.major.width", "ytick.major.width"), 0.6),
    **dict.fromkeys(("axes.spines.top", "axes.spines.right", "legend.frameon"), False),
    "figure.constrained_layout.h_pad": 0.06,
    "pdf.fonttype": 42,  # publishers refuse type 3
    "text.parse_math": False,  # a name with two dollar signs is a name
}


@contextmanager
def styled() -> Iterator[None]:
    """Return a context in which figures have this style, independent of the user's matplotlibrc."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(cast(Any, _RC))
        yield


def save(figure: Figure, place: Path) -> Path:
    """Write ``PLACE.png`` and ``PLACE.pdf`` and return the path of the PNG; equal figures give equal bytes."""
    # Without dates, and without the version of what drew it.
    apart = {"png": {"Software": None}, "pdf": {"CreationDate": None, "Creator": "tactbench", "Producer": None}}
    for ending, dpi in (("png", PNG_DPI), ("pdf", RASTER_DPI)):
        content = io.BytesIO()
        figure.savefig(content, format=ending, dpi=dpi, metadata=apart[ending])
        figure.set_layout_engine("none")  # the first drawing has put everything in its place
        replace_file(place.with_name(f"{place.name}.{ending}"), content.getvalue())
    return place.with_name(f"{place.name}.png")


def panels(
    rows: int, columns: int, height_in: float, *, width_in: float = COLUMN_IN, **more: Any
) -> tuple[Figure, Any]:
    """Return a figure and its (rows, columns) axes, each row `height_in` inches high."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, rows * height_in + 0.35), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **more)


def ordered(n: int) -> list[Any]:
    """Return `n` colours that are ordered in greyscale too, without the palest, which would vanish on paper."""
    import matplotlib

    return [matplotlib.colormaps["viridis"](value) for value in np.linspace(0.0, 0.88, n)]


def legend(figure: Figure, shown: Iterable[Axes], **more: Any) -> None:
    """Add a legend below a figure, with each label of its panels listed once."""
    entries: dict[str, Any] = {}
    for here in shown:
        handles, labels = here.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    ncols = 3 if figure.get_figwidth() > COLUMN_IN else 2
    figure.legend(entries.values(), entries.keys(), loc="outside lower center", **{"ncols": ncols, **more})


def corner(axes: Axes, text: str) -> None:
    """Write a text into the upper left corner of a panel, on a background that keeps it legible over points."""
    ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    axes.text(0.03, 0.97, text, transform=axes.transAxes, va="top", bbox=ground, zorder=10)
