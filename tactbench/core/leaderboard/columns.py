"""The columns of a leaderboard, and a row as the texts that stand in them.

Every time is marked with whose clock it was taken by, and beside how many other cells: what keeps times apart that are
not comparable.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count, product
from string import ascii_uppercase
from typing import Literal, NamedTuple

from tactbench.core.leaderboard.levels import KEY as LEVEL
from tactbench.core.leaderboard.names import Row, answer_name, distinct, sensor_name
from tactbench.core.spec.status import STOPPED
from tactbench.core.statistics.rank import Rank
from tactbench.core.tables.numbers import ABSENT, delay, duration, interval, score, tail, whole
from tactbench.core.tables.text import visible

Value = Callable[[Row], float | None]
Text = Callable[[Row], str]
Kind = Literal["result", "baseline", "failed", "skipped"]
"""Of a line: an answer, a trivial one, a cell that did not end well or was not begun."""


class Column(NamedTuple):
    """A column of numbers that a row has by itself."""

    shown: str
    """What it is called where programs read its text: ``shown`` in JSON, ``shown_…`` in CSV and Parquet."""
    text: Text
    value: Value
    """What it is sorted by: times in seconds, intervals by their middle."""
    timed: bool = False
    """Whether no seed decides it: it belongs to the host that was timed."""
    if_known: str = ""
    """A table has the column only where a row has this key; empty: always."""


def _score(shown: str, key: str, if_known: str = "") -> Column:
    return Column(shown, lambda row: score(row.get(key), row["unit"]), lambda row: row.get(key), if_known=if_known)


def _count(shown: str, key: str) -> Column:
    return Column(shown, lambda row: whole(row[key]), lambda row: row[key])


def _duration(shown: str, value: Value) -> Column:
    return Column(shown, lambda row: duration(value(row)), value, timed=True)


def _middle(low: str, high: str) -> Value:
    return lambda row: None if row.get(low) is None or row.get(high) is None else (row[low] + row[high]) / 2


def _seconds(key: str) -> Value:
    return lambda row: None if row.get(key) is None else row[key] / 1e3


def _tail(row: Row) -> float | None:
    """Return the 95th percentile of latencies; of fewer calls than it needs, the largest."""
    return _seconds("latency_ms_max" if row.get("latency_ms_p95") is None else "latency_ms_p95")(row)


def _per_row(row: Row) -> float | None:
    spent, count = row["predict_s"], row["batch_rows"]
    return spent / count if spent is not None and count else None


def row_interval(row: Row) -> str:
    """Return a row's interval; where too few replicates carry one, the range of their scores, named so."""
    text = interval(row["ci_low"], row["ci_high"], row["unit"])
    count = row.get("n_replicates")
    if text != ABSENT or not count:
        return text
    spread = interval(row.get("score_min"), row.get("score_max"), row["unit"])
    return "one replicate" if count == 1 else spread if spread == ABSENT else f"range {spread}"


def _right(row: Row) -> str:
    """Return how many recordings were classified rightly, the mean over replicates: ``3.1 of 5``."""
    right, total = row.get("recordings_right"), row.get("recordings_asked")
    return ABSENT if right is None or total is None else f"{right:.3g} of {total:.3g}"


def _p95(row: Row) -> str:
    return tail(row.get("latency_ms_p95"), row.get("latency_ms_max"), row.get("latency_n"))


def _beyond(row: Row) -> str:
    return interval(row.get(_ENDS[0]), row.get(_ENDS[1]), row["unit"])


_BEYOND = "score_beyond_floor"
_ENDS = ("beyond_floor_ci_low", "beyond_floor_ci_high")
_ALL: dict[str, Column | str] = {
    "#": "rank",
    "sensor": "sensor",
    "level": Column("level", lambda row: visible(str(row.get(LEVEL) or ABSENT)), lambda row: None, if_known=LEVEL),
    "estimator": "estimator",
    "score": _score("score", "score"),
    "95 % interval": Column("interval", row_interval, _middle("ci_low", "ci_high")),
    "beyond floor": _score("beyond_floor", _BEYOND, _BEYOND),
    "95 % beyond": Column("beyond_floor_interval", _beyond, _middle(*_ENDS), if_known=_BEYOND),
    "true error": _score("true_error", "true_score", "true_score"),
    "rank 95 %": "rank_interval",
    "recordings right": Column(
        "recordings_right", _right, lambda row: row.get("recordings_right"), if_known="recordings_right",
    ),
    "published": _score("published", "published"),
    "baseline": _score("baseline", "baseline"),
    "n test": _count("n_test", "n_test"),
    "sessions": _count("sessions", "n_sessions"),
    "sim": _duration("sim", lambda row: row["sim_s"]),
    "delay": Column(
        "answer_delay", lambda row: delay(row.get("answer_delay_ms"), row.get("delay_parts_ms")),
        _seconds("answer_delay_ms"), timed=True,
    ),
    "fit": _duration("fit", lambda row: row["fit_s"]),
    "latency p50": _duration("latency_p50", _seconds("latency_ms_p50")),
    "p95": Column("latency_p95", _p95, _tail, timed=True),
    "batch/row": _duration("batch_row", _per_row),
}  # fmt: skip
"""All columns in order; of those that are names, or that the block of a row decides, only what programs call them."""

OF_ROWS = {name: one for name, one in _ALL.items() if isinstance(one, Column)}
SHOWN = {name: one.shown if isinstance(one, Column) else one for name, one in _ALL.items()}
COLUMNS = tuple(_ALL)
NUMERIC = frozenset(COLUMNS) - {"sensor", "level", "estimator"}
INTERVALS = ("95 % interval", "95 % beyond")
IF_KNOWN = {name: column.if_known for name, column in OF_ROWS.items() if column.if_known}
"""Columns of levels of checked sensors, of errors of force, whose reference errs too, and of classifications with
recordings of one class each."""


def columns(rows: Sequence[Row], *, times: bool) -> tuple[str, ...]:
    """Return the columns of a table of `rows` with times, or of one without."""
    lacking = {name for name, key in IF_KNOWN.items() if all(row.get(key) is None for row in rows)}
    timed = {"level"} | {name for name, column in OF_ROWS.items() if column.timed}
    return tuple(name for name in COLUMNS if name not in lacking and (times or name not in timed))


@dataclass(frozen=True)
class Line:
    """One row as text."""

    row: Row = field(repr=False, compare=False)
    """Numbers in full."""
    texts: Mapping[str, str]
    """By column."""
    kind: Kind
    placing: Rank | None = None
    """Where it stands in its block; results better than the trivial answer only."""

    @property
    def cells(self) -> tuple[str, ...]:
        """Its texts, one a column."""
        return tuple(self.texts.values())

    def value(self, column: str) -> float | None:
        """Return what a line is sorted by in a column of numbers; None: last."""
        if column not in NUMERIC or self.kind in ("failed", "skipped"):
            return None  # a stopped cell may know a number that the table does not show
        if column in OF_ROWS:
            return OF_ROWS[column].value(self.row)
        one = self.placing
        if one is None or column == "#":
            return None if one is None else one.place
        return (one.low + one.high) / 2 if one.low and one.high else None


def line_of(row: Row, placing: Rank | None, columns: Sequence[str], letters: Mapping[str, str]) -> Line:
    """Return the line of a row; one without a place is a baseline, or did not end well. Hosts have `letters`."""
    texts = {"sensor": sensor_name(row), "estimator": answer_name(row)}
    if row["status"] != "done":
        texts |= {"#": "", "score": row["status"].upper()}
        kind: Kind = "failed" if row["status"] in STOPPED else "skipped"
        return Line(row, {name: texts.get(name, ABSENT) for name in columns}, kind)
    texts |= {"#": _place(placing, row), "rank 95 %": _range(placing)}
    mark = timing_mark(row, letters)
    for name in columns:
        if name in OF_ROWS:
            text = OF_ROWS[name].text(row)
            texts[name] = text + mark if OF_ROWS[name].timed and text != ABSENT else text
    texts["score"] += (" †" if row["dagger"] else "") + (" ‡" if row["stamps"] else "")
    kind = "baseline" if row["is_baseline"] else "result"
    return Line(row, {name: texts[name] for name in columns}, kind, placing)


def _place(one: Rank | None, row: Row) -> str:
    """Return the place; an answer that is no better than the trivial one has none, nor has an oracle."""
    if one is None and row["is_baseline"]:
        return "oracle" if row.get("looks_at") == "reference" else "base"
    if one is None:
        return ABSENT
    return f"{one.place}=" if one.tied else str(one.place)


def _range(one: Rank | None) -> str:
    if one is None or one.low is None or one.high is None:
        return ABSENT
    return str(one.low) if one.low == one.high else f"{one.low}–{one.high}"


def host_letters(rows: Iterable[Row]) -> dict[str, str]:
    """Return a letter for each host that timed one of the rows, in order of their ids; none if there is but one."""
    hosts = sorted({host for host, _ in _clocks(rows)})
    letters = ("".join(letters) for length in count(1) for letters in product(ascii_uppercase, repeat=length))
    return dict(zip(hosts, letters, strict=False)) if len(hosts) > 1 else {}


def timing_mark(row: Row, letters: Mapping[str, str]) -> str:
    """Return what stands behind every time of a row: ``[A]`` for the host, ``‖4`` for four cells at once."""
    letter, at_once = letters.get(_host(row)), _at_once(row)
    return (f" [{letter}]" if letter else "") + (f" ‖{at_once}" if at_once > 1 else "")


def timing_notes(rows: Iterable[Row], letters: Mapping[str, str], provenance: Iterable[Row]) -> list[str]:
    """Return what the marks of times mean; `provenance` tells of the runs, among it `host`, `cpu` and `cores`."""
    machines = {str(one.get("host", "")): one for one in provenance}
    notes = [f"[{letter}] timed on {_machine(host, machines.get(host))}." for host, letter in letters.items()]
    if letters:
        notes.append("Times marked with different letters are of different hosts: compare none of them. Scores do not "
                     "depend on the host and are ranked together.")  # fmt: skip
    hosts = distinct((at_once, host) for host, at_once in _clocks(rows))
    for at_once in sorted(hosts.keys() - {1}):
        cores = {host: machines.get(host, {}).get("cores") for host in hosts[at_once]}
        crowded = sorted(visible(host) for host, n in cores.items() if type(n) is int and at_once > n)
        more = f", more than the cores of host {' and of host '.join(crowded)}" if crowded else ""
        notes.append(f"‖{at_once}: timed while {at_once} cells ran at once{more}: not comparable with times measured "
                     "alone.")  # fmt: skip
    return notes


def _clocks(rows: Iterable[Row]) -> set[tuple[str, int]]:
    """Return by which hosts rows were timed, and while how many cells ran at once."""
    times = ("fit_s", "sim_s", "predict_s", "latency_ms_p50", "latency_ms_p95")
    return {
        (_host(row), _at_once(row))
        for row in rows
        if row["status"] == "done" and any(row[time] is not None for time in times)
    }


def _host(row: Row) -> str:
    return str(row.get("host") or "")


def _at_once(row: Row) -> int:
    return int(row.get("concurrency") or 1)


def _machine(host: str, machine: Row | None) -> str:
    name = f"host {visible(host)}" if host else "a host that its rows do not name"
    if not machine:
        return f"{name}, of which nothing else is known"
    return f"{name}: {visible(str(machine.get('cpu') or 'unknown CPU'))}, {visible(str(machine.get('cores')))} cores"
