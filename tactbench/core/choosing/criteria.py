"""How one answer stands to each wish: met, missed by so much, or unknown.

What nobody states is unknown, and so is what is only assumed; neither is ever met.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

from tactbench.core.leaderboard.names import LOWER_IS_BETTER
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.spec.task import TaskSpec
from tactbench.core.spec.units import conversion
from tactbench.core.tables.numbers import duration, score_with_unit

Row = Mapping[str, Any]
State = Literal["met", "missed", "unknown"]

_PARTS = ("sampling", "link", "window", "features", "prediction")
"""Parts of an answer's delay, in the order in which they pass."""


class Wish(NamedTuple):
    """What an integrator wants, each above 0; None: no matter."""

    max_delay_ms: float | None = None
    """Largest time from a touch to the answer [ms]."""
    range_n: float | None = None
    """Largest normal force that must be told [N]."""
    rate_hz: float | None = None
    """Smallest rate of answers [Hz]."""
    score: float | None = None
    """Worst score [the metric's unit]: the largest of an error, the smallest of any other metric."""


@dataclass(frozen=True)
class Criterion:
    """How one answer stands to one wish."""

    wish: str
    """``answer delay``, ``force range``, ``rate`` or ``score``."""
    state: State
    text: str
    """What is known, in a few words, and by how much the wish is missed."""
    value: float | None = None
    """What the wish is compared with, in its unit; None: unknown."""
    relative: float = 0.0
    """By how much it is missed, over the wish [1]; 0 where it is not."""


class ScoreInterval(NamedTuple):
    """A score and its interval, in the metric's unit."""

    value: float
    low: float | None
    high: float | None


def criteria_of(
    row: Row, figure: ScoreInterval, wish: Wish, task: TaskSpec, spec: SensorSpec | None
) -> tuple[Criterion, ...]:
    """Return how an answer stands to each wish that there is.

    Parameters
    ----------
    figure
        What is compared with the wished score.
    spec
        Of the sensor; None: not installed, so that its range and rate are unknown.
    """
    sampled, stated = _sampled(task, spec)
    found = []
    if wish.max_delay_ms is not None:
        found.append(_delay(row, wish.max_delay_ms, stated))
    if wish.range_n is not None:
        found.append(_range(wish.range_n, spec))
    if wish.rate_hz is not None:
        found.append(_rate(row, wish.rate_hz, sampled, stated))
    if wish.score is not None:
        found.append(_score(figure, wish.score, wish.range_n, task, pressed_n(row, task)))
    if row.get("baseline") is None:
        found.append(Criterion("trivial answer", "unknown", "no trivial answer beside it"))
    return tuple(found)


def pressed_n(row: Row, task: TaskSpec) -> float | None:
    """Return the largest force [N] of the scenes that an answer was asked about; None: not known, of recordings."""
    if not row["simulated"]:
        return None
    return max((planned.scene.profile.largest_n for planned in task.scenes), default=None)


def newtons(force_n: float) -> str:
    """Return a force with its unit."""
    return f"{force_n:.3g} N"


def listed(words: Sequence[str]) -> str:
    """Return words as a list in a sentence."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def _delay(row: Row, wished: float, rate_stated: bool) -> Criterion:
    name, delay_ms = "answer delay", row.get("answer_delay_ms")
    parts = {part: time for part, time in (row.get("delay_parts_ms") or {}).items() if time is not None}
    least = delay_ms if delay_ms is not None else sum(parts.values()) if parts else row.get("latency_ms_p50")
    if least is None:
        return Criterion(name, "unknown", "not timed")
    # Without the link an answer from readings is later than its row says.
    lacking = [part for part in _PARTS if part not in parts] if parts and row.get("looks_at") == "features" else []
    assumed = "sampling" in parts and not rate_stated
    sure = least - parts["sampling"] if assumed else least
    whole = delay_ms is not None and not assumed and "link" not in lacking
    if sure > wished or whole:
        how = "" if whole else "at least "
        return _compared(name, sure, wished, lambda ms: how + _ms(ms), "too slow", least=False)
    without = f" without {listed(lacking)}" if lacking else ""
    text = f"{_ms(least)}{without}" if parts else f"prediction alone {_ms(least)}"
    return Criterion(name, "unknown", text + (" by an assumed rate" if assumed else ""))


def _range(wished: float, spec: SensorSpec | None) -> Criterion:
    name, stated = "force range", spec.data_sheet.force_range if spec else None
    if stated is None or stated.source.tag == "assumed":
        return Criterion(name, "unknown", "not stated" if stated is None else f"{stated}, assumed")
    upper = stated.upper * conversion(stated.unit, "N")
    return _compared(name, upper, wished, newtons, "short of range", least=True)


def _rate(row: Row, wished: float, sampled: float | None, stated: bool) -> Criterion:
    name, taken = "rate", row.get("latency_ms_p50")
    if sampled is None:
        return Criterion(name, "unknown", "not stated")
    answered = 1e3 / taken if taken else None
    if answered is not None and answered < min(sampled, wished):
        return _compared(name, answered, wished, _hz, "too low", least=True)
    if not stated:
        return Criterion(name, "unknown", f"{_hz(sampled)}, assumed")
    if answered is None and sampled >= wished:
        return Criterion(name, "unknown", f"samples at {_hz(sampled)}, answers not timed")
    return _compared(name, sampled if answered is None else min(sampled, answered), wished, _hz, "too low", least=True)


def _sampled(task: TaskSpec, spec: SensorSpec | None) -> tuple[float | None, bool]:
    """Return the rate [Hz] of the sensor's slowest stream that answers look at, and whether a source states it."""
    streams = [
        stream
        for stream in (spec.streams if spec else ())
        if any(channel.kind in task.features for channel in stream.channels)
    ]
    rates = [stream.rate_hz for stream in streams if stream.rate_hz is not None]
    if not streams or len(rates) < len(streams):
        return None, False
    sources = [stream.rate_source for stream in streams]
    return min(rates), all(source is not None and source.tag != "assumed" for source in sources)


def _score(
    figure: ScoreInterval, wished: float, range_n: float | None, task: TaskSpec, pressed: float | None
) -> Criterion:
    lower = task.metric in LOWER_IS_BETTER
    word = "above the wished error" if lower else "below the wished score"

    found = _compared(
        "score", figure.value, wished, lambda number: score_with_unit(number, task.unit), word, least=not lower
    )
    if found.state == "missed":
        return found
    if range_n is not None and pressed is None:
        return Criterion("score", "unknown", "how hard was pressed is not stated")
    if range_n is not None and pressed is not None and range_n > pressed:
        return Criterion("score", "unknown", f"pressed to {newtons(pressed)} only")
    end = figure.high if lower else figure.low
    crosses = end is not None and (end > wished if lower else end < wished)
    return replace(found, text="but not by its whole interval" if crosses else "")


def _compared(
    name: str, value: float, wished: float, formatted: Callable[[float], str], word: str, *, least: bool
) -> Criterion:
    """Return how a value stands to the least, or else the most, that is wished."""
    short = wished - value if least else value - wished
    if not short > 0:
        return Criterion(name, "met", formatted(value), value)
    return Criterion(name, "missed", f"{formatted(value)}, {formatted(short)} {word}", value, short / wished)


def _ms(milliseconds: float) -> str:
    return duration(milliseconds * 1e-3)


def _hz(hertz: float) -> str:
    return f"{hertz:.3g} Hz"
