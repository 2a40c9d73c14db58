"""Formatting of scores, intervals and times as text."""

from __future__ import annotations

from collections.abc import Mapping

ABSENT = "–"


def score(value: float | None, unit: str) -> str:
    """Return a score as text: three decimals if its unit is 1; otherwise four decimals, or two from 10 on."""
    if value is None:
        return ABSENT
    return f"{value:.3f}" if unit == "1" else f"{value:.4f}" if -10 < value < 10 else f"{value:.2f}"


def interval(low: float | None, high: float | None, unit: str) -> str:
    """Return an interval as text with the decimals of `score`; its upper end is "open" if `high` is None."""
    return ABSENT if low is None else f"{score(low, unit)} … {'open' if high is None else score(high, unit)}"


def signed(value: float, unit: str) -> str:
    """Return a difference of scores as text with its sign and the decimals of `score`."""
    return ("+" if value >= 0 else "−") + score(abs(value), unit)


def suffix(unit: str) -> str:
    """Return the text to append to a number: a space and the unit, or nothing if the unit is 1."""
    return "" if unit == "1" else f" {unit}"


def score_with_unit(value: float | None, unit: str) -> str:
    """Return a score as text with its unit, as ``0.1234 N``."""
    return score(value, unit) + suffix(unit)


def duration(seconds: float | None) -> str:
    """Return a duration as text with three significant digits, in s, ms or µs."""
    if seconds is None:
        return ABSENT
    scales = ((value, unit) for value, unit in ((seconds, "s"), (seconds * 1e3, "ms")) if value >= 0.9995)
    value, unit = next(scales, (seconds * 1e6, "µs") if seconds else (0, "s"))
    return f"{value:.{0 if value >= 99.95 else 1 if value >= 9.995 else 2}f} {unit}"


def delay(known_ms: float | None, parts_ms: Mapping[str, float] | None) -> str:
    """Return the delay of an answer as text, with ≥ if the delay of the sensor's link is unknown."""
    if known_ms is None:
        return ABSENT
    least = "≥ " if parts_ms and "window" in parts_ms and "link" not in parts_ms else ""
    return f"{least}{duration(known_ms / 1e3)}"


def whole(value: int | None) -> str:
    """Return a count as text, with a thin space between groups of three digits."""
    return ABSENT if value is None else f"{value:,}".replace(",", "\u202f")
