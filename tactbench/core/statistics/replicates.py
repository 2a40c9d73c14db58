"""Combine the rows of a cell's replicates (such as repeated campaigns) into one row for the cell."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from math import comb
from operator import itemgetter
from statistics import median, median_low
from typing import Any

from tactbench.core.spec.row import TRUE, Cost, lower_is_better, plural

Row = Mapping[str, Any]
_group = itemgetter("sensor", "task", "rig", "protocol", "split")
_ranked_together = itemgetter("task", "protocol", "split", "simulated")

FEWEST = 5
"""Smallest number of replicates for an interval or a rank: the range of four covers the median in only 87.5 %."""
LEVEL = 0.95
_MEDIANS = (
    "score", "reference_score", "reference_floor", "reference_floor_se", "score_beyond_floor", "true_score",
    "sim_s", "search_s", "fit_s", "predict_s",
    "latency_ms_p50", "latency_ms_p95", "answer_delay_ms", "peak_rss_mb", "wall_s",
)  # fmt: skip
"""Keys of numbers that are replaced by their median over replicates."""
_INTERVALS = {
    "score": "",
    "score_beyond_floor": "beyond_floor_",
    "true_score": "true_",
    "reference_score": "reference_",
}
"""Keys of numbers with an interval, and the prefix of the interval's keys."""


def over_replicates(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return one row for each cell, combined from the rows of its replicates and named without their seeds.

    Parameters
    ----------
    rows
        One row for each cell and replicate, as in a result folder; rows that are already combined are returned
        unchanged.

    Returns
    -------
    list of dict
        Rows in the order of the cells' first replicates. On a simulated rig `score` is the median over replicates, with
        the interval of the median (:func:`median_interval`), None for fewer than five. On recordings, and for a single
        campaign whose split holds out five units, the replicates are the units held out, and the row's own interval is
        kept; of several seeds on the same recordings, the row with the median score is returned.
        Times are medians over the runs of one host. Recordings, answers and key are those of the first replicate.

    Notes
    -----
    Keys that are added: `repeats` (number of replicates, with those that failed), `n_replicates`, `replicate_unit`,
    `replicate_scores`, `seeds`, `score_min` and `score_max` (the range of the replicates' scores). `recordings_right`
    and `recordings_asked` are means over replicates.

    The score for ranking is decided here: if all rows that can be in the same table have an error against the true
    force, `metric` is ``true_rmse``, and `score`, intervals and replicates are of that error; the error against the
    reference is under `reference_score`. The error beyond the noise floor, an estimate of the true error, is then
    left out.
    """
    rows = _by_truth(rows)
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(_name(row), []).append(row)
    found = [_of_all(name, sorted(members, key=itemgetter("seed"))) for name, members in groups.items()]
    _fill_baselines(found)
    return found


def _by_truth(rows: Sequence[Row]) -> list[Row]:
    unknown = {_ranked_together(row) for row in rows if row["status"] == "done" and row.get("true_score") is None}
    return [_true(row) if row["status"] == "done" and _ranked_together(row) not in unknown else row for row in rows]


def _true(row: Row) -> Row:
    if row["metric"].startswith(TRUE):
        return row
    kept = row.get("replicates") or {}
    truth = kept.get("true")
    return {
        **row,
        "metric": f"{TRUE}{row['metric']}",
        **{end: row.get(f"true_{end}") for end in ("score", "ci_low", "ci_high")},
        **{f"reference_{end}": row[end] for end in ("score", "ci_low", "ci_high")},
        **dict.fromkeys(("score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high")),
        "replicates": {**{key: kept[key] for key in ("unit", "names", "strata")}, **truth} if truth else {},
    }


def against_reference(row: Row) -> Row:
    """Return a row with its score against the recorded reference, as in published errors, not the true force."""
    if row.get("reference_score") is None:
        return row
    return {
        **row,
        "metric": row["metric"].removeprefix(TRUE),
        **{end: row[f"reference_{end}"] for end in ("score", "ci_low", "ci_high")},
        "replicate_scores": row.get("reference_scores") or [],
    }


def _fill_baselines(rows: Sequence[dict[str, Any]]) -> None:
    """Set `baseline` in every row: the best score of its group's trivial estimators with no more input than the row's.

    A trivial estimator that uses the time of a sample can learn the force ramp commanded in every recording, which
    readings do not contain. It is a baseline only for estimators that use the time too. An estimator that uses the
    reference (an oracle) is a baseline for none.
    """
    by_group: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        if row.get("is_baseline") and row["status"] == "done":
            by_group.setdefault(_group(row), []).append(row)
    for row in rows:
        knowing = {"reference"} if row.get("looks_at") == "time" else {"reference", "time"}
        able = [one for one in by_group.get(_group(row), ()) if one.get("looks_at") not in knowing]
        best = min if able and lower_is_better(able[0]["metric"]) else max
        row["baseline"] = best((one["score"] for one in able), default=None)


def _name(row: Row) -> str:
    """Return the name of a row's cell without the seed of the replicate."""
    cell = str(row["cell"])
    return cell if row.get("n_replicates") else cell.removesuffix(f"/{row['seed']}")


def _of_all(name: str, members: Sequence[Row]) -> dict[str, Any]:
    first = members[0]
    if first.get("n_replicates"):
        return dict(first)
    done = [row for row in members if row["status"] == "done"]
    named = {"cell": name, "repeats": len(members)}
    if not done:
        return {**first, **_counted([first], len(members), "replicate", []), "replicates": {}, **named}
    found = _of_campaigns(done) if done[0]["simulated"] else _of_recordings(done)
    stopped = [
        f"replicate with seed {row['seed']}: {row['status']}: {row['reason']}"
        for row in members if row["status"] != "done"
    ]  # fmt: skip
    return {**found, **named, "remarks": [*_texts(done, "remarks"), *stopped], "findings": _texts(done, "findings")}


def _of_campaigns(done: Sequence[Row]) -> dict[str, Any]:
    """Return the combined row of a simulated cell, whose replicates are separately simulated campaigns."""
    first = done[0]
    if len(done) == 1 and first["ci_low"] is not None and "own" in (first.get("replicates") or {}):
        return _of_recordings(done)  # its split holds out enough of what is simulated, too: devices, placements
    timed = next((row for row in done if row.get("fit_s") is not None), first)
    here = [row for row in done if row["host"] == timed["host"]]
    found = {**first, **{key: timed[key] for key in Cost.model_fields if key in timed}}
    for key in [key for key in _MEDIANS if key in first]:
        found[key] = _median([row.get(key) for row in (here if key in Cost.model_fields else done)])
    for key, prefix in _INTERVALS.items():
        if f"{prefix}ci_low" in first:
            values = [row.get(key) for row in done]
            low, high = (None if None in values else median_interval(values)) or (None, None)
            found |= {f"{prefix}ci_low": low, f"{prefix}ci_high": high}
    scores = [row["score"] for row in done]
    parts = _middle([row.get("delay_parts_ms") or {} for row in here])
    events = [row.get("events") or {} for row in done]
    alarms: list[Any] = [one.get("alarms") for one in events]  # their mean is 0 only where none ever alarms
    return found | {
        **_counted(done, len(done), "replicate", scores),
        **({"reference_scores": [row["reference_score"] for row in done]} if "reference_score" in first else {}),
        "ci_method": f"order statistics of {len(done)} replicates" if len(done) >= FEWEST else "",
        "replicates": _kept(done) if len(done) >= FEWEST else {},
        "chosen": _chosen(done),
        "scores": _middle([row["scores"] for row in done]),
        "events": _middle(events) | ({} if None in alarms else {"alarms": sum(alarms) / len(alarms)}),
        "delay_parts_ms": parts,
        "answer_delay_ms": None if found.get("answer_delay_ms") is None else sum(parts.values()),
        "confusion": _added([row["confusion"] for row in done]),
        "counts": dict(sum((Counter(row["counts"]) for row in done), Counter[str]())),
    }


def _kept(done: Sequence[Row]) -> dict[str, Any]:
    """Return the replicates of a simulated cell, with their scores, for comparisons between cells."""
    kept: dict[str, Any] = {
        "unit": "replicate",
        "names": [str(row["seed"]) for row in done],
        "strata": None,
        "scores": [row["score"] for row in done],
    }
    if all(row.get("score_beyond_floor") is not None for row in done):
        kept["beyond"] = [row["score_beyond_floor"] for row in done]
        kept["excess"] = [row["score"] ** 2 - row["reference_floor"] ** 2 for row in done]
    return kept


def _of_recordings(done: Sequence[Row]) -> dict[str, Any]:
    """Return the row with the median score over seeds, for a cell whose replicates are the units held out by its split.

    The interval is removed from a row without scores of single units, since it is over something else.
    """
    middle = median_low([row["score"] for row in done])
    row = next(row for row in done if row["score"] == middle)
    kept = row.get("replicates") or {}
    own, unit = kept.get("own") or [], str(kept.get("unit") or "session")
    found = {**row, **_counted(done, max(len(own), 1), unit, [one for one in own if one is not None])}
    if not own or row["ci_low"] is None:
        ends = [f"{prefix}ci_{end}" for prefix in _INTERVALS.values() for end in ("low", "high")]
        found |= {**dict.fromkeys(end for end in ends if end in row), "ci_method": "", "replicates": {}}
    return found


def _counted(done: Sequence[Row], n: int, unit: str, scores: list[float]) -> dict[str, Any]:
    finite = [score for score in scores if math.isfinite(score)]
    return {
        "n_replicates": n,
        "replicate_unit": unit,
        "replicate_scores": scores,
        "seeds": [row["seed"] for row in done],
        "score_min": min(finite, default=None),
        "score_max": max(finite, default=None),
    }


def _median(values: Sequence[Any]) -> float | None:
    known = [float(value) for value in values if value is not None]
    return median(known) if known else None


def _chosen(done: Sequence[Row]) -> dict[str, Any]:
    """Return the lower medians, over replicates, of the parameters chosen on validation data."""
    names = dict.fromkeys(name for row in done for name in row["chosen"])
    return {name: median_low([row["chosen"][name] for row in done if name in row["chosen"]]) for name in names}


def _middle(several: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    names = dict.fromkeys(name for one in several for name in one)
    return {name: _median([one.get(name) for one in several]) for name in names}


def _added(tables: Sequence[Any]) -> Any:
    """Return the sum of confusion matrices; only the first matrix if their numbers of classes differ."""
    if any(table is None or len(table) != len(tables[0]) for table in tables):
        return tables[0]
    return [[sum(counts) for counts in zip(*lines, strict=True)] for lines in zip(*tables, strict=True)]


def _texts(done: Sequence[Row], key: str) -> list[str]:
    """Return the texts under `key` in any row, with the number of replicates if not all rows have the text."""
    counts = Counter(text for row in done for text in dict.fromkeys(row.get(key) or ()))
    return [text if n == len(done) else f"in {n} of {len(done)} replicates: {text}" for text, n in counts.items()]


def median_interval(values: Sequence[Any]) -> tuple[float, float] | None:
    """Return the 95 % interval of the median of the distribution of `values`; None for fewer than five values.

    Notes
    -----
    The interval from the k-th smallest to the k-th largest of n values covers the median with probability
    ``1 - 2 P(B < k)``, B binomial with n and 1/2, for any continuous distribution. The ends are interpolated between
    the two k whose probabilities enclose 95 % [1]_: the coverage is 95 % for smooth distributions, and for others at
    least :func:`least_coverage`. The range of five values covers the median in only 93.75 %.

    References
    ----------
    .. [1] Hettmansperger and Sheather 1986, Confidence intervals based on interpolated order statistics, Statistics and
       Probability Letters 4, equation 2.
    """
    n = len(values)
    if n < FEWEST:
        return None
    ordered = sorted(map(float, values))
    k = _depth(n)
    held, next_held = _coverage(n, k), _coverage(n, k + 1)
    if held <= LEVEL:
        return ordered[0], ordered[-1]
    share = (held - LEVEL) / (held - next_held)
    weight = (n - k) * share / (k + (n - 2 * k) * share)
    low = ordered[k - 1] + weight * (ordered[k] - ordered[k - 1])  # of equal values exactly these
    high = ordered[n - k] - weight * (ordered[n - k] - ordered[n - k - 1])
    return low, high


def least_coverage(n: int) -> float:
    """Return the least coverage, over all distributions, of the median's interval from `n` values, n at least 5."""
    return _coverage(n, 1) if n == FEWEST else _coverage(n, _depth(n) + 1)


def _depth(n: int) -> int:
    """Return the largest k whose k-th smallest and k-th largest of n values cover 95 %, or 1."""
    return next(k for k in range(1, n) if _coverage(n, k + 1) < LEVEL)


def counted(n: int, unit: str) -> str:
    """Return a number of units of replication as text: ``8 replicates``, ``20 presses``, ``1 session``."""
    return f"{n} {unit if n == 1 else plural(unit)}"


def count_range(counts: Sequence[int], unit: str) -> str:
    """Return the range of several numbers of units as text: ``5 to 8 sessions``."""
    least, most = min(counts), max(counts)
    return counted(most, unit) if least == most else f"{least} to {counted(most, unit)}"


def percent(n: int | None, unit: str | None) -> str:
    """Return the coverage of an interval over `n` units (replicates, sessions …) as text: ``95 %``."""
    return "93.8 %" if n == FEWEST and unit == "replicate" else "95 %"


def _coverage(n: int, k: int) -> float:
    """Return the probability that the median lies between the k-th smallest and the k-th largest of n values."""
    return 1.0 - 2.0 * sum(comb(n, i) for i in range(k)) / float(2**n)
