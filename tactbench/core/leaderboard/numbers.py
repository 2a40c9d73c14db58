"""Numbers as people read them."""

from __future__ import annotations


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
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if seconds * factor >= 0.9995:
            return f"{_three(seconds * factor)} {unit}"
    return f"{_three(seconds * 1e6)} µs" if seconds > 0 else "0 s"


def whole(value: int | None) -> str:
    """Return a count with thin groups of three."""
    return "–" if value is None else f"{value:,}".replace(",", "\u202f")


def _three(value: float) -> str:
    digits = 0 if value >= 99.95 else 1 if value >= 9.995 else 2
    return f"{value:.{digits}f}"
