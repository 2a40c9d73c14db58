"""What was measured on real BioTacs: the ranges that a model of it, or another unit, is held against.

Ranges are the 10th to 90th percentile over electrodes or cases where the source gives a spread. RF is
Alexis-Georganopoulos/Robotic-Finger (one BioTac, a flat plate pressed and tilted by hand, 8704 loaded rows; no force
was measured, so loads are ordered by the fluid's pressure), RG is RuihanGao/BioTacSP_setup (three BioTac SP at rest),
DX is dexrob/BioTac_slide_20_50 (one BioTac sliding).
"""

from __future__ import annotations

from tactbench.plugin import Source
from tactbench.plugin.simulation import RealFigure

RF = "Alexis-Georganopoulos/Robotic-Finger"
RG = "RuihanGao/BioTacSP_setup"
DX = "dexrob/BioTac_slide_20_50"
_ONE_VALUE = "one value, the range is a quarter either way"
_BETWEEN = "one value, the range is that of the neighbouring bands"
_PLATE = f"{RF}: plate tilted by 29 deg [10, 51], mostly towards the tip"

_SOFT = (
    "how the real skin is held and stretched is in no source: its modulus is assumed, and the clamp at seam and seal "
    "is set by one figure, the largest rise under a plate, for all electrodes and plates"
)
_NARROW = (
    "in the model electrodes turn from falling to rising 27 deg from the contact, in reality 35-40 deg, so that fewer "
    "fall under a plate"
)
_DRIFT = (
    "not known: of the real rise the slope of the warm-up makes 0.11 counts at 1 s, in the model, over twelve minutes, "
    "0.07; free drift about a straight line was at most 0.085 counts over 38 s, so that it cannot make the rest"
)
_HAND = (
    "15 orientations of one plate without history or slip; presumably a hand varies more, and the remainders of "
    "earlier presses make components of their own"
)
_HUM = (
    "the hum is one band with first-order skirts; slow wander of the electronics below it is not in the spec, and its "
    "skirt above is too wide"
)
_RIDGES = (
    "the mean over a smooth patch hears little of what is finer than the contact, where real skin has ridges and "
    "touches at asperities; above 100 Hz the moving arm itself vibrates, which no scene has"
)
_FLANKS = (
    "the flank electrodes lie under .2-.3 mm of film in the meshes, which are good to .03 mm, and rest lowest; that "
    "the meshes equal a filled sensor is assumed"
)
_ASPERITIES = (
    "the film over electrode 1 is a quarter of a millimetre: a point meets the core at once and raises the fluid's "
    "pressure by 16 counts at most"
)


def _figure(
    statistic: str,
    condition: str,
    typical: float,
    low: float,
    high: float,
    unit: str = "count",
    *,
    source: str,
    cause: str = "",
    band: tuple[float, float] | None = None,
    at: float | None = None,
    frequency: tuple[float, float] | None = None,
    channels: tuple[str, ...] = (),
) -> RealFigure:
    return RealFigure(
        statistic=statistic,
        condition=condition,
        band=band,
        at=at,
        frequency=frequency,
        channels=channels,
        low=low,
        high=high,
        typical=typical,
        unit=unit,
        source=Source(tag="measured", reference=source),
        cause=cause,
    )


_REST = (
    _figure("rest-level", "rest", 3237, 2990, 3461, source=f"{RF}: 19 electrodes"),
    _figure(
        "rest-lowest",
        "rest",
        2990,
        2743,
        3237,
        source=f"{RF}: the range is its distance from the median",
        cause=_FLANKS,
    ),
    _figure("rest-spread", "rest", 157, 118, 196, source=f"{RF}: sd over electrodes; {_ONE_VALUE}", cause=_FLANKS),
    _figure("white-noise", "rest", 0.44, 0.42, 0.48, source=f"{RF}: with rounding, 13 stretches"),
    _figure("noise-correlation", "rest", 0.0, -0.07, 0.09, "1", source=f"{RF}: pairs of electrodes"),
    _figure("offset-shared", "rest", 1, 0.5, 3, source=f"{RF}: beyond the warm-up, 15 s or more after a contact"),
    _figure("offset-own", "rest", 2, 1, 3, source=f"{RF}: beyond the warm-up, two brief presses within 6 minutes"),
    _figure("pressure-rest", "rest", 2500, 2404, 2593, source=f"{RF}: 2404-2460; {RG}: 2583-2593"),
    _figure("pressure-noise", "rest", 0.33, 0.11, 0.44, source=f"{RF}: 0.33 with rounding; {RG}: 0.11 and 0.44"),
    _figure("vibration-rms", "rest", 4.8, 4.5, 5.1, source=f"{RG}: PAC on the bench"),
    *(
        _figure(
            "vibration-rms",
            "rest",
            typical,
            low,
            high,
            frequency=band,
            cause=_HUM,
            source=f"{RG}: PAC on the bench, three units",
        )
        for band, low, typical, high in (
            ((2, 10), 0.4, 0.6, 0.8),
            ((10, 30), 0.94, 0.97, 0.99),
            ((30, 100), 2.1, 2.8, 3.5),
            ((100, 200), 1.8, 2.0, 2.2),
            ((200, 500), 2.4, 2.45, 2.5),
            ((500, 1000), 1.8, 1.85, 1.9),
        )
    ),
    _figure("vibration-rms", "slide", 158, 96, 242, source=f"{DX}: PAC, 7209 windows", cause=_RIDGES),
    *(
        _figure(
            "vibration-rms",
            "slide",
            typical,
            0.75 * typical,
            1.25 * typical,
            frequency=band,
            cause=_RIDGES,
            source=f"{DX}: PAC, 7209 windows; {_ONE_VALUE}",
        )
        for band, typical in (
            ((2, 10), 77.0),
            ((10, 30), 78.0),
            ((30, 100), 26.0),
            ((100, 200), 7.0),
            ((200, 500), 7.1),
            ((500, 1000), 4.6),
        )
    ),
)
_LONG = (
    _figure("allan-deviation", "long-rest", 0.16, 0.12, 0.20, at=0.1, source=f"{RF}: {_ONE_VALUE}"),
    _figure("allan-deviation", "long-rest", 0.12, 0.09, 0.15, at=0.5, source=f"{RF}: {_ONE_VALUE}", cause=_DRIFT),
    _figure("allan-deviation", "long-rest", 0.19, 0.14, 0.24, at=1.0, source=f"{RF}: {_ONE_VALUE}", cause=_DRIFT),
    _figure("warm-up", "long-rest", 90, 67, 110, source=f"{RF}: still to come at the first log, by two fits"),
    _figure("warm-up-tau", "long-rest", 500, 450, 620, "s", source=f"{RF}: by three ways of fitting"),
    _figure("warm-up-share", "long-rest", 0.94, 0.90, 1.0, "1", source=f"{RF}: 0.94 with presses in between"),
    _figure("warm-up-scatter", "long-rest", 0.15, 0.10, 0.20, "1", source=f"{RF}: factors of the electrodes"),
)

_Row = tuple[float, float, float]
_ROWS: dict[tuple[float, float], tuple[_Row, _Row, _Row, _Row, _Row, float]] = {
    (30, 100): ((21, 4, 56), (100, 6, 191), (58, 34, 79), (0.76, 0.73, 0.79), (0.16, 0.08, 0.24), 10.8),
    (100, 200): ((37, 10, 93), (208, 33, 422), (87, 70, 110), (0.73, 0.67, 0.76), (0.24, 0.16, 0.32), 9.9),
    (200, 350): ((61, 16, 146), (300, 104, 450), (121, 100, 152), (0.67, 0.63, 0.73), (0.32, 0.24, 0.36), 11.1),
    (350, 500): ((80, 18, 177), (250, 160, 430), (147, 128, 170), (0.63, 0.56, 0.67), (0.36, 0.32, 0.41), 12.9),
    (500, 656): ((81, 12, 199), (412, 213, 689), (186, 159, 213), (0.56, 0.49, 0.63), (0.41, 0.36, 0.46), 10.1),
}
"""By the fluid's pressure above rest: abs change, largest drop, largest rise, shares rising and falling, participation.
Each with its range; at either end of the shares' range, where a neighbour is missing, the other one's distance."""


def _band(band: tuple[float, float]) -> tuple[RealFigure, ...]:
    """Return what was measured while the fluid's pressure was in one band above rest."""
    change, drop, rise, up, down, taking_part = _ROWS[band]
    shares = f"{_PLATE}; by 3 counts; {_BETWEEN}"
    over_all = f"{_PLATE}; range over all loads"
    return (
        _figure("abs-change", "plate", *change, band=band, source=_PLATE),
        _figure("largest-drop", "plate", *drop, band=band, source=_PLATE, cause=_SOFT),
        _figure("largest-rise", "plate", *rise, band=band, source=_PLATE, cause=_SOFT),
        _figure("share-rising", "plate", *up, "1", band=band, source=shares, cause=_NARROW),
        _figure("share-falling", "plate", *down, "1", band=band, source=shares, cause=_NARROW),
        _figure("participation", "plate", taking_part, 8.8, 13.9, "1", band=band, source=over_all, cause=_NARROW),
    )


_MIDDLE, _ALL, _LEVELS = (200.0, 350.0), (30.0, 656.0), (250.0, 400.0)
_PLATES = (
    *(figure for band in _ROWS for figure in _band(band)),
    _figure("rise-per-pressure", "plate", 0.45, 0.37, 0.56, "1", band=_MIDDLE, source=_PLATE, cause=_SOFT),
    _figure("drop-per-pressure", "plate", 1.15, 0.37, 1.61, "1", band=_MIDDLE, source=_PLATE, cause=_SOFT),
    _figure(
        "fall-angle", "plate", 17, 6, 29, "deg", band=_MIDDLE,
        source=f"{_PLATE}: between the contact's direction and the electrode that falls most",
    ),
    _figure(
        "crossing-angle", "plate", 37.5, 28, 47, "deg", band=_ALL,
        source=f"{_PLATE}: nearer to the contact electrodes fall on average; 35-40 deg, {_ONE_VALUE}", cause=_NARROW,
    ),
    _figure(
        "share-falling", "plate", 0.0, 0.0, 0.02, "1", band=_ALL, channels=("E4", "E6", "E14", "E16"),
        source=f"{_PLATE}: the side electrodes practically never fall",
    ),
    _figure("pca-first", "plate", 0.30, 0.225, 0.375, "1", band=_ALL, source=f"{_PLATE}; {_ONE_VALUE}", cause=_HAND),
    _figure(
        "pca-first-five", "plate", 0.89, 0.85, 0.93, "1", band=_ALL,
        source=f"{_PLATE}; one value, the range is 0.04 either way", cause=_HAND,
    ),
)  # fmt: skip
_LEVEL = f"{RF}: plate within 13 deg of the pad's normal; "
_TWICE = "the range is twice either way"
_PATTERNS = (
    _figure(
        "change", "level-plate", -40, -102, -14, band=_LEVELS, channels=("E17", "E18", "E19"),
        source=f"{_LEVEL}they fall by 28 to 51; {_TWICE}", cause=_SOFT,
    ),
    _figure(
        "change-per-pressure", "level-plate", 0.31, 0.135, 0.70, "1", band=_LEVELS, channels=("E6", "E16"),
        source=f"{_LEVEL}.27 and .35; {_TWICE}", cause=_SOFT,
    ),
    _figure(
        "change-per-pressure", "level-plate", 0.05, 0.005, 0.18, "1", band=_LEVELS,
        channels=("E2", "E3", "E12", "E13"), source=f"{_LEVEL}.01 to .09; {_TWICE}", cause=_SOFT,
    ),
)  # fmt: skip
_OTHER = (
    _figure(
        "deepest-drop", "pointed", 1782, 1336, 2228, band=(40, 110), source=f"{RF}, electrode 1; {_ONE_VALUE}",
        cause=_ASPERITIES,
    ),
    _figure(
        "second-drop", "pointed", 140, 70, 210, band=(40, 110), source=f"{RF}: the next one; half either way",
        cause=_ASPERITIES,
    ),
    _figure(
        "residual-after-contact", "release", 0.115, 0.08, 0.15, "1",
        source=f"{RF}: 0.11-0.12 of the median contact response in 20 pauses; a third either way",
        cause=_SOFT,
    ),
)  # fmt: skip

LIKENESS: tuple[RealFigure, ...] = (*_REST, *_LONG, *_PLATES, *_PATTERNS, *_OTHER)
