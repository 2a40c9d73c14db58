"""Statistics by name: how each is taken from evidence, and what it needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from tactbench.plugin import FloatArray, NotApplicable
from tactbench.plugin.simulation import RealFigure
from tactbench.rigs.twin.likeness import statistics
from tactbench.rigs.twin.likeness.evidence import MOVED_FROM, Evidence

Statistic = Callable[[Evidence, RealFigure], float]
LEAST_ROWS = 3
LONG_ENOUGH_S = 300.0
"""A warm-up of eight minutes cannot be told from a straight line in less."""
BINS_DEG = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 75.0, 90.0, 180.0)


def take(evidence: Evidence, figure: RealFigure) -> float:
    """Return the figure's statistic; raises NotApplicable, with the reason, if the evidence cannot answer."""
    if figure.statistic not in STATISTICS:
        raise NotApplicable(
            f"the statistic {figure.statistic!r} is not known", hint=f"Known: {', '.join(sorted(STATISTICS))}."
        )
    return STATISTICS[figure.statistic](evidence, figure)


def _stretches(evidence: Evidence) -> list[FloatArray]:
    long = [rows for rows in evidence.rest if rows.shape[0] >= LEAST_ROWS]
    if not long:
        raise NotApplicable(f"no stretch of {LEAST_ROWS} rows is untouched")
    return long


def _levels(evidence: Evidence) -> FloatArray:
    if not evidence.rest:
        raise NotApplicable("nothing is untouched")
    return np.stack([rows.mean(axis=0) for rows in evidence.rest])


def _noise(stretches: list[FloatArray]) -> FloatArray:
    """Return (channels,) the noise, stretches weighted by their second differences."""
    weights = np.array([rows.shape[0] - 2.0 for rows in stretches])
    squares = np.stack([statistics.white_noise(rows) ** 2 for rows in stretches])
    return np.asarray(np.sqrt(weights @ squares / weights.sum()))


def _pressure_rest(evidence: Evidence) -> list[FloatArray]:
    rows = [stretch[:, None] for stretch in evidence.pressure_rest if stretch.size >= LEAST_ROWS]
    if not rows:
        raise NotApplicable("there is no channel of the fluid's pressure")
    return rows


def _vibration(evidence: Evidence, figure: RealFigure) -> float:
    if not evidence.vibration or evidence.vibration_hz is None:
        raise NotApplicable("no stretch of the fluid's vibration is known")
    if figure.frequency is None:
        return float(np.median([rows.std() for rows in evidence.vibration]))
    low, high = figure.frequency
    return float(
        np.median([statistics.band_rms(rows, evidence.vibration_hz, low, high) for rows in evidence.vibration])
    )


def _long(evidence: Evidence) -> tuple[FloatArray, FloatArray]:
    """Return times and the longest untouched stretch."""
    if evidence.dt_s is None:
        raise NotApplicable("there is no clock")
    rows = max(_stretches(evidence), key=len)
    if rows.shape[0] * evidence.dt_s < LONG_ENOUGH_S:
        raise NotApplicable(f"no untouched stretch lasts {LONG_ENOUGH_S:g} s")
    return np.arange(rows.shape[0], dtype=np.float64) * evidence.dt_s, rows


def _by_seconds(t_s: FloatArray, rows: FloatArray, seconds: float = 5.0) -> tuple[FloatArray, FloatArray]:
    """Return the middles of blocks of `seconds` and their means: what drifts, without the noise."""
    size = max(1, round(seconds / float(t_s[1] - t_s[0])))
    whole = rows.shape[0] // size
    return (
        np.asarray(t_s[: whole * size].reshape(whole, size).mean(axis=1)),
        np.asarray(rows[: whole * size].reshape(whole, size, -1).mean(axis=1)),
    )


def _allan(evidence: Evidence, figure: RealFigure) -> float:
    if evidence.dt_s is None or figure.at is None:
        raise NotApplicable("there is no clock")
    every = [statistics.allan_deviation(rows, evidence.dt_s, figure.at) for rows in _stretches(evidence)]
    found = [deviation for deviation in every if np.all(np.isfinite(deviation))]
    if not found:
        raise NotApplicable(f"no untouched stretch holds two averages of {figure.at:g} s")
    return float(np.median(np.sqrt(np.mean(np.stack(found) ** 2, axis=0))))


def _warm_up(evidence: Evidence, which: int) -> float:
    t, levels = _by_seconds(*_long(evidence))
    return statistics.warming(t, levels.mean(axis=1))[which]


def _warm_up_scatter(evidence: Evidence, figure: RealFigure) -> float:
    _, levels = _by_seconds(*_long(evidence))
    centred = levels - levels.mean(axis=0)
    shared = centred.mean(axis=1)
    factors = shared @ centred / (shared @ shared)
    return float(factors.std(ddof=1))


def _offset(evidence: Evidence, which: int) -> float:
    if not evidence.one_session:
        raise NotApplicable("the recordings do not say which of them share a session")
    levels = _levels(evidence)
    if levels.shape[0] < 4:
        raise NotApplicable("fewer than four recordings of one session begin untouched")
    return statistics.offsets(levels)[which]


def _per_pressure(evidence: Evidence, figure: RealFigure, sign: float) -> float:
    largest = (sign * evidence.states(figure)).max(axis=1)
    if evidence.pressure is None:
        raise NotApplicable("there is no channel of the fluid's pressure")
    return float(np.median(largest / evidence.pressure[evidence.within(figure)]))


def _median_per_pressure(evidence: Evidence, figure: RealFigure) -> float:
    if evidence.pressure is None:
        raise NotApplicable("there is no channel of the fluid's pressure")
    return float(np.median(evidence.states(figure) / evidence.pressure[evidence.within(figure)][:, None]))


def _angles(evidence: Evidence, figure: RealFigure) -> FloatArray:
    inside = evidence.within(figure)
    if evidence.angle_deg is None:
        raise NotApplicable("nobody recorded the direction of the contact")
    return evidence.angle_deg[inside]


def _fall_angle(evidence: Evidence, figure: RealFigure) -> float:
    angle, change = _angles(evidence, figure), evidence.states(figure)
    return float(np.median(angle[np.arange(change.shape[0]), change.argmin(axis=1)]))


def _crossing(evidence: Evidence, figure: RealFigure) -> float:
    angle, change = _angles(evidence, figure), evidence.states(figure)
    if evidence.pressure is None:
        raise NotApplicable("there is no channel of the fluid's pressure")
    per_count = change / evidence.pressure[evidence.within(figure)][:, None]
    return statistics.zero_crossing(angle, per_count, BINS_DEG)


def _residual(evidence: Evidence, figure: RealFigure) -> float:
    if evidence.released is None:
        raise NotApplicable("nobody marked when loads were released")
    return float(np.median(np.abs(evidence.released)) / np.median(np.abs(evidence.states(figure))))


def _components(evidence: Evidence, figure: RealFigure) -> FloatArray:
    """Return the components' shares, of each unit on its own; the median over units."""
    states = evidence.states(figure)
    unit = np.zeros(len(states), dtype=np.int64) if evidence.unit is None else evidence.unit[evidence.within(figure)]
    apart = [states[unit == which] for which in np.unique(unit)]
    shares = [statistics.component_shares(own) for own in apart if len(own) > own.shape[1]]
    if not shares:
        raise NotApplicable(f"{states.shape[0]} loaded states are too few for the components of {states.shape[1]}")
    return np.asarray(np.median(np.stack(shares), axis=0))


STATISTICS: Mapping[str, Statistic] = {
    "rest-level": lambda e, f: float(np.median(_levels(e))),
    "rest-lowest": lambda e, f: float(np.median(_levels(e), axis=0).min()),
    "rest-highest": lambda e, f: float(np.median(_levels(e), axis=0).max()),
    "rest-spread": lambda e, f: float(np.median(_levels(e).std(axis=1))),
    "white-noise": lambda e, f: float(np.median(_noise(_stretches(e)))),
    "noise-correlation": lambda e, f: statistics.noise_correlation(max(_stretches(e), key=len)),
    "pressure-rest": lambda e, f: float(np.median([rows.mean() for rows in _pressure_rest(e)])),
    "pressure-noise": lambda e, f: float(_noise(_pressure_rest(e))[0]),
    "vibration-rms": _vibration,
    "offset-shared": lambda e, f: _offset(e, 0),
    "offset-own": lambda e, f: _offset(e, 1),
    "allan-deviation": _allan,
    "warm-up": lambda e, f: _warm_up(e, 0),
    "warm-up-tau": lambda e, f: _warm_up(e, 1),
    "warm-up-share": lambda e, f: float(statistics.component_shares(_by_seconds(*_long(e))[1])[0]),
    "warm-up-scatter": _warm_up_scatter,
    "abs-change": lambda e, f: float(np.median(np.abs(e.states(f)))),
    "change": lambda e, f: float(np.median(e.states(f))),
    "change-per-pressure": _median_per_pressure,
    "largest-drop": lambda e, f: float(np.median((-e.states(f)).max(axis=1))),
    "largest-rise": lambda e, f: float(np.median(e.states(f).max(axis=1))),
    "deepest-drop": lambda e, f: float((-e.states(f)).max()),
    "second-drop": lambda e, f: float(np.sort(-e.states(f), axis=1)[np.argmax((-e.states(f)).max(axis=1)), -2]),
    "share-rising": lambda e, f: float(np.mean(e.states(f) >= MOVED_FROM)),
    "share-falling": lambda e, f: float(np.mean(e.states(f) <= -MOVED_FROM)),
    "taxels-moved": lambda e, f: float(np.median(np.sum(np.abs(e.states(f)) >= 5.0, axis=1))),
    "participation": lambda e, f: float(np.nanmedian(statistics.participation(e.states(f), MOVED_FROM))),
    "rise-per-pressure": lambda e, f: _per_pressure(e, f, 1.0),
    "drop-per-pressure": lambda e, f: _per_pressure(e, f, -1.0),
    "fall-angle": _fall_angle,
    "crossing-angle": _crossing,
    "residual-after-contact": _residual,
    "pca-first": lambda e, f: float(_components(e, f)[0]),
    "pca-second": lambda e, f: float(_components(e, f)[1]),
    "pca-third": lambda e, f: float(_components(e, f)[2]),
    "pca-first-five": lambda e, f: float(_components(e, f)[:5].sum()),
}
