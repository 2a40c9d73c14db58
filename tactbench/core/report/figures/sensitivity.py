"""What decides the published numbers: the calibration's figure among those of a report."""

from __future__ import annotations

from pathlib import Path

from tactbench.core.report.calibrated import Calibrated
from tactbench.core.report.figures.saving import write
from tactbench.core.report.saved_figure import SavedFigure

_NAME = "calibration-sensitivity"


def draw_sensitivity(calibrated: Calibrated, folder: Path) -> list[SavedFigure]:
    """Save the figure as PDF and PNG; none if the calibration has none.

    Raises
    ------
    OSError
        If `folder` cannot be written.
    """
    if calibrated.sensitivity is None:
        return []
    png, pdf = write(calibrated.sensitivity(), _NAME, folder)
    caption = (
        "Partial rank correlation of each published number, as simulated, with each nuisance that the simulation "
        "cannot know; a panel a number. Bars: 95 %, bootstrap over draws; filled circles: the interval leaves "
        "out 0. SIM. "
    )
    return [
        SavedFigure(_NAME, "What decides the published numbers", caption + " ".join(calibrated.notes), png, pdf, ())
    ]
