"""From rows to the one table object that every format is made from.

Rows under different tasks, protocols, splits or repeats, and rows from the twin and from hardware, stand in blocks of
their own: they are not comparable, and no rank spans two blocks.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.counts import told_counts
from tactbench.core.leaderboard.numbers import duration, interval, score, whole

Row = Mapping[str, Any]

LOWER_IS_BETTER = frozenset({"rmse", "mae"})
METRIC_NAMES = {
    "rmse": "RMSE",
    "mae": "MAE",
    "r2": "R²",
    "macro_f1": "macro F1",
    "accuracy": "accuracy",
    "balanced_accuracy": "balanced accuracy",
}

DAGGER = (
    "† test-set statistics were used: the protocol drops test rows by the test set's own mean and deviation, and "
    "`karl2016` scales each set, the test set too, by its own. A deployed sensor cannot; protocol `deployable` shows "
    "what it can."
)

COLUMNS = (
    "#", "sensor", "estimator", "score", "95 % interval", "published", "baseline", "n test", "sessions",
    "sim", "fit", "latency p50", "p95", "batch/row",
)  # fmt: skip
NUMERIC = frozenset(COLUMNS) - {"sensor", "estimator"}


@dataclass(frozen=True)
class Line:
    """One row as text, one string a column."""

    cells: tuple[str, ...]
    kind: str
    """result, baseline, or failed"""
    cell: str = ""
    """Name of the cell."""


@dataclass(frozen=True)
class Block:
    """Rows that may be compared."""

    title: str
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class Table:
    """A leaderboard, ready to be shown."""

    blocks: tuple[Block, ...]
    notes: tuple[str, ...]
    columns: tuple[str, ...] = COLUMNS


def build_table(rows: Sequence[Row]) -> Table:
    """Arrange `rows` into blocks, ranked, with their footnotes."""
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(_block_key(row), []).append(row)
    blocks = tuple(Block(_title(members[0]), tuple(_lines(members))) for members in groups.values())
    return Table(blocks, tuple(_notes(rows)))


def _block_key(row: Row) -> tuple[Any, ...]:
    hardware = "sim" if row["simulated"] else row["rig"]
    return (row["task"], row["protocol"], row["split"], hardware, row["repeat"])


def _title(row: Row) -> str:
    metric = METRIC_NAMES.get(row["metric"], row["metric"])
    unit = f" [{row['unit']}]" if row["unit"] != "1" else ""
    direction = "lower" if row["metric"] in LOWER_IS_BETTER else "higher"
    parts = [row["task"], f"{metric}{unit}, {direction} is better", row["protocol"] + (" †" if row["dagger"] else "")]
    if row["split"]:
        parts.append(f"split {row['split']}")
    parts.append("SIM (twin)" if row["simulated"] else f"rig {row['rig']}")
    if row["repeats"] > 1:
        parts.append(f"repeat {row['repeat']} of {row['repeats']}, seed {row['seed']}")
    return " · ".join(parts)


def _lines(members: Sequence[Row]) -> Iterable[Line]:
    sign = 1.0 if members[0]["metric"] in LOWER_IS_BETTER else -1.0
    done = [row for row in members if row["status"] == "done"]
    results = sorted((row for row in done if not row["is_baseline"]), key=lambda row: sign * row["score"])
    ranked = {row["cell"]: 1 + sum(sign * other["score"] < sign * row["score"] for other in results) for row in results}
    baselines = sorted(
        (row for row in done if row["is_baseline"]), key=lambda row: (row["sensor"], sign * row["score"])
    )
    for row in results:
        yield Line(_cells(row, str(ranked[row["cell"]])), "result", row["cell"])
    for row in baselines:
        yield Line(_cells(row, "base"), "baseline", row["cell"])
    for row in members:
        if row["status"] != "done":
            yield Line(_empty(row), "failed", row["cell"])


def _cells(row: Row, rank: str) -> tuple[str, ...]:
    unit = row["unit"]
    marks = (" †" if row["dagger"] else "") + (" ‡" if row["stamps"] else "")
    per_row = row["predict_s"] / row["batch_rows"] if row["batch_rows"] else None
    return (
        rank,
        sensor_name(row),
        answer_name(row),
        score(row["score"], unit) + marks,
        interval(row["ci_low"], row["ci_high"], unit),
        score(row["published"], unit) if row["published"] is not None else "–",
        score(row["baseline"], unit),
        whole(row["n_test"]),
        whole(row["n_sessions"]),
        duration(row["sim_s"]),
        duration(row["fit_s"]),
        duration(_seconds(row["latency_ms_p50"])),
        duration(_seconds(row["latency_ms_p95"])),
        duration(per_row),
    )


def _empty(row: Row) -> tuple[str, ...]:
    sensor = sensor_name(row)
    return ("", sensor, answer_name(row), row["status"].upper(), *("–" for _ in COLUMNS[4:]))


def sensor_name(row: Row) -> str:
    """Return a sensor's name, marked where it was simulated."""
    return f"{row['sensor']} SIM" if row["simulated"] else str(row["sensor"])


def answer_name(row: Row) -> str:
    """Return the estimator's name, with the parameters that are not its defaults."""
    options = ", ".join(f"{key}={value}" for key, value in sorted(row["params"].items()))
    return f"{row['estimator']} ({options})" if options else str(row["estimator"])


def _seconds(milliseconds: float | None) -> float | None:
    return None if milliseconds is None else milliseconds / 1e3


def _notes(rows: Sequence[Row]) -> list[str]:
    """Return the footnotes: what each mark means, what was left out, what is assumed, what failed."""
    notes: list[str] = []
    if any(row["dagger"] for row in rows):
        notes.append(DAGGER)
    notes += _distinct(f"‡ {stamp}" for row in rows for stamp in row["stamps"])
    notes += _distinct(
        f"SIM: simulated by the twin, never ranked against hardware. Assumed: {_assumptions(row)}."
        for row in rows
        if row["simulated"]
    )
    notes += _distinct(
        f"published for {row['sensor']}/{row['task']}: {score(row['published'], row['unit'])} "
        f"({row['published_reference']}): {row['published_remark']}."
        for row in rows
        if row["published"] is not None and row.get("published_remark")
    )
    for row in rows:
        if row["chosen"]:
            picked = ", ".join(f"{key.rstrip('_')} = {value:g}" for key, value in sorted(row["chosen"].items()))
            notes.append(f"{_who(row)}: chosen on validation data: {picked}.")
    notes += _no_better_notes(rows)
    notes += _distinct(f"{row['sensor']}/{row['task']}: {told}." for row in rows for told in told_counts(row["counts"]))
    notes += _distinct(f"{row['sensor']}: {remark}" for row in rows for remark in row["remarks"])
    notes += _interval_notes(rows)
    stopped: list[str] = []
    for row in rows:
        if row["status"] != "done":
            # What makes no sense to probe makes none with any estimator.
            who = row["protocol"] if is_probe(row["protocol"]) else row["estimator"]
            stopped.append(f"{row['sensor']}/{row['task']}/{who} {row['status']}: {row['reason']}")
    notes += _distinct(stopped)
    return notes


def _no_better_notes(rows: Sequence[Row]) -> list[str]:
    """Return one sentence a sensor and task on the answers that are no better than the trivial one."""
    names: dict[str, list[str]] = {}
    for row in rows:
        if _no_better(row):
            names.setdefault(f"{row['sensor']}/{row['task']}", []).append(answer_name(row))
    return [
        f"{where}/{', '.join(dict.fromkeys(who))} {'is' if len(set(who)) == 1 else 'are'} no better than the trivial "
        "baseline: see how the recordings differ before blaming the sensor."
        for where, who in names.items()
    ]


def _interval_notes(rows: Sequence[Row]) -> list[str]:
    """Return one sentence a task and kind of interval; what is in brackets only where it is the same for all."""
    kinds: dict[str, list[str]] = {}
    for row in rows:
        if row["ci_method"] and not row["is_baseline"]:
            told = f"{row['task']}: interval by {row['ci_method']}."
            kinds.setdefault(re.sub(r" \([^)]*\)", "", told), []).append(told)
    return [told[0] if len(set(told)) == 1 else short for short, told in kinds.items()]


def _no_better(row: Row) -> bool:
    if row["status"] != "done" or row["is_baseline"] or row["baseline"] is None:
        return False
    if is_probe(row["protocol"]):
        return False  # no better than trivial is what a probe should be
    lower = row["metric"] in LOWER_IS_BETTER
    return bool(row["ci_high"] >= row["baseline"] if lower else row["ci_low"] <= row["baseline"])


def _who(row: Row) -> str:
    return f"{row['sensor']}/{row['task']}/{answer_name(row)}"


def _assumptions(row: Row) -> str:
    return ", ".join(f"{key} {value}" for key, value in sorted(row["assumptions"].items())) or "see docs/twin.md"


def _distinct(texts: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(texts))
