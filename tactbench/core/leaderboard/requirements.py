"""Columns of the leaderboard that show, for each sensor, if given requirements are met.

A requirement is met, missed or unknown: unknown if the property is only assumed, or if no source states it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from operator import itemgetter
from typing import Any, NamedTuple

from tactbench.core.leaderboard.names import Bars, Line, Row, sensor_name
from tactbench.core.leaderboard.table import Block, Table
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.spec.task import TaskSpec
from tactbench.core.spec.units import conversion
from tactbench.core.tables.text import duration

MET, MISSED, UNKNOWN = "met", "missed", "unknown"
"""First words of the texts in a column of requirements."""
ANSWER, DELAY, RANGE, RATE = "answer", "answer delay", "force range", "rate"
COLUMNS = ("place", "sensor", "estimator", "score", "notes", "interval", "beyond floor", DELAY, RANGE, RATE, ANSWER)
_PARTS = ("sampling", "link", "window", "features", "prediction")
"""Parts of the delay between a touch and the answer, for estimators that read the sensor."""


class Requirements(NamedTuple):
    """Requirements on a sensor and its answers; None for a property without requirement."""

    max_delay_ms: float | None = None
    """Largest time from a touch to the answer [ms]."""
    range_n: float | None = None
    """Largest normal force that must be measured [N]."""
    rate_hz: float | None = None
    """Smallest rate of answers [Hz]."""


def with_requirements(table: Table, required: Requirements, task: TaskSpec, specs: Mapping[str, SensorSpec]) -> Table:
    """Return a one-task leaderboard with a column for each requirement, without trivial answers.

    Answers are ordered by the number of missed requirements, then of unknown requirements, then by their place;
    answers that cannot be used come last.

    Parameters
    ----------
    specs
        Specs by name of sensor; range and rate of other sensors are unknown.
    """
    blocks = tuple(_block(block, required, task, specs) for block in table.blocks)
    return replace(table, blocks=tuple(block for block in blocks if block.lines), sections=())


def _block(block: Block, required: Requirements, task: TaskSpec, specs: Mapping[str, SensorSpec]) -> Block:
    found: list[tuple[tuple[bool, int, int], Line]] = []
    for line in block.lines:
        if not line.row["is_baseline"]:
            texts = standing(line.row, required, task, specs.get(line.row["sensor"]))
            states = [text.partition(":")[0] for text in texts.values()]
            order = texts.get(ANSWER, "").startswith(MISSED), states.count(MISSED), states.count(UNKNOWN)
            found.append((order, replace(line, texts=dict.fromkeys(COLUMNS, "") | dict(line.texts) | texts)))
    found.sort(key=itemgetter(0))  # equal ones stay in the order of their places
    meet = dict.fromkeys(sensor_name(line.row) for order, line in found if not any(order))
    verdict = f"All requirements are met by {', '.join(meet)}." if meet else "No answer surely meets all requirements."
    verdicts = (verdict,) * (required != Requirements()) + block.verdict
    notes = block.notes
    if required.range_n is not None:
        most_n = max((planned.scene.profile.largest_n for planned in task.scenes), default=0.0)
        if not block.lines[0].row["simulated"]:
            notes += ("The largest force behind these scores is unknown: the rows do not state it.",)
        elif required.range_n > most_n:
            notes += (f"Scores are of forces up to {most_n:.3g} N; errors at larger forces are unknown.",)
    return replace(block, lines=tuple(line for _, line in found), verdict=verdicts, notes=notes)


def standing(row: Row, required: Requirements, task: TaskSpec, spec: SensorSpec | None) -> dict[str, str]:
    """Return a row's text for each requirement's column: ``met: 30 N``, ``missed: 50 Hz``, ``unknown: …``."""
    if spec is not None and not spec.data_sheet.exists:
        return {ANSWER: f"{MISSED}: the sensor is a definition, no device"}
    if row["status"] != "done":
        return {ANSWER: f"{MISSED}: the cell is {row['status']}"}
    if Bars().no_better(row):
        return {ANSWER: f"{MISSED}: no better than a trivial answer"}
    rate_hz = _stated_rate_hz(task, spec)
    found = {ANSWER: f"{UNKNOWN}: no trivial answer beside it"} if row.get("baseline") is None else {}
    if required.max_delay_ms is not None:
        found[DELAY] = _delay(row, required.max_delay_ms, stated=rate_hz is not None)
    if required.range_n is not None:
        found[RANGE] = _range(spec, required.range_n)
    if required.rate_hz is not None:
        found[RATE] = _rate(row, rate_hz, required.rate_hz)
    return found


def _delay(row: Row, most_ms: float, *, stated: bool) -> str:
    """Return the text on the delay [ms]; the sum of its known parts is a lower bound."""
    timed: dict[str, Any] = row.get("delay_parts_ms") or {}
    parts = {name: timed[name] for name in timed if stated or name != "sampling"}
    needed = _PARTS if row["looks_at"] == "features" else ("prediction",)
    lacking = [name for name in needed if name not in parts]
    text = f"{'at least ' if lacking else ''}{duration(sum(parts.values()) * 1e-3)}"
    if sum(parts.values()) > most_ms:
        return f"{MISSED}: {text}"
    return f"{UNKNOWN}: {text}, without {', '.join(lacking)}" if lacking else f"{MET}: {text}"


def _range(spec: SensorSpec | None, least_n: float) -> str:
    stated = spec.data_sheet.force_range if spec else None
    if stated is None or stated.source.tag == "assumed":
        return f"{UNKNOWN}: not stated" if stated is None else f"{UNKNOWN}: {stated} is assumed"
    upper_n = stated.upper * conversion(stated.unit, "N")
    return f"{MET if upper_n >= least_n else MISSED}: {upper_n:.3g} N"


def _rate(row: Row, sampled_hz: float | None, least_hz: float) -> str:
    """Return the text on the rate: the smaller of the sampling rate and the rate of computing answers [Hz]."""
    answered_hz = 1e3 / row["latency_ms_p50"] if row.get("latency_ms_p50") else None
    known = [rate for rate in (sampled_hz, answered_hz) if rate is not None]
    if known and min(known) < least_hz:
        return f"{MISSED}: {min(known):.3g} Hz"
    if sampled_hz is None:
        return f"{UNKNOWN}: no source states the sampling rate"
    return f"{UNKNOWN}: answers are not timed" if answered_hz is None else f"{MET}: {min(known):.3g} Hz"


def _stated_rate_hz(task: TaskSpec, spec: SensorSpec | None) -> float | None:
    """Return the rate [Hz] of the slowest stream with features of the task; None if a rate is not from a source."""
    used = [one for one in spec.streams if any(each.kind in task.features for each in one.channels)] if spec else []
    rates = [one.rate_hz if one.rate_source is not None and one.rate_source.tag != "assumed" else None for one in used]
    known = [rate for rate in rates if rate is not None]
    return min(known) if known and len(known) == len(used) else None
