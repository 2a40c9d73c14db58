"""A row as the texts that stand in a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from tactbench.core.leaderboard.columns import columns
from tactbench.core.leaderboard.marks import score_marks
from tactbench.core.leaderboard.names import answer_name, sensor_name
from tactbench.core.leaderboard.numbers import duration, interval, score, whole
from tactbench.core.leaderboard.placing import Placing
from tactbench.core.spec.status import STOPPED

Row = Mapping[str, Any]
Kind = Literal["result", "baseline", "failed", "skipped"]

ABSENT = "–"


@dataclass(frozen=True)
class Line:
    """One row as text, one string a column."""

    cells: tuple[str, ...]
    kind: Kind
    cell: str = ""
    """Name of the cell."""
    placing: Placing | None = None
    """Where it stands in its block; results only."""
    row: Row = field(default_factory=dict, repr=False, compare=False)
    """The row itself: numbers in full."""


def done_line(row: Row, placing: Placing | None, mark: str, times: bool) -> Line:
    """Return the line of a finished cell.

    Parameters
    ----------
    placing
        None: a baseline.
    mark
        What stands behind every time.
    times
        Whether the table has times.
    """
    unit = row["unit"]
    texts: tuple[str, ...] = (
        _place(placing),
        sensor_name(row),
        answer_name(row),
        score(row["score"], unit) + score_marks(row),
        interval(row["ci_low"], row["ci_high"], unit),
        _places(placing),
        score(row["published"], unit),
        score(row["baseline"], unit),
        whole(row["n_test"]),
        whole(row["n_sessions"]),
    )
    if times:
        spent, count = row["predict_s"], row["batch_rows"]
        p50, p95 = row["latency_ms_p50"], row["latency_ms_p95"]
        texts += (
            _time(row["sim_s"], mark),
            _time(row["fit_s"], mark),
            _time(None if p50 is None else p50 / 1e3, mark),
            _time(None if p95 is None else p95 / 1e3, mark),
            _time(spent / count if spent is not None and count else None, mark),
        )
    return Line(texts, "baseline" if placing is None else "result", row["cell"], placing, row)


def stopped_line(row: Row, times: bool) -> Line:
    """Return the line of a cell that did not end well, or was not begun: its status in place of its score."""
    rest = (ABSENT for _ in columns(times)[4:])
    kind: Kind = "failed" if row["status"] in STOPPED else "skipped"
    return Line(("", sensor_name(row), answer_name(row), row["status"].upper(), *rest), kind, row["cell"], None, row)


def _place(placing: Placing | None) -> str:
    if placing is None:
        return "base"
    return f"{placing.place}=" if placing.tied else str(placing.place)


def _places(placing: Placing | None) -> str:
    if placing is None or placing.low is None or placing.high is None:
        return ABSENT
    return str(placing.low) if placing.low == placing.high else f"{placing.low}–{placing.high}"


def _time(seconds: float | None, mark: str) -> str:
    return ABSENT if seconds is None else duration(seconds) + mark
