"""Pairwise comparisons as text and as records: one table a question, the same digits in every format."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.names import hardware_name, metric_name
from tactbench.core.leaderboard.pairwise import PairwiseComparison
from tactbench.core.statistics.aggregate import Aggregate, aggregate
from tactbench.core.tables.numbers import interval, score, suffix
from tactbench.core.tables.text_table import TextTable

NUMERIC = frozenset({"A", "B", "A − B", "95 % interval", "p", "p folds", "p Holm", "effect", "P(A better)", "n"})
COLUMNS = (
    "of", "A", "B", "A − B", "95 % interval", "p", "p folds", "p Holm", "effect", "P(A better)", "n", "verdict",
)  # fmt: skip


def tables_of(comparisons: Sequence[PairwiseComparison]) -> list[TextTable]:
    """Return a table for each question: task, metric, protocol, split and hardware."""
    groups: dict[str, list[PairwiseComparison]] = {}
    for pair in comparisons:
        groups.setdefault(_title(pair), []).append(pair)
    return [
        TextTable(title, COLUMNS, tuple(_line(pair) for pair in members), NUMERIC) for title, members in groups.items()
    ]


def _title(pair: PairwiseComparison) -> str:
    row = pair.row
    parts = [
        f"A = {pair.first}, B = {pair.second}",
        row["task"],
        metric_name(row),
    ]
    parts.append(row["protocol"] + (" †" if row["dagger"] else ""))
    if row["split"]:
        parts.append(f"split {row['split']}")
    parts.append(hardware_name(row))
    return " · ".join(parts)


def _line(pair: PairwiseComparison) -> tuple[str, ...]:
    unit = pair.row["unit"]
    scores = [score(row["score"], unit) if row and row["score"] is not None else "–"
              for row in (pair.first_row, pair.second_row)]  # fmt: skip
    found = pair.difference
    if found is None:
        return (pair.of, *scores, *("–" for _ in COLUMNS[4:]), f"not compared: {pair.refused}")
    return (
        pair.of,
        *scores,
        signed(found.value, unit),
        "–" if found.low is None or found.high is None else f"{signed(found.low, unit)} … {signed(found.high, unit)}",
        probability(found.p),
        probability(pair.folds.p) if pair.folds else "–",
        probability(pair.p_corrected) if pair.declared else "exploratory",
        "–" if found.effect is None else signed(found.effect, "1"),
        "–" if found.improved is None else f"{found.improved:.2f}",
        f"{found.replicates}" + ("" if found.paired else " unpaired"),
        verdict(pair),
    )


def verdict(pair: PairwiseComparison) -> str:
    """Return who is better, or that it cannot be told."""
    found = pair.difference
    if found is None:
        return "not compared"
    if found.verdict in ("equivalent", "undecided"):
        return found.verdict
    winner = pair.first if found.verdict == "better" else pair.second
    region = pair.row.get("equivalence")
    beyond = f" by more than {region:g}{suffix(pair.row['unit'])}" if region and found.beyond else ""
    return f"{winner} better{beyond}"


def signed(value: float, unit: str) -> str:
    """Return a difference in the digits of its scores, with its sign."""
    return ("+" if value >= 0 else "−") + score(abs(value), unit)


def probability(p: float | None) -> str:
    """Return a p-value, two digits."""
    if p is None:
        return "–"
    return "< 0.001" if p < 0.001 else f"{p:.2g}"


def notes_of(comparisons: Sequence[PairwiseComparison]) -> list[str]:
    """Return what must be known to read the tables."""
    found = [pair for pair in comparisons if pair.difference is not None]
    notes = [
        "A − B is in the metric's unit; p is of no difference at all, by exchanging A and B within replicates; effect "
        "is the difference over the standard deviation of the replicates' differences; n counts replicates."
    ] if found else []  # fmt: skip
    for pair in found:
        assert pair.difference is not None, "these were compared"
        notes.append(f"{pair.row['task']}: {pair.difference.method}.")
        region = pair.row.get("equivalence")
        notes.append(
            f"{pair.row['task']}: scores within {region:g}{suffix(pair.row['unit'])} are practically the same."
            if region
            else f"{pair.row['task']} declares no region of practical equivalence."
        )
        least = pair.difference.smallest_p
        if least and least > 0.01:
            notes.append(f"{pair.difference.replicates} replicates cannot give a p below {least:.2g}.")
        if pair.folds:
            notes.append(
                f"p folds: {pair.folds.method}; training data of folds overlap, so p over replicates is too small "
                "for a claim about estimators trained anew."
            )
    if found and all(pair.declared for pair in found):
        notes.append("p Holm is corrected for all declared comparisons of these results.")
    elif any(pair.declared for pair in found):
        notes.append("p Holm is corrected for all declared comparisons; the others are exploratory.")
    elif found:
        notes.append("None of these was declared in the matrix: exploratory, p is not corrected for being one of many.")
    if any(pair.row["simulated"] for pair in found):
        notes.append("SIM, EMULATED: simulated by the twin; says nothing of hardware.")
    return list(dict.fromkeys([*notes, *_averages(found)]))


def _averages(found: Sequence[PairwiseComparison]) -> list[str]:
    """Return the interquartile mean over tasks of either, where two tasks or more were compared under one protocol."""
    groups: dict[tuple[Any, ...], list[PairwiseComparison]] = {}
    for pair in found:
        row = pair.row
        groups.setdefault((hardware_name(row), row["protocol"]), []).append(pair)
    notes = []
    for (_, protocol), members in groups.items():
        pairs = [(pair.first_row, pair.second_row) for pair in members]
        sides = [aggregate([row for row in side if row is not None]) for side in zip(*pairs, strict=True)]
        if len({pair.row["task"] for pair in members}) < 2 or sides[0] is None or sides[1] is None:
            continue
        averages = f"{members[0].first} {_average(sides[0])}, {members[0].second} {_average(sides[1])}"
        notes.append(
            f"Interquartile mean over {sides[0].tasks} tasks under {protocol} ({sides[0].entries} scores; 0 is the "
            f"trivial baseline, 1 the reference): {averages}."
            + "".join(f" Left out: {one}." for one in dict.fromkeys(sides[0].left_out + sides[1].left_out))
        )
    return notes


def _average(side: Aggregate) -> str:
    return f"{side.value:.3f} ({interval(side.low, side.high, '1')})"


def record_of(pair: PairwiseComparison) -> dict[str, Any]:
    """Return a pair as one flat record; all have the same keys."""
    row, found, folds = pair.row, pair.difference, pair.folds
    each: Mapping[str, Any] = {} if found is None else vars(found)
    return {
        "compared": pair.kind, "a": pair.first, "b": pair.second, "of": pair.of, "task": row["task"],
        "rig": row["rig"], "simulated": row["simulated"], "protocol": row["protocol"], "split": row["split"],
        "repeat": row["repeat"], "metric": row["metric"], "unit": row["unit"],
        "score_a": pair.first_row["score"] if pair.first_row else None,
        "score_b": pair.second_row["score"] if pair.second_row else None,
        "difference": each.get("value"), "low": each.get("low"), "high": each.get("high"), "p": each.get("p"),
        "smallest_p": each.get("smallest_p"), "p_folds": folds.p if folds else None,
        "folds_low": folds.low if folds else None, "folds_high": folds.high if folds else None,
        "declared": pair.declared, "p_holm": pair.p_corrected, "effect": each.get("effect"),
        "improved": each.get("improved"), "equivalence": row.get("equivalence"), "verdict": each.get("verdict"),
        "beyond": each.get("beyond"), "paired": each.get("paired"), "replicates": each.get("replicates"),
        "replicate_unit": each.get("unit"), "method": each.get("method"), "refused": pair.refused,
    }  # fmt: skip
