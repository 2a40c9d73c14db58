"""What recordings give away: a score beside that of shuffled rows, of the first frame alone and of a trivial answer."""

from __future__ import annotations

import importlib
import json
from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.evaluation.protocols import DEPLOYABLE, FIRST_FRAME
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, answer_name, sensor_name
from tactbench.core.leaderboard.verdict import against_trivial, best_trivials, comparison_key
from tactbench.core.tables.numbers import interval, score, suffix
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable

Row = Mapping[str, Any]

LEAK_SHARE = 0.5
"""Share of the skill (score beyond the trivial answer's) from which on the first frame's is called a leak: what came
before the contact then explains as much as all that the contact adds."""
TAIL = 0.025
"""Probability that guessing does as well, below which the first frame is said to tell something: the tail of the
leaderboard's 95 % intervals."""
FEWEST = 5
"""Recordings from which on an error of first frames has an interval."""
COLUMNS = (
    "sensor", "task", "estimator", "split", "score", "95 % interval", "shuffled", "first frame alone",
    "trivial", "verdict",
)  # fmt: skip
NUMERIC = frozenset({"score", "95 % interval", "shuffled", "first frame alone", "trivial"})


def build_probe(rows: Sequence[Row]) -> TextTable | None:
    """Put each finished answer under `deployable` beside its probes; None if nothing was probed."""
    probes = _Probes(rows)
    if not probes:
        return None
    best = best_trivials(rows)
    lines: list[tuple[str, ...]] = []
    skipped: list[str] = []
    for row in rows:
        if row["is_baseline"] or row["status"] != "done" or row["protocol"] != DEPLOYABLE.name:
            continue
        if row["split"] in ("shuffled", "in-session"):
            continue  # neither keeps recordings or groups apart: there is nothing to compare with
        first = probes.of(row, FIRST_FRAME.name, row["split"])
        shuffled = probes.of(row, DEPLOYABLE.name, "shuffled")
        if first is None and shuffled is None:
            continue
        lines.append(tuple(map(visible, _line(row, shuffled, first, best.get(comparison_key(row))))))
        if first is not None and first["status"] == "skipped":
            skipped.append(visible(f"{row['sensor']}/{row['task']}: {first['reason']}"))
    if not lines:
        return None
    used = [place for place in range(len(COLUMNS)) if any(line[place] for line in lines)]
    return TextTable(
        title="Probe · does the score come from the contact?",
        columns=tuple(COLUMNS[place] for place in used),
        numeric=NUMERIC,
        lines=tuple(tuple(line[place] for place in used) for line in lines),
        notes=(
            f"LEAK: the first frame alone has {LEAK_SHARE:.0%} or more of the skill (score beyond the trivial answer). "
            "Optimistic: shuffled rows score beyond the interval of the split. TRIVIAL: an answer that reads no sensor "
            "scores as well. See docs/real-recordings.md.",
            *dict.fromkeys(skipped),
        ),
        kinds=tuple("alarm" if line[-1].startswith(("LEAK", "TRIVIAL")) else "plain" for line in lines),
    )


class _Probes:
    """The rows that are probes, found by the answer they probe."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self._rows: dict[tuple[Any, ...], list[Row]] = {}
        for row in rows:
            if row["protocol"] == FIRST_FRAME.name or row["split"] in ("shuffled", None):
                self._rows.setdefault(self._key(row, row["protocol"]), []).append(row)

    def __bool__(self) -> bool:
        return bool(self._rows)

    def of(self, row: Row, protocol: str, split: str) -> Row | None:
        """Return the same answer under a protocol and split. A cell that was never begun may not know its split."""
        for other in self._rows.get(self._key(row, protocol), ()):
            if other["split"] == split or (other["split"] is None and other["status"] != "done"):
                return other
        return None

    @staticmethod
    def _key(row: Row, protocol: str) -> tuple[Any, ...]:
        same = (row[key] for key in ("sensor", "task", "rig", "estimator"))
        return (protocol, *same, json.dumps(row["params"], sort_keys=True))


def _line(row: Row, shuffled: Row | None, first: Row | None, trivial: Row | None) -> tuple[str, ...]:
    unit = row["unit"]
    found = [*_about_trivial(row, trivial), *_about_first(row, first), *_about_shuffled(row, shuffled)]
    return (
        sensor_name(row),
        row["task"],
        answer_name(row),
        row["split"],
        score(row["score"], unit),
        interval(row["ci_low"], row["ci_high"], unit),
        _shown(shuffled),
        _shown(first),
        score(row["baseline"], unit) if trivial is None else f"{score(trivial['score'], unit)} {answer_name(trivial)}",
        "; ".join(found) or "no leak shown",
    )


def _about_trivial(row: Row, trivial: Row | None) -> list[str]:
    """Return that the best trivial answer scores as well, or that the interval does not exclude it."""
    if trivial is None:
        return []
    values = f"{score(trivial['score'], row['unit'])} of {score(row['score'], row['unit'])}{suffix(row['unit'])}"
    if _skill(trivial["score"], row["score"], row) >= 0:
        return [f"TRIVIAL: {answer_name(trivial)} scores {values}"]
    shown = against_trivial(row, trivial["score"])
    return [f"not shown to be better than {answer_name(trivial)}: {values}"] if shown else []


def _shown(row: Row | None) -> str:
    if row is None:
        return "–"
    return score(row["score"], row["unit"]) if row["status"] == "done" else str(row["status"])


def _about_first(row: Row, first: Row | None) -> list[str]:
    """Return what the first frame says of the score, or nothing."""
    trivial = row["baseline"]
    if first is None or first["status"] != "done" or trivial is None:
        return []
    beyond = _beyond_guessing(first, trivial)
    if beyond is None:
        return ["too few recordings or replicates to say what the first frame tells"]
    if not beyond:
        return []
    unit = row["unit"]
    sentence = (
        f"the first frame alone scores {score(first['score'], unit)} of {score(row['score'], unit)}{suffix(unit)}"
    )
    leak = _skill(first["score"], trivial, row) >= LEAK_SHARE * _skill(row["score"], trivial, row)
    return [f"LEAK: {sentence}" if leak else f"{sentence}: a part of the answer is known before"]


def _beyond_guessing(first: Row, trivial: float) -> bool | None:
    """Tell whether the first frame answers better than a guess; None if too few recordings or replicates can tell.

    Classes: the exact binomial tail of so many right answers, each recording being one answer and the commonest class
    the guess. Numbers: the interval lies beyond the trivial score.
    """
    if first["confusion"] is not None:
        table = first["confusion"]
        n, right = sum(map(sum, table)), sum(table[place][place] for place in range(len(table)))
        guess = max(map(sum, table), default=0) / max(n, 1)
        if guess == 1.0 or right == 0:
            return False
        return float(importlib.import_module("scipy.special").bdtrc(right - 1, n, guess)) <= TAIL
    worst = first["ci_high"] if _lower_is_better(first) else first["ci_low"]
    if first["n_test"] < FEWEST or worst is None:
        return None
    return _skill(worst, trivial, first) > 0


def _about_shuffled(row: Row, shuffled: Row | None) -> list[str]:
    """Return by how much shuffled rows flatter the score, if by more than its interval."""
    if shuffled is None or shuffled["status"] != "done":
        return []
    best = row["ci_low"] if _lower_is_better(row) else row["ci_high"]
    if best is None:
        return ["no interval to hold the shuffled score against"]
    if _skill(shuffled["score"], best, row) <= 0:
        return []
    by = score(abs(shuffled["score"] - row["score"]), row["unit"])
    sentence = f"optimistic by {by}{suffix(row['unit'])} when shuffled"
    same = shuffled["n_test"] == row["n_test"] and set(shuffled["recordings"]) == set(row["recordings"])
    return [sentence if same else f"{sentence} (tested on other rows)"]


def _skill(value: float, trivial: float, row: Row) -> float:
    """Return how much better than `trivial` a score is."""
    return trivial - value if _lower_is_better(row) else value - trivial


def _lower_is_better(row: Row) -> bool:
    return row["metric"] in LOWER_IS_BETTER
