"""Numbers as people read them."""

from __future__ import annotations

from functools import lru_cache


def score(value: float | None, unit: str) -> str:
    """Return a score: three decimals for shares; four for numbers with a unit, two from ten on."""
    if value is None:
        return "–"
    if unit == "1":
        return f"{value:.3f}"
    return f"{value:.4f}" if abs(value) < 10 else f"{value:.2f}"


def interval(low: float | None, high: float | None, unit: str) -> str:
    """Return an interval in the digits of its score."""
    return "–" if low is None or high is None else f"{score(low, unit)} … {score(high, unit)}"


def suffix(unit: str) -> str:
    """Return what follows a number: its unit, and nothing where it has none."""
    return "" if unit == "1" else f" {unit}"


def duration(seconds: float | None) -> str:
    """Return a duration with three significant digits and a unit that fits."""
    if seconds is None:
        return "–"
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


@lru_cache(maxsize=4096, typed=True)  # rows of one data set have the same counts
def whole(value: int | None) -> str:
    """Return a count with thin groups of three."""
    return "–" if value is None else f"{value:,}".replace(",", "\u202f")
