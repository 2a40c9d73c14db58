"""Do intervals cover what they say, and do tests find what is not there? Synthetic sensors whose truth is known.

::

    python benchmarks/coverage.py [--trials 1000] [--seed 1] [--only PART]

A synthetic sensor's error has a part that stays for a session (another in the next one; "session sd" is its deviation,
that of the rest is 1) and a part that moves slowly within it, first order with memory 0.9. The truth is the score over
infinitely many sessions: exact for numbers, from a million rows for classes. Every interval is nominally 95 %, every
test nominally 5 %; a binomial deviation of 1,000 trials is 0.7 %.

The intervals and tests are tactbench's own, called as a run and `tactbench compare` call them; what they are held
against (percentiles of resampled sessions, ranks resampled, rows taken as independent) is a few lines here.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from scipy import stats
from scipy.signal import lfilter

from tactbench.core.evaluation.interval import ReplicateUnits, score_interval
from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.evaluation.reference_floor import Floor, beyond_floor, hold_of
from tactbench.core.samples import Answers
from tactbench.core.statistics.paired import difference
from tactbench.core.statistics.ranking import ranks
from tactbench.core.statistics.replicates import least_coverage, median_interval

ROWS = 60
MEMORY = 0.9
CLASSES = 3
PRESSES, PER_PRESS, OF_PRESSES = 10, 10, 0.3
"""Presses of a unit, rows of a press, and the deviation of what stays for a press."""
SESSIONS = (5, 8, 15, 30)


def slow(rng: np.random.Generator, *shape: int, memory: float = MEMORY) -> np.ndarray:
    """Return (…, n) of variance 1 whose neighbours are alike."""
    noise = rng.normal(size=shape) * np.sqrt(1 - memory**2)
    noise[..., 0] /= np.sqrt(1 - memory**2)
    return lfilter([1.0], [1.0, -memory], noise, axis=-1)


def numbers(rng: np.random.Generator, sessions: int, spread: float, scale: float = 1.0, shared=None, n: int = ROWS):
    """Return truth and answers, (sessions, n): an offset a session, and a slow error."""
    own = rng.normal(size=(sessions, 1))
    offset = own if shared is None else np.sqrt(0.5) * (own + shared)
    return np.zeros((sessions, n)), scale * (spread * offset + slow(rng, sessions, n))


def classes(rng: np.random.Generator, sessions: int, spread: float, ease: float = 1.0, shared=None, n: int = ROWS):
    """Return truth and answers, (sessions, n): right while a slow latent quantity is above 0."""
    own = rng.normal(size=(sessions, 1))
    offset = own if shared is None else np.sqrt(0.5) * (own + shared)
    y = np.tile(np.repeat(np.arange(CLASSES), n // CLASSES), (sessions, 1))
    right = ease + spread * offset + slow(rng, sessions, n) > 0
    return y, np.where(right, y, (y + rng.integers(1, CLASSES, size=y.shape)) % CLASSES)


def sums_of(metric: str, y: np.ndarray, answered: np.ndarray) -> np.ndarray:
    """Return (sessions, m) the metric's summands over each session."""
    k = CLASSES if METRICS[metric].kind == "classification" else 0
    rows = METRICS[metric].rows(y.ravel(), answered.ravel(), k)
    return rows.reshape(*y.shape, -1).sum(axis=1)


def truth_of(metric: str, draw: Callable, spread: float, level: float) -> float:
    """Return the score over infinitely many sessions."""
    if metric == "rmse":
        return level * np.sqrt(1 + spread**2)
    if metric == "mae":
        return level * np.sqrt((1 + spread**2) * 2 / np.pi)
    y, answered = draw(np.random.default_rng(99), 20_000, spread, level)
    return METRICS[metric].of(y.ravel(), answered.ravel(), CLASSES)


def percentile(metric: str, sums: np.ndarray, rng: np.random.Generator) -> tuple[float, float]:
    """Return the interval of resampled sessions, widened as Student's t."""
    n = len(sums)
    tail = stats.norm.cdf(-stats.t.ppf(0.975, n - 1) * np.sqrt(n / (n - 1)))
    k = CLASSES if METRICS[metric].kind == "classification" else 0
    drawn = METRICS[metric].score(rng.multinomial(n, np.full(n, 1 / n), size=1000) @ sums, k)
    return tuple(np.quantile(drawn, [tail, 1 - tail]))


def row_of(cell: str, metric: str, sums: np.ndarray, **more) -> dict:
    """Return a row as an evaluation leaves it, as far as statistics look at it."""
    k = CLASSES if METRICS[metric].kind == "classification" else 0
    lines = sums.tolist()
    if k:
        lines = [[int(v) for c in np.flatnonzero(line) for v in (c, line[c])] for line in sums]
    kept = {"unit": "session", "names": [str(place) for place in range(len(sums))], "strata": None}
    return {
        "cell": cell, "status": "done", "is_baseline": False, "metric": metric, "classes": list(range(k)),
        "score": float(METRICS[metric].score(sums.sum(axis=0), k)), "ci_low": None, "ci_high": None,
        "replicates": kept | {"sums": lines},
    } | more  # fmt: skip


def table(title: str, columns: list[str], lines: list[list[str]]) -> None:
    """Print lines under their columns."""
    widths = [max(len(line[place]) for line in [columns, *lines]) for place in range(len(columns))]
    print(f"\n{title}")
    for line in [columns, *lines]:
        print("  " + "  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)))


def scores(trials: int, seed: int) -> None:
    """Cover the truth by the interval of one score over sessions."""
    lines = []
    for metric, draw, level in (
        ("rmse", numbers, 1.0), ("mae", numbers, 1.0), ("accuracy", classes, 1.0), ("macro_f1", classes, 1.0),
        ("macro_f1", classes, 2.0),
    ):  # fmt: skip
        for spread in (0.3, 0.5, 1.0):
            truth = truth_of(metric, draw, spread, level)
            cells = [metric, f"{truth:.3f}", f"{spread:g}"]
            for sessions in SESSIONS:
                rng = np.random.default_rng([seed, sessions, int(10 * spread), int(level)])
                hits, wider = np.zeros(2), []
                for _ in range(trials):
                    y, answered = draw(rng, sessions, spread, level)
                    code = np.repeat(np.arange(sessions), ROWS)
                    k = CLASSES if draw is classes else 0
                    unit = ReplicateUnits("session", code, ())
                    found = score_interval(METRICS[metric], y.ravel(), answered.ravel(), unit, k)
                    low, high = percentile(metric, sums_of(metric, y, answered), rng)
                    end = np.inf if found.high is None else found.high
                    hits += found.low <= truth <= end, low <= truth <= high
                    wider.append((end - found.low) / max(high - low, 1e-9))
                shares = " / ".join(f"{100 * hit / trials:.1f}" for hit in hits)
                cells.append(f"{shares} x{np.median(wider):.1f}")
            lines.append(cells)
    columns = ["metric", "truth", "session sd", *(f"{n} sessions" for n in SESSIONS)]
    title = (
        "Coverage [%] of a score's interval: ours / widened percentiles of resampled sessions, x how much wider ours is"
    )
    table(title, columns, lines)


def boards(trials: int, seed: int) -> None:
    """Cover the truth by what a table prints of units with ten presses each; fewer than five print no interval."""
    lines = []
    rows = np.arange(PRESSES * PER_PRESS)
    for kind, level in (("rmse", 0.0), *(("accuracy", level) for level in (1.0, 2.0, 3.0))):
        for spread in (0.1, 0.5, 1.0):
            variance = 1.0 + spread**2 + OF_PRESSES**2
            truth = np.sqrt(variance) if kind == "rmse" else stats.norm.cdf(level / np.sqrt(variance))
            cells = [kind, f"{truth:.3f}", f"{spread:g}"]
            for units in (2, 5, 6, 12):
                rng = np.random.default_rng([seed, units, int(10 * spread), int(level)])
                printed = hits = 0
                for _ in range(trials):
                    of_unit, of_press = rng.normal(size=(units, 1, 1)), rng.normal(size=(units, PRESSES, 1))
                    error = spread * of_unit + OF_PRESSES * of_press + rng.normal(size=(units, PRESSES, PER_PRESS))
                    y, answered = np.zeros(error.size), error.ravel()
                    if kind == "accuracy":
                        y = np.tile([0, 1], error.size // 2)
                        answered = np.where(level + error.ravel() > 0, y, 1 - y)
                    unit = ReplicateUnits("session", np.repeat(np.arange(units), len(rows)), ())
                    found = score_interval(METRICS[kind], y, answered, unit, 2 * (kind == "accuracy"))
                    printed += found.low is not None
                    end = np.inf if found.high is None else found.high
                    hits += found.low is not None and found.low <= truth <= end
                cells.append(f"{100 * hits / printed:.1f}" if printed else "none")
            lines.append(cells)
    columns = ["metric", "truth", "unit sd", *(f"{n} units" for n in (2, 5, 6, 12))]
    table(f"Coverage [%] of printed intervals; presses' sd {OF_PRESSES}, rows' 1", columns, lines)


def differences(trials: int, seed: int) -> None:
    """Cover the true difference of two sensors on the same sessions, and find none where there is none."""
    lines = []
    for metric, draw, levels in (
        ("rmse", numbers, (1.0, 1.2)), ("rmse", numbers, (1.0, 1.0)),
        ("macro_f1", classes, (1.0, 1.5)), ("macro_f1", classes, (2.0, 2.0)),
    ):  # fmt: skip
        for spread in (0.5, 1.0):
            truth = truth_of(metric, draw, spread, levels[0]) - truth_of(metric, draw, spread, levels[1])
            for sessions in SESSIONS:
                rng = np.random.default_rng([seed, sessions, int(10 * spread)])
                cover, by_t, by_p, naive = 0, 0, 0, 0
                for _ in range(trials):
                    shared = rng.normal(size=(sessions, 1))
                    pair = [draw(rng, sessions, spread, level, shared) for level in levels]
                    rows = [row_of(name, metric, sums_of(metric, *one)) for name, one in zip("ab", pair, strict=True)]
                    found = difference(*rows)
                    cover += found.low <= truth <= found.high
                    by_t += not found.low <= 0 <= found.high
                    by_p += found.p <= 0.05
                    losses = [(one[0] != one[1]) * 1.0 if draw is classes else (one[1] - one[0]) ** 2 for one in pair]
                    naive += stats.ttest_rel(losses[0].ravel(), losses[1].ravel()).pvalue <= 0.05
                same = levels[0] == levels[1]
                shares = [f"{100 * n / trials:.1f}" for n in (cover, by_t, by_p, naive)]
                lines.append([metric, f"{truth:+.3f}", f"{spread:g}", str(sessions), shares[0],
                              *(shares[1:] if same else ("", "", ""))])  # fmt: skip
    columns = ["metric", "truth", "session sd", "sessions", "coverage", "wrong: interval", "wrong: p", "wrong: rows"]
    table("Paired differences: coverage [%]; where there is none, how often one is found [%]", columns, lines)


def ranking(trials: int, seed: int) -> None:
    """Cover the true rank of ten sensors on the same sessions."""
    lines = []
    k = 10
    for step in (0.01, 0.05, 0.2):
        for sessions in SESSIONS:
            rng = np.random.default_rng([seed, sessions, int(100 * step)])
            ours = resampled = first = 0.0
            for _ in range(max(trials // 5, 1)):  # ten ranks each
                shared = rng.normal(size=(sessions, 1))
                sums = [sums_of("rmse", *numbers(rng, sessions, 0.5, 1 + step * place, shared)) for place in range(k)]
                found = ranks([row_of(str(place), "rmse", one) for place, one in enumerate(sums)])
                each = [found[str(place)] for place in range(k)]
                ours += np.mean([one.low <= 1 + place <= one.high for place, one in enumerate(each)])
                first += each[0].place == 1
                times = rng.multinomial(sessions, np.full(sessions, 1 / sessions), size=1000)
                drawn = np.argsort(np.argsort([METRICS["rmse"].score(times @ one, 0) for one in sums], axis=0), axis=0)
                low, high = np.quantile(1 + drawn, [0.025, 0.975], axis=1, method="inverted_cdf")
                resampled += np.mean((low <= 1 + np.arange(k)) & (1 + np.arange(k) <= high))
            share = [f"{100 * n / max(trials // 5, 1):.1f}" for n in (ours, resampled, first)]
            lines.append([f"{100 * step:g} %", str(sessions), *share])
    columns = ["step", "sessions", "ours", "ranks resampled", "best has place 1"]
    table(f"Coverage [%] of the ranks of {k} sensors, each worse by a step; a fifth of the trials", columns, lines)


def beyond(trials: int, seed: int) -> None:
    """Cover an answer's own error, slow in time, under a reference with the noise and the holds of the paper."""
    sigma, hold, n = 0.6875, 600, 4400
    lines = []
    for sessions in (5, 8):
        for own in (0.05, 0.1, 0.2, 0.5):
            rng = np.random.default_rng([seed, sessions, int(100 * own)])
            ours = fixed = clear = 0
            for _ in range(trials):
                noise = sigma * rng.normal(size=(sessions, hold + n))
                wrong = own * slow(rng, sessions, n)
                y, answered = noise[:, hold:].ravel(), wrong.ravel()
                session = np.repeat(np.arange(sessions), n)
                row = np.tile(np.arange(hold, hold + n), sessions)
                answers = Answers(y, answered, session, row, np.zeros_like(row), row.astype(np.float64), y)
                floor = Floor({place: hold_of(noise[place, :hold]) for place in range(sessions)})
                unit = ReplicateUnits("session", session, tuple(map(str, range(sessions))))
                _, found = beyond_floor(floor, answers, unit)
                ours += found.low <= own <= found.high
                clear += found.low > 0
                whole = score_interval(METRICS["rmse"], y, answered, unit, 0)
                low, high = (np.sqrt(max(0.0, end**2 - floor.value**2)) for end in (whole.low, whole.high or np.inf))
                fixed += low <= own <= high
            share = [f"{100 * count / trials:.1f}" for count in (ours, fixed, clear)]
            lines.append([str(sessions), f"{own:g}", *share])
    columns = ["sessions", "own error [N]", "ours", "ends of the RMSE", "clear of 0"]
    table("Coverage [%] of the error beyond a floor of 0.6875 N", columns, lines)


def medians(trials: int, seed: int) -> None:
    """Cover the median over all campaigns by the interval of the median of a few."""
    draws = {
        "normal": lambda rng, shape: rng.standard_normal(shape),
        "exponential": lambda rng, shape: rng.standard_exponential(shape) - np.log(2),
        "two groups": lambda rng, shape: rng.choice([-1.0, 1.0], size=shape) + 0.1 * rng.standard_normal(shape),
    }
    lines = []
    for name, draw in draws.items():
        cells = [name]
        for n in (5, 6, 7, 8, 10, 16):
            found = map(median_interval, draw(np.random.default_rng([seed, n]), (trials, n)))
            cells.append(f"{100 * np.mean([low <= 0 <= high for low, high in found]):.1f}")
        lines.append(cells)
    lines.append(["at least", *(f"{100 * least_coverage(n):.1f}" for n in (5, 6, 7, 8, 10, 16))])
    table("Coverage [%] of the median by campaigns", ["scores", *map(str, (5, 6, 7, 8, 10, 16))], lines)


PARTS = {
    "medians": medians,
    "scores": scores,
    "boards": boards,
    "differences": differences,
    "ranks": ranking,
    "floor": beyond,
}


def main() -> None:
    """Print a table a part."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=PARTS)
    given = parser.parse_args()
    for name, part in PARTS.items():
        if given.only in (None, name):
            began = time.perf_counter()
            part(given.trials, given.seed)
            print(f"  ({given.trials} trials, {time.perf_counter() - began:.0f} s)")


if __name__ == "__main__":
    main()
