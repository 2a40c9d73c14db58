"""What was measured on real BioTacs: the ranges that a model of it, or another unit, is held against.

Ranges are the 10th to 90th percentile over electrodes or cases where the source gives a spread. RF is
Alexis-Georganopoulos/Robotic-Finger (one BioTac, a flat plate pressed and tilted by hand, 8704 loaded rows; no force
was measured, so loads are ordered by the fluid's pressure), RG is RuihanGao/BioTacSP_setup (three BioTac SP at rest),
DX is dexrob/BioTac_slide_20_50 (one BioTac sliding).
"""

from __future__ import annotations

from tactbench.plugin import RealFigure, Source

RF = "Alexis-Georganopoulos/Robotic-Finger"
RG = "RuihanGao/BioTacSP_setup"
DX = "dexrob/BioTac_slide_20_50"
_ONE_VALUE = "one value; the range is a quarter either way"
_BETWEEN = "one value; the range is that of the neighbouring bands"
_SIDES = ("E4", "E6", "E14", "E16")

_POINTED_TIP = "the dome's arc is shortened on the sheet by a factor of two, so that plates on it are too pointed a contact"
_SHIELDED = (
    "the film has one thickness from seam to seam apart from its sides, so that what the contact displaces lifts all of "
    "it; a real skin is stiffer towards its seam and nail"
)
_FEW_MODES = (
    "plates of 15 orientations without rolling, sliding or contact history; the mechanics of the model varies less from "
    "contact to contact than a hand does"
)
_PLATE_SOURCE = f"{RF}: plate tilted by 29 deg [10, 51], mostly towards the tip"


def _figure(
    statistic: str,
    condition: str,
    typical: float,
    low: float,
    high: float,
    *,
    unit: str = "count",
    source: str,
    cause: str = "",
    **more: object,
) -> RealFigure:
    return RealFigure.model_validate(
        {
            "statistic": statistic, "condition": condition, "typical": typical, "low": low, "high": high,
            "unit": unit, "source": Source(tag="measured", reference=source), "cause": cause, **more,
        }
    )  # fmt: skip


_REST = (
    _figure("rest-level", "rest", 3237, 2990, 3461, source=f"{RF}: 19 electrodes"),
    _figure("rest-lowest", "rest", 2990, 2743, 3237, source=f"{RF}: 2990; the range is half of the median's distance"),
    _figure(
        "rest-spread", "rest", 157, 118, 196, source=f"{RF}: sd over electrodes; {_ONE_VALUE}",
        cause="the electrodes of the tip rest lowest: the film on the dome is laid out longer to reach than it is",
    ),
    _figure("white-noise", "rest", 0.44, 0.42, 0.48, source=f"{RF}: with rounding, 13 stretches"),
    _figure("noise-correlation", "rest", 0.0, -0.07, 0.09, unit="1", source=f"{RF}: pairs of electrodes"),
    _figure("offset-shared", "rest", 15, 10, 20, source=f"{RF}: between recordings 1-6 minutes apart"),
    _figure("offset-own", "rest", 5, 2, 10, source=f"{RF}: between recordings 1-6 minutes apart"),
    _figure("pressure-rest", "rest", 2500, 2404, 2593, source=f"{RF}: 2404-2460; {RG}: 2583-2593"),
    _figure("pressure-noise", "rest", 0.33, 0.11, 0.44, source=f"{RF}: 0.33 with rounding; {RG}: 0.11 and 0.44"),
    _figure("temperature-noise", "rest", 0.4, 0.36, 0.45, source=f"{RG}: 0.36-0.41; {DX}: 0.45"),
    _figure("vibration-noise", "rest", 4.8, 4.5, 5.1, source=f"{RG}: total rms of PAC on the bench"),
    _figure("vibration-noise", "slide", 158, 96, 242, source=f"{DX}: 7209 windows"),
)  # fmt: skip
_LONG = (
    _figure(
        "allan-deviation", "long-rest", 0.16, 0.12, 0.20, at=0.1, source=f"{RF}: {_ONE_VALUE}",
    ),
    _figure("allan-deviation", "long-rest", 0.12, 0.09, 0.15, at=0.5, source=f"{RF}, the minimum: {_ONE_VALUE}"),
    _figure(
        "allan-deviation", "long-rest", 0.19, 0.14, 0.24, at=1.0, source=f"{RF}: {_ONE_VALUE}",
        cause="real stretches lie between presses, whose slow recovery adds to the ramp; the model's rest has none",
    ),
    _figure("warm-up", "long-rest", 90, 67, 110, source=f"{RF}: still to come at the first log, by two fits"),
    _figure("warm-up-tau", "long-rest", 500, 450, 620, unit="s", source=f"{RF}: by three ways of fitting"),
    _figure("warm-up-share", "long-rest", 0.94, 0.90, 1.0, unit="1", source=f"{RF}: 0.94 with presses in between"),
    _figure("warm-up-scatter", "long-rest", 0.15, 0.10, 0.20, unit="1", source=f"{RF}: factors of the electrodes"),
)  # fmt: skip


def _band(
    low: float, high: float, *figures: tuple[str, float, float, float, str], shares: tuple[float, ...]
) -> tuple[RealFigure, ...]:
    """Return what was measured while the fluid's pressure was in one band above rest."""
    band, source = (low, high), _PLATE_SOURCE
    rising, rising_low, rising_high, falling, falling_low, falling_high = shares
    of_shares = {"unit": "1", "band": band, "source": f"{source}; by 3 counts; {_BETWEEN}", "cause": _SHIELDED}
    return (
        *(
            _figure(name, "plate", typical, least, most, band=band, source=source, cause=cause)
            for name, typical, least, most, cause in figures
        ),
        RealFigure.model_validate(
            _figure("share-rising", "plate", rising, rising_low, rising_high, **of_shares)  # type: ignore[arg-type]
        ),
        RealFigure.model_validate(
            _figure("share-falling", "plate", falling, falling_low, falling_high, **of_shares)  # type: ignore[arg-type]
        ),
    )


_PLATE = (
    *_band(
        30, 100,
        ("abs-change", 21, 4, 56, ""), ("largest-drop", 100, 6, 191, ""), ("largest-rise", 58, 34, 79, _SHIELDED),
        shares=(0.76, 0.73, 0.79, 0.16, 0.08, 0.24),
    ),
    *_band(
        100, 200,
        ("abs-change", 37, 10, 93, ""), ("largest-drop", 208, 33, 422, ""), ("largest-rise", 87, 70, 110, ""),
        shares=(0.73, 0.67, 0.76, 0.24, 0.16, 0.32),
    ),
    *_band(
        200, 350,
        ("abs-change", 61, 16, 146, ""), ("largest-drop", 300, 104, 450, ""), ("largest-rise", 121, 100, 152, ""),
        shares=(0.67, 0.63, 0.73, 0.32, 0.24, 0.36),
    ),
    *_band(
        350, 500,
        ("abs-change", 80, 18, 177, ""), ("largest-drop", 250, 160, 430, _POINTED_TIP),
        ("largest-rise", 147, 128, 170, ""),
        shares=(0.63, 0.56, 0.67, 0.36, 0.32, 0.41),
    ),
    _figure(
        "participation", "plate", 11.1, 8.8, 13.9, unit="1", band=(200, 350),
        source=f"{_PLATE_SOURCE}; range over all loads",
    ),
    _figure("rise-per-pressure", "plate", 0.45, 0.37, 0.56, unit="1", band=(200, 350), source=_PLATE_SOURCE),
    _figure(
        "drop-per-pressure", "plate", 1.15, 0.37, 1.61, unit="1", band=(200, 350), source=_PLATE_SOURCE,
        cause=_POINTED_TIP,
    ),
    _figure(
        "fall-angle", "plate", 17, 6, 29, unit="deg", band=(200, 350),
        source=f"{_PLATE_SOURCE}: how far the electrode that falls most lies from the contact's direction",
        cause=_POINTED_TIP,
    ),
    _figure(
        "crossing-angle", "plate", 37.5, 28, 47, unit="deg", band=(30, 656),
        source=f"{_PLATE_SOURCE}: electrodes nearer to the contact fall on average; 35-40 deg, {_ONE_VALUE}",
        cause=_SHIELDED,
    ),
    _figure(
        "share-falling", "plate", 0.0, 0.0, 0.02, unit="1", band=(30, 656), channels=_SIDES,
        source=f"{_PLATE_SOURCE}: the side electrodes practically never fall",
    ),
    _figure(
        "pca-first", "plate", 0.30, 0.225, 0.375, unit="1", band=(30, 656), source=f"{_PLATE_SOURCE}; {_ONE_VALUE}",
        cause=_FEW_MODES,
    ),
    _figure(
        "pca-first-five", "plate", 0.89, 0.85, 0.93, unit="1", band=(30, 656),
        source=f"{_PLATE_SOURCE}; one value, the range is 0.04 either way", cause=_FEW_MODES,
    ),
)  # fmt: skip
_OTHER = (
    _figure(
        "deepest-drop", "pointed", 1782, 1336, 2228, band=(0, 110), source=f"{RF}, electrode 1; {_ONE_VALUE}",
        cause="with its nearest excitation 6 mm away the model shares the current among more paths than one contact cuts",
    ),
    _figure(
        "second-drop", "pointed", 140, 0, 280, band=(0, 110), source=f"{RF}, electrode 1; at most twice the one value",
    ),
    _figure(
        "residual-after-contact", "release", 0.115, 0.08, 0.15, unit="1",
        source=f"{RF}: 0.11-0.12 of the median contact response in 20 pauses; {_ONE_VALUE}",
        cause="the terms of creep act on the force, and light loads move electrodes more per newton than heavy ones",
    ),
)  # fmt: skip

LIKENESS: tuple[RealFigure, ...] = (*_REST, *_LONG, *_PLATE, *_OTHER)
