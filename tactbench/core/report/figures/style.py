"""Style of all figures, independent of the user's matplotlibrc, and their files."""

from __future__ import annotations

import io
from collections.abc import Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.files import replace_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = "os^DvPX*<>"
"""Markers of categories; their colours ``C0`` … are Okabe and Ito's."""


def styled() -> AbstractContextManager[None]:
    """Return a context in which figures have the style of the file ``paper.mplstyle``."""
    import matplotlib.style

    return matplotlib.style.context(Path(__file__).with_name("paper.mplstyle"), after_reset=True)


def save(figure: Figure, place: Path) -> Path:
    """Write ``PLACE.png`` and ``PLACE.pdf`` and return the path of the PNG; equal figures give equal bytes."""
    # Without dates, and without the version of what drew it.
    apart = {"png": {"Software": None}, "pdf": {"CreationDate": None, "Creator": "tactbench", "Producer": None}}
    for ending, metadata in apart.items():
        content = io.BytesIO()
        figure.savefig(content, format=ending, metadata=metadata)
        figure.set_layout_engine("none")  # the first drawing has put everything in its place
        replace_file(place.with_name(f"{place.name}.{ending}"), content.getvalue())
    return place.with_name(f"{place.name}.png")


def panels(rows: int, columns: int, *, wide: bool = False, **more: Any) -> tuple[Figure, Any]:
    """Return a figure and its (rows, columns) axes, square, over one column of a page or over both if `wide`."""
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained")
    width = figure.get_figwidth() * (2 if wide else 1)
    figure.set_size_inches(width, width * rows / columns)
    return figure, figure.subplots(rows, columns, squeeze=False, **more)


def legend(figure: Figure, shown: Iterable[Axes], **more: Any) -> None:
    """Add a legend below a figure, with each label of its panels listed once."""
    entries: dict[str, Any] = {}
    for here in shown:
        handles, labels = here.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=6, **more)
