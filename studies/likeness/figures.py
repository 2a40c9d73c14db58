"""Figures of real fingers, and how each is computed from states.

Ranges are the 10th to 90th percentile over electrodes, cases or fingers where the source gives a spread. RF is
Alexis-Georganopoulos/Robotic-Finger (one BioTac, a flat plate pressed and tilted by hand; no force was measured, so
that loads are ordered by the fluid's pressure), RG RuihanGao/BioTacSP_setup (three BioTac SP at rest), DX
dexrob/BioTac_slide_20_50 (one BioTac sliding), IG clear-nus/icub_grasp_dataset (iCub fingertips closing on objects).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

MOVED = 3.0
"""Counts from which a channel is said to rise or to fall: seven times the noise, rounding included."""
BINS_DEG = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 75.0, 90.0, 180.0)


@dataclass(frozen=True)
class States:
    """What figures are computed from: readings of one condition, in counts. What is missing is empty."""

    channels: tuple[str, ...]
    rest: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    """(recordings, channels) levels with nothing touching."""
    change: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    """(states, channels) under load less rest."""
    pressure: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """(states,) the fluid's pressure above rest."""
    angle_deg: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    """(states, channels) between each channel's normal and the contact's direction."""
    vibration: tuple[np.ndarray, ...] = ()
    """(n,) the fluid's vibration, one a recording."""
    vibration_hz: float = 0.0

    def of(self, figure: Figure) -> States:
        """Return the states within the figure's band of pressure, and its channels."""
        inside = np.ones(len(self.change), dtype=bool)
        if figure.band is not None:
            inside = (self.pressure >= figure.band[0]) & (self.pressure < figure.band[1])
        columns = [self.channels.index(name) for name in figure.channels or self.channels]
        change, angle = (rows[inside][:, columns] if rows.size else rows for rows in (self.change, self.angle_deg))
        pressure = self.pressure[inside] if self.pressure.size else self.pressure
        return replace(self, change=change, pressure=pressure, angle_deg=angle)


@dataclass(frozen=True)
class Figure:
    """One statistic of real recordings, with the range in which real fingers lie."""

    condition: str
    statistic: str
    typical: float
    low: float
    high: float
    source: str
    band: tuple[float, float] | None = None
    """Only states whose fluid pressure lies in this range above rest [counts]."""
    channels: tuple[str, ...] = ()
    frequency: tuple[float, float] | None = None
    """Only what vibrates between these [Hz]."""
    sets: str = ""
    """Parameter of the simulation that was set by this figure."""

    @property
    def name(self) -> str:
        """The statistic and what it is restricted to."""
        band = "" if self.band is None else f", {self.band[0]:g}–{self.band[1]:g} counts"
        hertz = "" if self.frequency is None else f", {self.frequency[0]:g}–{self.frequency[1]:g} Hz"
        return f"{self.statistic}{' of ' + ' '.join(self.channels) if self.channels else ''}{band}{hertz}"


def component_shares(change: np.ndarray) -> np.ndarray:
    """Return the shares of variance of the principal components of (n, channels), descending."""
    singular = np.linalg.svd(change - change.mean(axis=0), compute_uv=False)
    return singular**2 / np.sum(singular**2)


def participation(change: np.ndarray) -> np.ndarray:
    """Return (n,) how many channels take part, ``(sum |c|)² / sum c²``, smaller changes than `MOVED` left out."""
    size = np.where(np.abs(change) >= MOVED, np.abs(change), 0.0)
    squares = np.sum(size**2, axis=1)
    return np.sum(size, axis=1) ** 2 / np.where(squares > 0, squares, np.nan)


def crossing(angle_deg: np.ndarray, change: np.ndarray) -> float:
    """Return the angle at which the mean change, in bins of angle, first turns from falling to rising."""
    middles, means = [], []
    for low, high in itertools.pairwise(BINS_DEG):
        inside = (angle_deg >= low) & (angle_deg < high)
        if inside.any():
            middles.append((low + high) / 2)
            means.append(float(change[inside].mean()))
    for (at, below), (to, above) in itertools.pairwise(zip(middles, means, strict=True)):
        if below < 0 <= above:
            return at - below * (to - at) / (above - below)
    return float("nan")


def band_rms(rows: np.ndarray, rate_hz: float, frequency: tuple[float, float] | None) -> float:
    """Return the root mean square of what vibrates within a band (Parseval); None: of all."""
    power = np.abs(np.fft.rfft(rows - rows.mean())) ** 2
    at = np.fft.rfftfreq(rows.size, 1.0 / rate_hz)
    low, high = frequency or (0.0, np.inf)
    return float(np.sqrt(2.0 * power[(at >= low) & (at < high)].sum()) / rows.size)


def _largest(states: States, sign: float) -> np.ndarray:
    return (sign * states.change).max(axis=1)


STATISTICS: dict[str, Callable[[States, Figure], float]] = {
    "rest-level": lambda s, f: np.median(s.rest),
    "rest-lowest": lambda s, f: np.median(s.rest, axis=0).min(),
    "rest-spread": lambda s, f: np.median(s.rest.std(axis=1)),
    "abs-change": lambda s, f: np.median(np.abs(s.change)),
    "change": lambda s, f: np.median(s.change),
    "change per count of pressure": lambda s, f: np.median(s.change / s.pressure[:, None]),
    "largest drop": lambda s, f: np.median(_largest(s, -1.0)),
    "largest rise": lambda s, f: np.median(_largest(s, 1.0)),
    "deepest drop": lambda s, f: _largest(s, -1.0).max(),
    "largest rise per count of pressure": lambda s, f: np.median(_largest(s, 1.0) / s.pressure),
    "largest drop per count of pressure": lambda s, f: np.median(_largest(s, -1.0) / s.pressure),
    "share rising": lambda s, f: np.mean(s.change >= MOVED),
    "share falling": lambda s, f: np.mean(s.change <= -MOVED),
    "taxels moved": lambda s, f: np.median(np.sum(np.abs(s.change) >= 5.0, axis=1)),
    "participation": lambda s, f: np.nanmedian(participation(s.change)),
    "angle of the deepest fall": lambda s, f: np.median(s.angle_deg[np.arange(len(s.change)), s.change.argmin(axis=1)]),
    "angle of crossing": lambda s, f: crossing(s.angle_deg, s.change / s.pressure[:, None]),
    "first component": lambda s, f: component_shares(s.change)[0],
    "second component": lambda s, f: component_shares(s.change)[1],
    "first five components": lambda s, f: component_shares(s.change)[:5].sum(),
    "vibration": lambda s, f: np.median([band_rms(rows, s.vibration_hz, f.frequency) for rows in s.vibration]),
}

_MIDDLE, _ALL, _LEVEL = (200.0, 350.0), (30.0, 656.0), (250.0, 400.0)
_BANDS = ((30.0, 100.0), (100.0, 200.0), _MIDDLE, (350.0, 500.0), (500.0, 656.0))
_PER_BAND: dict[str, tuple[tuple[float, float, float], ...]] = {
    "abs-change": ((21, 4, 56), (37, 10, 93), (61, 16, 146), (80, 18, 177), (81, 12, 199)),
    "largest drop": ((100, 6, 191), (208, 33, 422), (300, 104, 450), (250, 160, 430), (412, 213, 689)),
    "largest rise": ((58, 34, 79), (87, 70, 110), (121, 100, 152), (147, 128, 170), (186, 159, 213)),
    "share rising": (
        (0.76, 0.73, 0.79),
        (0.73, 0.67, 0.76),
        (0.67, 0.63, 0.73),
        (0.63, 0.56, 0.67),
        (0.56, 0.49, 0.63),
    ),
    "share falling": (
        (0.16, 0.08, 0.24),
        (0.24, 0.16, 0.32),
        (0.32, 0.24, 0.36),
        (0.36, 0.32, 0.41),
        (0.41, 0.36, 0.46),
    ),
    "participation": tuple((typical, 8.8, 13.9) for typical in (10.8, 9.9, 11.1, 12.9, 10.1)),
}
_HERTZ = ((2, 10), (10, 30), (30, 100), (100, 200), (200, 500), (500, 1000))

BIOTAC = (
    Figure("rest", "rest-level", 3237, 2990, 3461, "RF", sets="conductivity"),
    Figure("rest", "rest-lowest", 2990, 2743, 3237, "RF"),
    Figure("rest", "rest-spread", 157, 118, 196, "RF; a quarter either way"),
    *(
        Figure("plate", statistic, *numbers, "RF", band=band)
        for statistic, row in _PER_BAND.items()
        for band, numbers in zip(_BANDS, row, strict=True)
    ),
    Figure("plate", "largest rise per count of pressure", 0.45, 0.37, 0.56, "RF", band=_MIDDLE, sets="clamp"),
    Figure("plate", "largest drop per count of pressure", 1.15, 0.37, 1.61, "RF", band=_MIDDLE),
    Figure("plate", "angle of the deepest fall", 17, 6, 29, "RF", band=_MIDDLE),
    Figure("plate", "angle of crossing", 37.5, 28, 47, "RF; a quarter either way", band=_ALL),
    Figure("plate", "share falling", 0.0, 0.0, 0.02, "RF", band=_ALL, channels=("E4", "E6", "E14", "E16")),
    Figure("plate", "first component", 0.30, 0.225, 0.375, "RF; a quarter either way", band=_ALL),
    Figure("plate", "first five components", 0.89, 0.85, 0.93, "RF; 0.04 either way", band=_ALL),
    Figure("level plate", "change", -40, -102, -14, "RF; twice either way", band=_LEVEL,
           channels=("E17", "E18", "E19")),
    Figure("level plate", "change per count of pressure", 0.31, 0.135, 0.70, "RF; twice either way", band=_LEVEL,
           channels=("E6", "E16")),
    Figure("level plate", "change per count of pressure", 0.05, 0.005, 0.18, "RF; twice either way", band=_LEVEL,
           channels=("E2", "E3", "E12", "E13")),
    Figure("rest", "vibration", 4.8, 4.5, 5.1, "RG, three units", sets="hum"),
    *(Figure("rest", "vibration", (low + high) / 2, low, high, "RG, three units", frequency=band)
      for band, (low, high) in zip(_HERTZ, ((0.4, 0.8), (0.94, 0.99), (2.1, 3.5), (1.8, 2.2), (2.4, 2.5), (1.8, 1.9)),
                                   strict=True)),
    Figure("slide", "vibration", 158, 96, 242, "DX"),
    *(Figure("slide", "vibration", typical, 0.75 * typical, 1.25 * typical, "DX; a quarter either way", frequency=band)
      for band, typical in zip(_HERTZ, (77.0, 78.0, 26.0, 7.0, 7.1, 4.6), strict=True)),
)  # fmt: skip
ICUB = (
    Figure("grasp", "largest drop", 26, 12, 57, "IG", sets="gain"),
    Figure("grasp", "deepest drop", 98, 49, 147, "IG; half either way"),
    Figure("grasp", "taxels moved", 3, 2, 6, "IG"),
    Figure("grasp", "participation", 2.9, 1.8, 5.7, "IG"),
    Figure("grasp", "share rising", 0.048, 0.0, 0.09, "IG; 0 on the thumb, .07 on the middle finger"),
    Figure("grasp", "first component", 0.68, 0.62, 0.82, "IG, three fingers"),
    Figure("grasp", "second component", 0.16, 0.14, 0.20, "IG, three fingers"),
)
