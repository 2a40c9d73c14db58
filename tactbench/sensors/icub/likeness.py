"""What was measured on real iCub fingertips: the ranges that a model of it, or another hand, is held against.

IG is clear-nus/icub_grasp_dataset: five fingertips closing on objects, 203 reliable recordings, about 280 loaded
fingertips (thumb, index and middle finger). Ranges are 10th to 90th percentiles over fingertips where it gives a
spread.
"""

from __future__ import annotations

from tactbench.plugin import Source
from tactbench.plugin.simulation import RealFigure

IG = "clear-nus/icub_grasp_dataset"
_FINGERS = "the range is that of three fingers"
_PLACES = (
    "a finger of a closing hand meets most objects with the same place; how far its contacts scatter is not recorded, "
    "and the 2 mm about the middle of the pad are assumed"
)


def _figure(
    statistic: str, condition: str, typical: float, low: float, high: float, unit: str, source: str, cause: str = ""
) -> RealFigure:
    return RealFigure(
        statistic=statistic,
        condition=condition,
        typical=typical,
        low=low,
        high=high,
        unit=unit,
        source=Source(tag="measured", reference=source),
        cause=cause,
    )


LIKENESS: tuple[RealFigure, ...] = (
    _figure("rest-level", "rest", 243, 236, 246, "count", f"{IG}: taxels of all fingers"),
    _figure("rest-spread", "rest", 2, 1, 4, "count", f"{IG}: over the taxels of a finger; a factor of two either way"),
    _figure("white-noise", "rest", 0.48, 0.41, 0.50, "count", f"{IG}: with rounding; 0.41 with nothing moving at all"),
    _figure("noise-correlation", "rest", 0.0, -0.1, 0.1, "1", f"{IG}: none seen; a tenth either way"),
    _figure("offset-own", "rest", 0.20, 0.07, 0.48, "count", f"{IG}: between trials of a session, untouched taxels"),
    _figure("largest-drop", "grasp", 26, 12, 57, "count", f"{IG}: peak fall of a loaded fingertip"),
    _figure("deepest-drop", "grasp", 98, 49, 147, "count", f"{IG}: largest of all; half of it either way"),
    _figure("taxels-moved", "grasp", 3, 2, 6, "1", f"{IG}: of 12, by 5 counts or more"),
    _figure("participation", "grasp", 2.9, 1.8, 5.7, "1", f"{IG}: of 12, changes under 3 counts left out"),
    _figure(
        "share-rising", "grasp", 0.048, 0.0, 0.09, "1",
        f"{IG}: by 3 counts; thumb 0, index 0.014, middle finger 0.07, there mostly in its taxels 4 and 5",
    ),
    _figure("pca-first", "grasp", 0.68, 0.62, 0.82, "1", f"{IG}: {_FINGERS}", _PLACES),
    _figure("pca-second", "grasp", 0.16, 0.14, 0.20, "1", f"{IG}: {_FINGERS}", _PLACES),
    _figure("pca-third", "grasp", 0.09, 0.02, 0.11, "1", f"{IG}: {_FINGERS}", _PLACES),
)  # fmt: skip
