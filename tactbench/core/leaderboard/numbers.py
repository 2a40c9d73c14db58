"""Numbers as people read them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

ABSENT = "–"


def scores(values: Sequence[float | None], units: Sequence[str]) -> list[str]:
    """Return scores: three decimals for shares; four for numbers with a unit, two from ten on."""
    return [
        ABSENT if value is None
        else f"{value:.3f}" if unit == "1"
        else f"{value:.4f}" if -10 < value < 10
        else f"{value:.2f}"
        for value, unit in zip(values, units, strict=True)
    ]  # fmt: skip


def score(value: float | None, unit: str) -> str:
    """Return one of `scores`."""
    return scores((value,), (unit,))[0]


def intervals(lows: Sequence[float | None], highs: Sequence[float | None], units: Sequence[str]) -> list[str]:
    """Return intervals in the digits of their scores."""
    ends = zip(scores(lows, units), scores(highs, units), strict=True)
    return [ABSENT if low == ABSENT or high == ABSENT else f"{low} … {high}" for low, high in ends]


def interval(low: float | None, high: float | None, unit: str) -> str:
    """Return one of `intervals`."""
    return intervals((low,), (high,), (unit,))[0]


def suffix(unit: str) -> str:
    """Return what follows a number: its unit, and nothing where it has none."""
    return "" if unit == "1" else f" {unit}"


def duration(seconds: float | None) -> str:
    """Return a duration with three significant digits and a unit that fits."""
    if seconds is None:
        return ABSENT
    if seconds >= 0.9995:
        value, unit = seconds, "s"
    elif (value := seconds * 1e3) >= 0.9995:
        unit = "ms"
    elif seconds > 0:
        value, unit = seconds * 1e6, "µs"
    else:
        return "0 s"
    if value >= 99.95:
        return f"{value:.0f} {unit}"
    return f"{value:.1f} {unit}" if value >= 9.995 else f"{value:.2f} {unit}"


def delay(known_ms: float | None, parts_ms: Mapping[str, float] | None) -> str:
    """Return an answer delay; of readings whose link is not known, as the least that it can be."""
    if known_ms is None:
        return ABSENT
    least = "≥ " if parts_ms and "window" in parts_ms and "link" not in parts_ms else ""
    return f"{least}{duration(known_ms / 1e3)}"


def tail(p95_ms: float | None, largest_ms: float | None, calls: int | None) -> str:
    """Return the 95th percentile of times; where there are too few calls for one, the largest of them, and says so."""
    if p95_ms is not None:
        return duration(p95_ms / 1e3)
    return ABSENT if largest_ms is None else f"{duration(largest_ms / 1e3)} (largest of {calls})"


@lru_cache(maxsize=4096, typed=True)  # rows of one data set have the same counts
def whole(value: int | None) -> str:
    """Return a count with thin groups of three."""
    return ABSENT if value is None else f"{value:,}".replace(",", "\u202f")
