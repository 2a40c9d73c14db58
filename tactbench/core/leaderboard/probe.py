"""Leakage probe: scores compared with scores from shuffled rows, first frames alone and trivial answers."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Sequence
from typing import Any

from tactbench.core.evaluation.protocols import DEPLOYABLE, FIRST_FRAME
from tactbench.core.leaderboard.names import WORSE_END, Row, answer_name, grouped, sensor_name, sign_of
from tactbench.core.spec.row import LEAKS
from tactbench.core.tables.numbers import ABSENT, interval, score, score_with_unit
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import Entry, TextTable

LEAK_SHARE = 0.5
"""Share of the skill (score beyond the trivial answer's) at which the first frame's skill is called a leak."""
TAIL = 0.025
"""Largest probability of guessing as often right as the first frame, for it to be better than a guess."""
FEWEST = 5
"""Smallest number of test recordings for a verdict on a regression from first frames."""
COLUMNS = (
    "sensor", "task", "estimator", "split", "score", "95 % interval", "shuffled", "first frame alone",
    "trivial", "verdict",
)  # fmt: skip
_NOTE = (
    f"LEAK: the first frame alone has {LEAK_SHARE:.0%} or more of the skill (score beyond the trivial answer), or the "
    "row is stamped (‡); PART: less, but more than a guess. OPTIMISTIC: shuffled rows score beyond the interval of the "
    "split. See docs/real-recordings.md."
)


def build_probe(rows: Sequence[Row]) -> TextTable | None:
    """Return the table of finished answers under `deployable` and their leakage probes; None without probes."""
    lines: list[tuple[str, ...]] = []
    skipped: dict[str, None] = {}
    for row, first, shuffled in _probed(rows):
        if first is not None or shuffled is not None:
            interval_of = interval(row["ci_low"], row["ci_high"], row["unit"])
            lines.append((
                sensor_name(row), visible(row["task"]), answer_name(row), visible(row["split"]),
                _shown(row), Entry(interval_of, row["ci_low"], cell=row["cell"]), _shown(shuffled), _shown(first),
                Entry(score(row["baseline"], row["unit"]), row["baseline"]),
                ", ".join(_verdicts(row, shuffled, first)) or "no leak shown",
            ))  # fmt: skip
        if first is not None and first["status"] == "skipped":
            skipped[visible(f"{row['sensor']}/{row['task']}: {first['reason']}")] = None
    if not lines:
        return None
    kinds = tuple("alarm" if "LEAK" in line[-1] else "plain" for line in lines)
    title = "Probe · does the score come from the contact?"
    return TextTable(title, COLUMNS, tuple(lines), frozenset(COLUMNS[4:9]), notes=(_NOTE, *skipped), kinds=kinds)


def with_leaks(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows, stamped as leaking if the first frame explains half of the skill or more."""
    found: dict[str, list[str]] = {}
    for row, first, _ in _probed(rows):
        if first is not None and _of_first_frame(row, first) == "LEAK":
            alone, whole = (score_with_unit(one["score"], one["unit"]) for one in (first, row))
            found[row["cell"]] = [f"{LEAKS}first frame alone {alone} of {whole}."]
    return [{**row, "stamps": [*row["stamps"], *found[row["cell"]]]} if row["cell"] in found else row for row in rows]


def _probed(rows: Sequence[Row]) -> Iterator[tuple[Row, Row | None, Row | None]]:
    """Yield each answer with its probe rows: from first frames and with shuffled rows, None if missing."""

    def answer(row: Row) -> tuple[str, ...]:
        return row["sensor"], row["task"], row["rig"], answer_name(row)

    alike = grouped(rows, answer)
    for row in rows:
        # In-session and shuffled splits keep nothing apart: there is no other score to compare theirs with.
        if row["is_baseline"] or row["status"] != "done" or row["split"] in ("shuffled", "in-session"):
            continue
        if row["protocol"] == DEPLOYABLE.name:
            own = alike[answer(row)]
            yield row, _probe_of(own, FIRST_FRAME.name, row["split"]), _probe_of(own, DEPLOYABLE.name, "shuffled")


def _probe_of(alike: Sequence[Row], protocol: str, split: str) -> Row | None:
    """Return the row under a protocol and split, or None; the row of a cell that was not begun may lack its split."""
    return next((one for one in alike if one["protocol"] == protocol and one["split"] in (split, None)), None)


def _shown(row: Row | None) -> str:
    if row is None:
        return ABSENT
    text = score(row["score"], row["unit"]) if row["status"] == "done" else row["status"]
    return Entry(text, row["score"], cell=row["cell"])


def _verdicts(row: Row, shuffled: Row | None, first: Row | None) -> Iterator[str]:
    leaks = any(str(stamp).startswith(LEAKS) for stamp in row["stamps"])
    if verdict := "LEAK" if leaks else _of_first_frame(row, first):
        yield verdict
    if shuffled is not None and shuffled["status"] == "done":
        sign = sign_of(row)
        best = row[WORSE_END[-sign]]
        if best is None:
            yield "no interval for shuffled rows"
        elif sign * (best - shuffled["score"]) > 0:
            yield "OPTIMISTIC"


def _of_first_frame(row: Row, first: Row | None) -> str:
    """Return the verdict on the skill that the first frame explains: LEAK, PART, too few recordings, or empty."""
    sign, trivial = sign_of(row), row["baseline"]
    if first is None or first["status"] != "done" or trivial is None:
        return ""
    beyond = _beyond_guessing(first, trivial)
    if beyond is None:
        return "too few recordings for the first frame"
    most = sign * (trivial - first["score"]) >= LEAK_SHARE * sign * (trivial - row["score"])
    return "" if not beyond else "LEAK" if most else "PART"


def _beyond_guessing(first: Row, trivial: float) -> bool | None:
    """Return True if the first frame answers better than a guess; None if there are too few recordings.

    Classes: by the exact binomial tail of the number of right answers, one for each recording; a guess is the
    most frequent class. Numbers: if the interval is better than the trivial score.
    """
    if first["confusion"] is not None:
        table = first["confusion"]
        n, right = sum(map(sum, table)), sum(table[place][place] for place in range(len(table)))
        guess = max(map(sum, table), default=0) / max(n, 1)
        if guess == 1.0 or right == 0:
            return False
        return float(importlib.import_module("scipy.special").bdtrc(right - 1, n, guess)) <= TAIL
    sign = sign_of(first)
    worst = first[WORSE_END[sign]]
    if first["n_test"] < FEWEST or first["ci_low"] is None:
        return None
    return worst is not None and sign * (trivial - worst) > 0
