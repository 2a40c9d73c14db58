"""Which sensor meets a wish: scores and delays from rows, range and rate from the sensors' specs.

Each wish is met, missed by so much, or unknown. What is unknown, or only assumed, never counts as met; an answer that
is no better than a trivial one is never proposed; simulated and measured rows are never in one list.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

from tactbench.core.choosing.criteria import (
    Criterion,
    Row,
    ScoreInterval,
    State,
    Wish,
    criteria_of,
    listed,
    newtons,
    pressed_n,
)
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, answer_name, hardware_name, metric_name, sensor_name
from tactbench.core.leaderboard.trivial import no_better
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.spec.task import TaskSpec
from tactbench.core.tables.text import command_line, visible


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
        Of one task, protocol and split, baselines filled in (`tactbench.core.matrix.summary.fill_baselines`).
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
        self.sign = 1.0 if task.metric in LOWER_IS_BETTER else -1.0
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
        name = metric_name({"metric": self.task.metric, "unit": self.task.unit})
        quantity = name.replace(" [", " beyond the reference's noise [") if self.beyond else name
        methods = dict.fromkeys(visible(str(one.row.get("ci_method") or "")) for one in chosen if one.low is not None)
        intervals = tuple(method if "%" in method else f"95 %, {method}" for method in methods if method)
        return Choice(
            hardware, quantity, self.task.unit, self.verdict(chosen), tuple(chosen), intervals, tuple(unknown),
            tuple(left_out),
        )  # fmt: skip

    def candidate(self, row: Row) -> Candidate:
        keys = ("score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high")
        value, low, high = (row.get(key) for key in (keys if self.beyond else ("score", "ci_low", "ci_high")))
        assert value is not None
        figure, spec = ScoreInterval(value, low, high), self.sensors.get(row["sensor"])
        return Candidate(
            sensor_name(row), answer_name(row), *figure, criteria_of(row, figure, self.wish, self.task, spec), row
        )

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
            replay = command_line(
                "tactbench", "run", "--rig", "replay", "--recordings", "DIR", "--task", self.task.name
            )
            yield f"how a real unit scores, for these are SIM; with recordings of one run `{replay}`."
        tested = {row["sensor"] for row in self.rows}
        for name, spec in sorted(self.sensors.items()):
            if name not in tested and spec.data_sheet.exists and spec.channels(*self.task.features):
                yield f"how {visible(name)} scores: no result here; run `{self.run(name)}`."

    def run(self, sensor: str, *more: str) -> str:
        protocol = self.rows[0]["protocol"]
        return command_line("tactbench", "run", "--sensor", sensor, "--task", self.task.name,
                            "--protocol", protocol, *more)  # fmt: skip
