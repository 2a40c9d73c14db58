"""How figures look: a column wide, seven points, colours that the colour-blind and grey printers tell apart."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, cast

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN_IN = 3.5
"""Width of a column of a two-column paper; all sizes are meant at this width."""
PAGE_IN = 7.16
"""Width of both columns, for what does not fit in one."""
FONT_PT = 7.0
LEGEND_LETTERS = 42
"""Letters of three names that fit side by side below a column, their marks beside them."""

# Okabe and Ito 2008, Color universal design.
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILLION, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7",
)  # fmt: skip
GREY = "#767676"
LINES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Of things without an order."""
_NAMES = {BLUE: "blue", VERMILLION: "orange-red", GREEN: "green", PURPLE: "pink", ORANGE: "amber", SKY: "light blue",
          BLACK: "black"}  # fmt: skip
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">")
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))

_RC: dict[str, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same figure on every machine
    "font.size": FONT_PT,
    "axes.titlesize": FONT_PT,
    "axes.labelsize": FONT_PT,
    "xtick.labelsize": FONT_PT,
    "ytick.labelsize": FONT_PT,
    "legend.fontsize": FONT_PT,
    "figure.titlesize": FONT_PT,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlepad": 3.0,
    "axes.labelpad": 2.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.major.pad": 2.0,
    "ytick.major.pad": 2.0,
    "lines.linewidth": 1.0,
    "legend.frameon": False,
    "legend.handlelength": 2.0,
    "figure.constrained_layout.w_pad": 0.04,
    "figure.constrained_layout.h_pad": 0.06,
    "pdf.fonttype": 42,  # publishers refuse type 3; every further font of a PDF costs a tenth of a second: none is bold
    "savefig.facecolor": "white",
    "text.parse_math": False,  # a name with two dollar signs is a name
}


@contextmanager
def styled() -> Iterator[None]:
    """Draw in our style, whatever the user's matplotlibrc says."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(cast(Any, _RC))
        yield


def panels(
    rows: int, columns: int, height_in: float, *, width_in: float = COLUMN_IN, **more: Any
) -> tuple[Figure, Any]:
    """Return a figure and its (rows, columns) axes, each row `height_in` high."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, rows * height_in + 0.35), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **more)


def ordered(n: int) -> list[Any]:
    """Return `n` colours in an order that grey shows too; the ends, which vanish on paper, are left out."""
    import matplotlib

    map_ = matplotlib.colormaps["viridis"]
    return [map_(value) for value in np.linspace(0.0, 0.88, n)] if n > 1 else [map_(0.0)]


def sensor_colours(rows: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Return a colour for each sensor of a folder, the same in all its figures."""
    names = sorted({str(row["sensor"]) for row in rows})
    return {name: cycled(LINES, place) for place, name in enumerate(names)}


def colour_name(colour: str) -> str:
    """Return what a caption calls one of `LINES`."""
    return _NAMES[colour]


def legend(figure: Figure, shown: Iterable[Axes], **more: Any) -> None:
    """Put below a figure what its panels name, each name once."""
    entries: dict[str, Any] = {}
    for here in shown:
        handles, labels = here.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    wide = figure.get_figwidth() > COLUMN_IN
    ncols = 2 if sum(map(len, entries)) > LEGEND_LETTERS and not wide else 3
    figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=min(len(entries), ncols), **more)


def corner(axes: Axes, text: str, *, right: bool = False) -> None:
    """Write into the upper corner of a panel, on a ground that keeps it legible over points."""
    axes.text(
        0.97 if right else 0.03, 0.97, text, transform=axes.transAxes, va="top", ha="right" if right else "left",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}, zorder=10,
    )  # fmt: skip


def cycled(choices: Sequence[Any], place: int) -> Any:
    """Return the choice at `place`, beginning again where there are too few."""
    return choices[place % len(choices)]
