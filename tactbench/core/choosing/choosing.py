"""Which sensor meets a wish: scores and delays from rows, range and rate from the sensors' specs.

Each wish is met, missed by so much, or unknown. What nobody states is unknown, and so is what is only assumed: neither
is ever met. An answer that is no better than a trivial one is never proposed; simulated and measured rows are never in
one list.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import isfinite
from typing import Any, Literal, NamedTuple

from tactbench.core.leaderboard.names import (
    answer_name,
    hardware_name,
    lower_is_better,
    metric_name,
    no_better,
    sensor_name,
)
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.spec.task import TaskSpec
from tactbench.core.spec.units import conversion
from tactbench.core.tables.numbers import duration, score_with_unit
from tactbench.core.tables.text import command_line, visible

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


@dataclass(frozen=True)
class Candidate:
    """The answer of a sensor that comes nearest to the wish."""

    sensor: str
    """As shown: marked SIM where it was simulated."""
    estimator: str
    score: float
    low: float | None
    high: float | None
    criteria: tuple[Criterion, ...]
    row: Row

    def named(self, state: State) -> list[Criterion]:
        """Return the wishes that are met, missed or unknown."""
        return [one for one in self.criteria if one.state == state]


@dataclass(frozen=True)
class Choice:
    """What the rows of one kind of hardware say to a wish."""

    hardware: str
    quantity: str
    """What the scores are, with its unit."""
    unit: str
    verdict: str
    candidates: tuple[Candidate, ...]
    """One a sensor: those that meet all by score, then those with fewest unknowns, then those that miss least."""
    intervals: tuple[str, ...]
    """What the intervals are of."""
    unknown: tuple[str, ...]
    """What would have to be known, and what to do for it."""
    left_out: tuple[str, ...]
    """Sensors that are not proposed, and why."""

    def record(self) -> dict[str, Any]:
        """Return it as plain values, for programs."""
        found = []
        for one in self.candidates:
            row, criteria = one.row, [asdict(criterion) for criterion in one.criteria]
            known = {
                key: row.get(key)
                for key in ("cell", "sensor", "estimator", "params", "simulated", "emulated", "baseline", "ci_method")
            }
            found.append({**known, "score": one.score, "low": one.low, "high": one.high, "criteria": criteria})
        return {
            "hardware": self.hardware, "verdict": self.verdict, "quantity": self.quantity, "unit": self.unit,
            "candidates": found, "intervals": self.intervals, "unknown": self.unknown, "left_out": self.left_out,
        }  # fmt: skip


def choose(rows: Sequence[Row], wish: Wish, task: TaskSpec, sensors: Mapping[str, SensorSpec]) -> tuple[Choice, ...]:
    """Hold answers against a wish.

    Parameters
    ----------
    rows
        Of one task, protocol and split, as :func:`over_replicates` gives them.
    sensors
        Specs by name; a sensor that is not installed has no known range and rate.

    Returns
    -------
    tuple of Choice
        Measured rows first, then simulated ones.
    """
    kinds: dict[tuple[bool, str], list[Row]] = {}
    for row in rows:
        kinds.setdefault((bool(row["simulated"]), hardware_name(row)), []).append(row)
    return tuple(_Choosing(members, wish, task, sensors).choice(kind) for (_, kind), members in sorted(kinds.items()))


class _Choosing:
    """The rows of one kind of hardware."""

    def __init__(self, rows: Sequence[Row], wish: Wish, task: TaskSpec, sensors: Mapping[str, SensorSpec]) -> None:
        self.wish, self.task, self.sensors, self.rows = wish, task, sensors, rows
        done = [row for row in rows if row["status"] == "done" and not row["is_baseline"] and isfinite(row["score"])]
        self.sign = 1.0 if lower_is_better(task.metric) else -1.0
        self.beyond = bool(done) and all(row.get("score_beyond_floor") is not None for row in done)
        self.answers = done

    def choice(self, hardware: str) -> Choice:
        by_sensor: dict[str, list[Candidate]] = {name: [] for name in dict.fromkeys(r["sensor"] for r in self.answers)}
        for row in self.answers:
            if not no_better(row):
                by_sensor[row["sensor"]].append(self.candidate(row))
        left_out = []
        for name in dict.fromkeys([*by_sensor, *(row["sensor"] for row in self.rows)]):
            if name in self.sensors and not self.sensors[name].data_sheet.exists:
                by_sensor.pop(name, None)
                left_out.append(f"{visible(name)}: it exists as a definition only.")
            elif name not in by_sensor:
                left_out.append(f"{visible(name)}: there is no finished answer beside trivial ones.")
            elif not by_sensor[name]:
                why = self.run(name, "--probe")
                left_out.append(f"{visible(name)}: no answer of it is better than a trivial one; `{why}` says why.")
        chosen = sorted((min(found, key=self.order) for found in by_sensor.values() if found), key=self.order)
        unknown = dict.fromkeys(sentence for one in chosen for sentence in self.unknown(one))
        unknown.update(dict.fromkeys(self.of_all(chosen)))
        metric = self.answers[0]["metric"] if self.answers else self.task.metric
        name = metric_name({"metric": metric, "unit": self.task.unit})
        quantity = name.replace(" [", " beyond the reference's noise [") if self.beyond else name
        intervals = dict.fromkeys(visible(str(one.row.get("ci_method"))) for one in chosen if one.low is not None)
        return Choice(
            hardware, quantity, self.task.unit, self.verdict(chosen), tuple(chosen), tuple(intervals), tuple(unknown),
            tuple(left_out),
        )  # fmt: skip

    def candidate(self, row: Row) -> Candidate:
        keys = ("score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high")
        value, low, high = (row.get(key) for key in (keys if self.beyond else ("score", "ci_low", "ci_high")))
        assert value is not None
        end = high if self.sign > 0 else low
        found = criteria_of(row, value, end, self.wish, self.task, self.sensors.get(row["sensor"]))
        return Candidate(sensor_name(row), answer_name(row), value, low, high, found, row)

    def order(self, one: Candidate) -> tuple[Any, ...]:
        """Sort by: fewest missed, fewest unknown, least missed in proportion to the wish; then the better score."""
        missed, unknown = one.named("missed"), one.named("unknown")
        worst = max((criterion.relative for criterion in missed), default=0.0)
        better = (self.sign * one.score, self.sign * one.row["score"], one.sensor, one.estimator)
        return len(missed), len(unknown), round(worst, 9), *better

    def verdict(self, chosen: Sequence[Candidate]) -> str:
        if not chosen:
            return f"Cannot say: no answer to {self.task.name} here can be proposed."
        first, count = chosen[0], len(chosen[0].criteria)
        name = f"{first.sensor} / {first.estimator}"
        missed, unknown = first.named("missed"), [one.wish for one in first.named("unknown")]
        unsure = unknown and f"its {listed(unknown)} {'is' if len(unknown) == 1 else 'are'} unknown"
        if missed:
            by = " and ".join(f"{one.wish} {one.text}" for one in missed)
            return f"None meets all: nearest is {name}, {by}" + (f"; {unsure}." if unknown else ".")
        if unknown:
            return f"Cannot say: none is known to meet all; {name} misses nothing that is known, but {unsure}."
        if not count:
            return f"{name} has the best score."
        others = [one for one in chosen[1:] if not one.named("missed") and not one.named("unknown")]
        met = "meets the wish" if count == 1 else f"meets all {count} wishes"
        if not others:
            return f"{name} {met}."
        return f"{name} {met}; {', '.join(f'{one.sensor} / {one.estimator}' for one in others)} too."

    def unknown(self, one: Candidate) -> Iterable[str]:
        """Yield what is not known of a candidate, and what to do about it."""
        sensor = visible(one.row["sensor"])
        again = self.run(one.row["sensor"], "--estimator", one.row["estimator"])
        for criterion in one.named("unknown"):
            step = f"; run `{again}`" if criterion.wish in ("answer delay", "trivial answer") else ""
            yield f"the {criterion.wish} of {sensor}: {criterion.text}{step}."
        if one.low is None or one.high is None:
            yield f"how sure the score of {sensor} is: it has no interval; run `{again} --repeats 8`."

    def of_all(self, chosen: Sequence[Candidate]) -> Iterable[str]:
        """Yield what no answer here can say."""
        wished = self.wish.range_n
        if chosen and wished is not None:
            pressed = pressed_n(chosen[0].row, self.task)
            if pressed is None:
                yield "up to which force these scores hold: the rows do not say how hard was pressed."
            elif wished > pressed:
                yield f"any error beyond {newtons(pressed)}: the scenes of {self.task.name} press no harder."
        if chosen and all(one.row["simulated"] for one in chosen):
            replay = command_line("tactbench", "run", "--recordings", "DIR", "--task", self.task.name)
            yield f"how a real unit scores, for these are SIM; with recordings of one run `{replay}`."
        tested = {row["sensor"] for row in self.rows}
        for name, spec in sorted(self.sensors.items()):
            if name not in tested and spec.data_sheet.exists and spec.channels(*self.task.features):
                yield f"how {visible(name)} scores: no result here; run `{self.run(name)}`."

    def run(self, sensor: str, *more: str) -> str:
        protocol = self.rows[0]["protocol"]
        return command_line("tactbench", "run", "--sensor", sensor, "--task", self.task.name,
                            "--protocol", protocol, *more)  # fmt: skip


def criteria_of(
    row: Row, value: float, worse_end: float | None, wish: Wish, task: TaskSpec, spec: SensorSpec | None
) -> tuple[Criterion, ...]:
    """Return how an answer stands to each wish that there is.

    Parameters
    ----------
    value, worse_end
        What is compared with the wished score, and the worse end of its interval.
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
        found.append(_score(value, worse_end, wish.score, wish.range_n, task, pressed_n(row, task)))
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
    value: float, end: float | None, wished: float, range_n: float | None, task: TaskSpec, pressed: float | None
) -> Criterion:
    lower = lower_is_better(task.metric)
    word = "above the wished error" if lower else "below the wished score"

    found = _compared("score", value, wished, lambda number: score_with_unit(number, task.unit), word, least=not lower)
    if found.state == "missed":
        return found
    if range_n is not None and (pressed is None or range_n > pressed):
        known = "how hard was pressed is not stated" if pressed is None else f"pressed to {newtons(pressed)} only"
        return Criterion("score", "unknown", known)
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
