"""What a block of rows comes to, in a sentence, and how far that may be relied on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from operator import itemgetter
from typing import Any

from tactbench.core.leaderboard.names import METRIC_NAMES, Row, answer_name, grouped, sign_of
from tactbench.core.spec.row import INTERVALS
from tactbench.core.statistics.rank import Rank, beyond_floor
from tactbench.core.statistics.replicates import FEWEST, counted, percent
from tactbench.core.tables.numbers import interval, score, score_with_unit
from tactbench.core.tables.text import visible

PUBLISHED = "Published figures"
"""How the sentence on them begins."""
_CHEAPER = 1.2
"""A cost that is so many times lower is said: less is within what timings of one machine differ by."""
_SPARES = {"answer_delay_ms": "answers {:.3g} times sooner", "fit_s": "fits {:.3g} times quicker"}
"""Costs by which equal scores are told apart, the first that all rows have."""

_WORST = ("ci_high", "ci_low")
"""The worse end of an interval: of an error, and of what is the higher the better."""

comparison_key = itemgetter("sensor", "task", "rig", "protocol", "split")
"""What answers must share to be held against a trivial one."""


def verdict_of(
    ranked: Sequence[tuple[Row, Rank]], below: int, trivial: Sequence[Row] = (), *, times: bool = True
) -> tuple[str, ...]:
    """Return sentences on the answers of one block: who is best, how well that is resolved, what it hangs on.

    The first is one of three verdicts: a clear winner, a tie at the top, not enough to tell. Where intervals allow it,
    then how many neighbouring rows are separable, whether the first place hangs on one replicate and between what
    scores single ones lie; then answers that need no touch, and where published figures lie.

    Parameters
    ----------
    ranked, below, trivial
        Answers that have a place, in order; how many are no better than the trivial one; the trivial ones.
    times
        Whether costs may be named: no seed decides them.
    """
    if not ranked:
        return (_none_better(below, trivial),) if below else ()
    rows = [row for row, _ in ranked]
    names = _names(rows)
    replicates = [row.get("n_replicates") for row in rows]
    if any(n is not None and n < FEWEST for n in replicates) or ranked[0][1].low is None:
        return (_too_few(rows, names), *_without_touch(rows, trivial))
    leaders = [place for place, (_, one) in enumerate(ranked) if not one.behind]
    best = rows[0]
    if _reaches(best, *_WORST, best["baseline"]):
        bar = score_with_unit(best["baseline"], best["unit"])
        sentence = f"Not enough to tell: {names[0]} leads, and its interval holds the trivial answer's {bar}."
    elif len(rows) == 1:
        sentence = f"{names[0]}: {_measured(best)}, the only answer better than {_bar(best, trivial)}."
    elif len(leaders) == 1:
        sentence = f"{names[0]} is best: {_measured(best)}."
    else:
        others = ", ".join(names[place] for place in leaders[1:])
        by = "the smallest error beyond the floor" if beyond_floor([best]) else "the best score"
        sentence = f"Tie at the top: {names[0]} has {by}, and {others} cannot be told from it."
        if times:
            sentence += _cheapest([rows[place] for place in leaders], [names[place] for place in leaders])
    how = [_resolution(ranked, len(leaders), names)] if len(rows) > 1 else []
    return (
        sentence,
        " ".join([*how, _single(rows, names)]).strip(),
        *_without_touch(rows, trivial),
        *_published([*rows, *trivial], [*names, *_names(trivial, rows)]),
    )


def _single(rows: Sequence[Row], names: Sequence[str]) -> str:
    """Return between what scores single replicates of each sensor's best answer lie."""
    best: dict[str, str] = {}
    for row, name in zip(rows, names, strict=True):
        if row.get("replicate_unit") == "replicate" and row.get("score_min") is not None:
            best.setdefault(row["sensor"], f"{name} {interval(row['score_min'], row['score_max'], row['unit'])}")
    return f"Single replicates: {', '.join(best.values())}." if best else ""


def _published(rows: Sequence[Row], names: Sequence[str]) -> list[str]:
    """Return where published figures lie beside the intervals of ours."""
    figures = []
    for row, name in zip(rows, names, strict=True):
        if row.get("published") is None or row["ci_low"] is None:
            continue
        inside = row["ci_low"] <= row["published"] <= row["ci_high"]
        where = "inside" if inside else "below" if row["published"] < row["ci_low"] else "above"
        ends = interval(row["ci_low"], row["ci_high"], row["unit"])
        figures.append(f"{name} {score(row['published'], row['unit'])} lies {where} our {ends}")
    if not figures:
        return []
    tests = " This tests the simulation, not the sensor." if rows[0]["simulated"] else ""
    return [f"{PUBLISHED}: {'; '.join(figures)}.{tests}"]


def _without_touch(rows: Sequence[Row], trivial: Sequence[Row]) -> list[str]:
    """Return a sentence where an answer that reads no sensor scores within the interval of the best one that does."""
    best, sign = rows[0], sign_of(rows[0])
    end = best[_WORST[0] if sign > 0 else _WORST[1]]
    bar = best["score"] if end is None else end
    found = [row for row in trivial if row.get("looks_at") == "time" and sign * (row["score"] - bar) <= 0]
    if not found or best.get("looks_at") == "time":
        return []
    one = min(found, key=lambda row: sign * row["score"])
    return [
        f"{answer_name(one)} reads no sensor, only the time since the press began, and scores "
        f"{score_with_unit(one['score'], one['unit'])}: every recording is pressed alike, so these scores need no "
        "touch."
    ]


def _too_few(rows: Sequence[Row], names: Sequence[str]) -> str:
    """Return what can be said of fewer replicates than an interval needs."""
    n = min(row.get("n_replicates") or 0 for row in rows)
    if not n:
        return f"Not enough to tell: these rows keep no replicates. {names[0]} has the best score."
    unit = str(rows[0].get("replicate_unit") or "replicate")
    have = f"one {unit}" if n == 1 else counted(n, unit)
    more = " Give --repeats 8." if rows[0]["simulated"] and rows[0]["repeats"] < FEWEST else ""
    return f"Not enough to tell: {have}, and an interval or a rank needs {FEWEST}. {names[0]} has the best score.{more}"


def _names(rows: Sequence[Row], like: Sequence[Row] = ()) -> list[str]:
    """Return what tells rows apart: the estimator, with the sensor before it where there are several."""
    several = len({row["sensor"] for row in like or rows}) > 1
    return [f"{row['sensor']}/{answer_name(row)}" if several else answer_name(row) for row in rows]


def _measured(row: Row) -> str:
    floor = beyond_floor([row])
    value, low, high = INTERVALS[floor]
    text = f"{METRIC_NAMES.get(row['metric'], visible(str(row['metric'])))} {score_with_unit(row[value], row['unit'])}"
    text += " beyond the floor" if floor else ""
    if row.get(low) is None:
        return text
    n, unit = row.get("n_replicates"), row.get("replicate_unit")
    over = counted(n, str(unit)) if n else "replicates"
    return f"{text} ({percent(n, unit)} over {over}: {interval(row[low], row.get(high), row['unit'])})"


def best_trivials(rows: Iterable[Row]) -> dict[tuple[Any, ...], Row]:
    """Return the best of all finished trivial answers by their `comparison_key`; an oracle is none."""
    finished = (row for row in rows if row["is_baseline"] and row["status"] == "done")
    groups = grouped((row for row in finished if row.get("looks_at") != "reference"), comparison_key)
    return {key: min(alike, key=lambda row: sign_of(row) * row["score"]) for key, alike in groups.items()}


def against_trivial(row: Row, trivial: float) -> str:
    """Return what is shown of a row beside the score of a trivial answer.

    Returns
    -------
    str
        ``no better`` where its whole interval lies at or beyond that score; ``not shown to be better`` where its
        interval, or without one its score, reaches it; else nothing.
    """
    if _reaches(row, *_WORST[::-1], trivial):
        return "no better"
    reached = _reaches(row, *_WORST, trivial) or _reaches(row, "score", "score", trivial)
    return "not shown to be better" if reached else ""


def _reaches(row: Row, of_errors: str, of_shares: str, trivial: float | None) -> bool:
    """Return whether a figure of the row is as bad as `trivial`, or worse."""
    sign = sign_of(row)
    figure = row[of_errors if sign > 0 else of_shares]
    return figure is not None and trivial is not None and sign * figure >= sign * trivial


def _bar(row: Row, trivial: Sequence[Row]) -> str:
    """Return what the trivial answer is called that the baseline of a row is of."""
    alike = (one for one in trivial if comparison_key(one) == comparison_key(row) and one["score"] == row["baseline"])
    return f"the trivial {next(map(answer_name, alike), 'one')}"


def _none_better(below: int, trivial: Sequence[Row]) -> str:
    """Return that no answer scores better than the trivial ones that look at as much."""
    rows = list(best_trivials(row for row in trivial if row.get("looks_at") != "time").values())
    bars = [
        f"{name} {score_with_unit(row['score'], row['unit'])}" for name, row in zip(_names(rows), rows, strict=True)
    ]
    listed = f": {', '.join(bars)}" if bars else ""
    return f"None of {below} answers scores better than the trivial one{listed}."


def _cheapest(rows: Sequence[Row], names: Sequence[str]) -> str:
    """Return which of equal answers costs least, and how much less than the best score's."""
    for key, words in _SPARES.items():
        costs = [(row.get(key) or math.nan, name) for row, name in zip(rows, names, strict=True)]
        if all(0 < cost < math.inf for cost, _ in costs):
            (least, quickest), (most, slowest) = min(costs, key=itemgetter(0)), max(costs, key=itemgetter(0))
            if most / least >= _CHEAPER:
                return f" Of these {quickest} {words.format(most / least)} than {slowest}."
    return ""


def _resolution(ranked: Sequence[tuple[Row, Rank]], leaders: int, names: Sequence[str]) -> str:
    """Return how many neighbours can be told apart, and whether the first place hangs on one replicate."""
    apart = sum(one.apart for _, one in ranked)
    behind = len(ranked) - leaders
    sentence = (
        f"{apart} of {len(ranked) - 1} neighbouring rows separable; {leaders - 1} tied with the first, {behind} behind."
    )
    ways = sum(one.first_without for _, one in ranked)
    if not ways:
        return sentence
    others = {names[place]: one.first_without for place, (_, one) in enumerate(ranked) if place and one.first_without}
    if not others:
        return f"{sentence} Without any one {ranked[0][0].get('replicate_unit') or 'replicate'} the first stays first."
    ways_of = f"{sum(others.values())} of {ways} ways"
    return f"{sentence} Without one of them ({ways_of}) the first would be {', '.join(others)}."
