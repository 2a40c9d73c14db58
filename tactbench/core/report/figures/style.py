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

BLACK, GREY = "#000000", "#767676"
LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", BLACK)
"""Of things without an order: Okabe and Ito 2008, Color universal design."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">")

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


def tiled(count: int, across: int, height_in: float, **more: Any) -> tuple[Figure, list[Axes]]:
    """Return a figure with `count` panels, at most `across` beside each other."""
    columns = min(count, across)
    figure, axes = panels(-(-count // columns), columns, height_in, **more)
    for here in axes.flat[count:]:
        here.set_visible(False)
    return figure, list(axes.flat[:count])


def ordered(n: int) -> list[Any]:
    """Return `n` colours in an order that grey shows too; the ends, which vanish on paper, are left out."""
    import matplotlib

    return [matplotlib.colormaps["viridis"](value) for value in np.linspace(0.0, 0.88, n)]


def sensor_colours(rows: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Return a colour for each sensor of a folder, the same in all its figures."""
    names = sorted({str(row["sensor"]) for row in rows})
    return {name: cycled(LINES, place) for place, name in enumerate(names)}


def legend(figure: Figure, shown: Iterable[Axes], **more: Any) -> None:
    """Put below a figure what its panels name, each name once."""
    entries: dict[str, Any] = {}
    for here in shown:
        handles, labels = here.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    ncols = 3 if figure.get_figwidth() > COLUMN_IN else 2
    figure.legend(entries.values(), entries.keys(), loc="outside lower center", **{"ncols": ncols, **more})


def corner(axes: Axes, text: str) -> None:
    """Write into the upper left corner of a panel, on a ground that keeps it legible over points."""
    ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    axes.text(0.03, 0.97, text, transform=axes.transAxes, va="top", bbox=ground, zorder=10)


def cycled(choices: Sequence[Any], place: int) -> Any:
    """Return the choice at `place`, beginning again where there are too few."""
    return choices[place % len(choices)]
