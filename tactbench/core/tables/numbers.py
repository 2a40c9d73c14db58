"""Scores, intervals and times as text."""

from __future__ import annotations

from collections.abc import Mapping

ABSENT = "–"


def score(value: float | None, unit: str) -> str:
    """Return a score: three decimals for a share; four for a number with a unit, two from ten on."""
    if value is None:
        return ABSENT
    return f"{value:.3f}" if unit == "1" else f"{value:.4f}" if -10 < value < 10 else f"{value:.2f}"


def interval(low: float | None, high: float | None, unit: str) -> str:
    """Return an interval in the digits of its score; an upper end of None is open."""
    return ABSENT if low is None else f"{score(low, unit)} … {'open' if high is None else score(high, unit)}"


def signed(value: float, unit: str) -> str:
    """Return a difference in the digits of its scores, with its sign."""
    return ("+" if value >= 0 else "−") + score(abs(value), unit)


def suffix(unit: str) -> str:
    """Return the text after a number: its unit, if it has one."""
    return "" if unit == "1" else f" {unit}"


def score_with_unit(value: float | None, unit: str) -> str:
    """Return a score with its unit."""
    return score(value, unit) + suffix(unit)


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
    """Return an answer delay, with ≥ where the delay of the link is not known."""
    if known_ms is None:
        return ABSENT
    least = "≥ " if parts_ms and "window" in parts_ms and "link" not in parts_ms else ""
    return f"{least}{duration(known_ms / 1e3)}"


def whole(value: int | None) -> str:
    """Return a count with thin groups of three."""
    return ABSENT if value is None else f"{value:,}".replace(",", "\u202f")
